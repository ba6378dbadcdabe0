#pragma once

#include "reconstruct/internal/group_reader.h"

#include <cstdint>
#include <filesystem>
#include <span>

namespace nacre {
class Ranks;
}

namespace nacre::reconstruct::internal {

/// The groups' pictures on the lattice, kept in a file until the slices are cut from
/// them. A file with a name outlives this and is taken up again by the next run, for
/// the groups whose pictures are still the same; without one a crash leaves nothing.
class GroupSpool {
 public:
  struct Shape {
    std::uint64_t key = 0;  ///< of all that the pictures' values depend on
    std::int64_t group_count = 0;
    std::int64_t value_count = 0;  ///< of one group, channels · cells
    std::int64_t channel_count = 0;
    std::int64_t most_spots = 0;  ///< of a group
  };

  /// `path`: of the file; `is_named` or else only to be in that folder. A file of
  /// another key or shape is begun anew. Collective with `ranks`: one file for all.
  GroupSpool(const std::filesystem::path& path,
             bool is_named,
             const Shape& shape,
             const Ranks* ranks = nullptr);
  ~GroupSpool();
  GroupSpool(const GroupSpool&) = delete;
  GroupSpool& operator=(const GroupSpool&) = delete;

  /// Takes up group `g` of an earlier run, if it is there, made of pictures of that
  /// state, and whole.
  bool TakeUp(int g, std::uint64_t state);
  void Park(int g, std::uint64_t state, const GroupPicture& picture);
  /// Collective: what any of the ranks holds is held by all.
  void Share(const Ranks& ranks);

  /// Gives back the memory that pages read so far hold; they stay in the system's
  /// cache.
  void Forget() const;

  bool Holds(int g) const { return held_[static_cast<std::size_t>(g)] != 0; }
  /// [channel][cell], as in GroupPicture; of a group that is held.
  std::span<const float> Rd(int g) const;
  std::span<const float> Sigma(int g) const;
  std::span<const float> Floor(int g) const;
  /// Of the group's spots, padded with empty ones.
  std::span<const SpotRings> Rings(int g, int channel) const;
  std::int64_t FrameCount(int g) const;
  std::int64_t SaturatedCount(int g) const;

 private:
  struct SlotHead;
  const SlotHead& Head(int g) const;
  void Open(const std::filesystem::path& path, bool is_named, const Ranks* ranks);
  void Begin(const std::filesystem::path& path) const;
  std::int64_t PayloadBytes() const;
  std::int64_t Offset(int g) const;

  Shape shape_;
  std::vector<char> held_;  // not of bool: threads set their own
  int fd_ = -1;
  const unsigned char* mapped_ = nullptr;
};

}  // namespace nacre::reconstruct::internal
