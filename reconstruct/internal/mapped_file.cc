#include "reconstruct/internal/mapped_file.h"

#include "core/error.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace nacre::reconstruct::internal {

MappedFile::MappedFile(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw Error("cannot read " + path.string() + ": there is no such file");
  }
  const std::size_t size = std::filesystem::file_size(path);
  if (size == 0) {
    return;
  }
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    throw SystemError("cannot read " + path.string());
  }
  void* data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd, 0);
  ::close(fd);
  if (data == MAP_FAILED) {
    throw SystemError("cannot read " + path.string());
  }
  bytes_ = {static_cast<const unsigned char*>(data), size};
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) {
    ::munmap(const_cast<unsigned char*>(bytes_.data()), bytes_.size());
  }
}

}  // namespace nacre::reconstruct::internal
