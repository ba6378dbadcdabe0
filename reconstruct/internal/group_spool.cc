#include "reconstruct/internal/group_spool.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/ranks.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace nacre::reconstruct::internal {
namespace {

// The head of the file; a file of another version differs in the first word.
struct FileHead {
  std::array<char, 8> magic = {'N', 'A', 'C', 'R', 'E', 'W', 'K', '3'};
  std::uint64_t key = 0;
  std::int64_t group_count = 0;
  std::int64_t value_count = 0;
  std::int64_t ring_count = 0;
  friend bool operator==(const FileHead&, const FileHead&) = default;
};

constexpr int kArrays = 3;  // R_d, sigma, floor

void WriteAll(int fd, const void* data, std::size_t count, std::int64_t offset) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  while (count > 0) {
    const ssize_t moved = ::pwrite(fd, bytes, count, offset);
    if (moved < 0 && errno == EINTR) {
      continue;
    }
    if (moved <= 0) {
      throw SystemError("cannot write the work file of a reconstruction");
    }
    bytes += moved;
    count -= static_cast<std::size_t>(moved);
    offset += moved;
  }
}

}  // namespace

struct GroupSpool::SlotHead {
  std::uint64_t state = 0;    // of the pictures it was made of
  std::uint64_t payload = 0;  // hash of the values; 0: none yet
  std::int64_t frame_count = 0;
  std::int64_t saturated_count = 0;
};

GroupSpool::GroupSpool(const std::filesystem::path& path,
                       bool is_named,
                       const Shape& shape,
                       const Ranks* ranks)
    : shape_(shape), held_(static_cast<std::size_t>(shape.group_count), 0) {
  Open(path, is_named, ranks);
  const std::int64_t size = Offset(static_cast<int>(shape.group_count));
  void* data =
      ::mmap(nullptr, static_cast<std::size_t>(size), PROT_READ, MAP_SHARED, fd_, 0);
  if (data == MAP_FAILED) {
    throw SystemError("cannot map the work file " + path.string());
  }
  mapped_ = static_cast<const unsigned char*>(data);
}

// The root makes the file, the others open it by its name, which it then loses unless
// it is to keep it.
void GroupSpool::Open(const std::filesystem::path& path,
                      bool is_named,
                      const Ranks* ranks) {
  std::string name = path.string();
  if (ranks == nullptr || ranks->IsRoot()) {
    if (is_named) {
      fd_ = ::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    } else {
      name = (path.parent_path() / ".nacre-groups-XXXXXX").string();
      fd_ = ::mkostemp(name.data(), O_CLOEXEC);
    }
    if (fd_ >= 0) {
      Begin(path);
    }
  }
  if (ranks != nullptr) {
    ranks->Broadcast(name);
    if (!ranks->IsRoot()) {
      fd_ = ::open(name.c_str(), O_RDWR | O_CLOEXEC);
    }
    ranks->Barrier();
  }
  if (!is_named && fd_ >= 0 && (ranks == nullptr || ranks->IsRoot())) {
    ::unlink(name.c_str());
  }
  if (fd_ < 0) {
    throw SystemError("cannot make the work file " + path.string());
  }
}

// Keeps what is there if it is of the same shape and key.
void GroupSpool::Begin(const std::filesystem::path& path) const {
  const FileHead wanted{.key = shape_.key,
                        .group_count = shape_.group_count,
                        .value_count = shape_.value_count,
                        .ring_count = shape_.channel_count * shape_.most_spots};
  FileHead found{};
  struct stat status {};
  const std::int64_t size = Offset(static_cast<int>(shape_.group_count));
  const bool goes_on = ::pread(fd_, &found, sizeof found, 0) == sizeof found &&
                       found == wanted && ::fstat(fd_, &status) == 0 &&
                       status.st_size == size;
  if (goes_on) {
    return;
  }
  if (::ftruncate(fd_, 0) != 0 || ::ftruncate(fd_, size) != 0) {
    throw SystemError("cannot make the work file " + path.string());
  }
  WriteAll(fd_, &wanted, sizeof wanted, 0);
}

GroupSpool::~GroupSpool() {
  if (mapped_ != nullptr) {
    ::munmap(const_cast<unsigned char*>(mapped_),
             static_cast<std::size_t>(Offset(static_cast<int>(shape_.group_count))));
  }
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

std::int64_t GroupSpool::PayloadBytes() const {
  return kArrays * shape_.value_count * static_cast<std::int64_t>(sizeof(float)) +
         shape_.channel_count * shape_.most_spots *
             static_cast<std::int64_t>(sizeof(SpotRings));
}

std::int64_t GroupSpool::Offset(int g) const {
  const auto whole = static_cast<std::int64_t>(sizeof(SlotHead));
  const std::int64_t slot = (PayloadBytes() + whole - 1) / whole * whole + whole;
  return static_cast<std::int64_t>(sizeof(FileHead)) + g * slot;
}

const GroupSpool::SlotHead& GroupSpool::Head(int g) const {
  return *static_cast<const SlotHead*>(static_cast<const void*>(mapped_ + Offset(g)));
}

std::span<const float> GroupSpool::Rd(int g) const {
  return {static_cast<const float*>(
              static_cast<const void*>(mapped_ + Offset(g) + sizeof(SlotHead))),
          static_cast<std::size_t>(shape_.value_count)};
}

std::span<const float> GroupSpool::Sigma(int g) const {
  return {Rd(g).data() + shape_.value_count,
          static_cast<std::size_t>(shape_.value_count)};
}

std::span<const float> GroupSpool::Floor(int g) const {
  return {Rd(g).data() + 2 * shape_.value_count,
          static_cast<std::size_t>(shape_.value_count)};
}

std::span<const SpotRings> GroupSpool::Rings(int g, int channel) const {
  const auto* first = static_cast<const SpotRings*>(
      static_cast<const void*>(Rd(g).data() + kArrays * shape_.value_count));
  return {first + channel * shape_.most_spots,
          static_cast<std::size_t>(shape_.most_spots)};
}

void GroupSpool::Forget() const {
  // The map is shared and only read: nothing is lost, and if it fails nothing is won.
  ::madvise(const_cast<unsigned char*>(mapped_),
            static_cast<std::size_t>(Offset(static_cast<int>(shape_.group_count))),
            MADV_DONTNEED);
}

std::int64_t GroupSpool::FrameCount(int g) const {
  return Head(g).frame_count;
}

std::int64_t GroupSpool::SaturatedCount(int g) const {
  return Head(g).saturated_count;
}

void GroupSpool::Share(const Ranks& ranks) {
  std::vector<std::int64_t> held(held_.begin(), held_.end());
  ranks.Sum(held);
  std::transform(held.begin(), held.end(), held_.begin(), [](std::int64_t ranks_held) {
    return static_cast<char>(ranks_held > 0);
  });
}

bool GroupSpool::TakeUp(int g, std::uint64_t state) {
  const SlotHead& head = Head(g);
  const auto bytes = static_cast<std::size_t>(PayloadBytes());
  const bool whole = head.payload != 0 && head.state == state &&
                     head.payload == Hash64(Rd(g).data(), bytes);
  held_[static_cast<std::size_t>(g)] = whole ? 1 : 0;
  return whole;
}

void GroupSpool::Park(int g, std::uint64_t state, const GroupPicture& picture) {
  Expect(std::ssize(picture.rings) == shape_.channel_count * shape_.most_spots,
         "rings of the spool's shape");
  std::int64_t offset = Offset(g) + static_cast<std::int64_t>(sizeof(SlotHead));
  const auto write = [&](const auto& values) {
    const std::size_t size = values.size() * sizeof(values[0]);
    WriteAll(fd_, values.data(), size, offset);
    offset += static_cast<std::int64_t>(size);
  };
  for (const std::vector<float>* values :
       {&picture.rd, &picture.sigma, &picture.floor}) {
    Expect(std::ssize(*values) == shape_.value_count, "a picture of the spool's shape");
    write(*values);
  }
  write(picture.rings);
  const SlotHead head{
      .state = state,
      .payload = Hash64(Rd(g).data(), static_cast<std::size_t>(PayloadBytes())),
      .frame_count = picture.frame_count,
      .saturated_count = picture.saturated_count};
  WriteAll(fd_, &head, sizeof head, Offset(g));
  held_[static_cast<std::size_t>(g)] = 1;
}

}  // namespace nacre::reconstruct::internal
