#include "reconstruct/internal/slice_spool.h"

#include "core/error.h"

#include <cerrno>
#include <cstdlib>
#include <unistd.h>

namespace nacre::reconstruct::internal {
namespace {

// POSIX may move fewer bytes than asked for.
template <class Byte, class Move>
void MoveAll(Byte* bytes, std::size_t count, std::int64_t offset, Move&& move) {
  while (count > 0) {
    const ssize_t moved = move(bytes, count, offset);
    if (moved < 0 && errno == EINTR) {
      continue;
    }
    if (moved <= 0) {
      throw SystemError("cannot use the temporary file of slices that wait");
    }
    bytes += moved;
    count -= static_cast<std::size_t>(moved);
    offset += moved;
  }
}

constexpr std::size_t kBytesAValue = 2 * sizeof(float) + 1;

}  // namespace

SliceSpool::SliceSpool(std::filesystem::path folder, const RdHeader& header)
    : folder_(std::move(folder)),
      values_(static_cast<std::size_t>(header.SliceSize())),
      holds_(static_cast<std::size_t>(header.PointCount()), false) {}

SliceSpool::~SliceSpool() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

void SliceSpool::Park(std::int64_t s, const RdSlice& slice) {
  if (fd_ < 0) {
    std::string path = (folder_ / ".nacre-slices-XXXXXX").string();
    fd_ = ::mkstemp(path.data());
    if (fd_ < 0) {
      throw SystemError("cannot make a temporary file in " + folder_.string());
    }
    ::unlink(path.c_str());
  }
  const auto write = [this](const char* bytes, std::size_t count, off_t offset) {
    return ::pwrite(fd_, bytes, count, offset);
  };
  const std::size_t floats = values_ * sizeof(float);
  auto offset = s * static_cast<std::int64_t>(values_ * kBytesAValue);
  const auto put = [&](const void* data, std::size_t count) {
    MoveAll(static_cast<const char*>(data), count, offset, write);
    offset += static_cast<std::int64_t>(count);
  };
  put(slice.rd.data(), floats);
  put(slice.sigma.data(), floats);
  put(slice.valid.data(), values_);
  holds_[static_cast<std::size_t>(s)] = true;
}

RdSlice SliceSpool::Fetch(std::int64_t s) const {
  Expect(Holds(s), "a slice that was parked");
  RdSlice slice{std::vector<float>(values_),
                std::vector<float>(values_),
                std::vector<std::uint8_t>(values_)};
  const auto read = [this](char* bytes, std::size_t count, off_t offset) {
    return ::pread(fd_, bytes, count, offset);
  };
  const std::size_t floats = values_ * sizeof(float);
  auto offset = s * static_cast<std::int64_t>(values_ * kBytesAValue);
  const auto get = [&](void* data, std::size_t count) {
    MoveAll(static_cast<char*>(data), count, offset, read);
    offset += static_cast<std::int64_t>(count);
  };
  get(slice.rd.data(), floats);
  get(slice.sigma.data(), floats);
  get(slice.valid.data(), values_);
  return slice;
}

}  // namespace nacre::reconstruct::internal
