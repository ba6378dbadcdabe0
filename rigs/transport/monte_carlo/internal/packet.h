#pragma once

#include "rigs/transport/monte_carlo/source.h"
#include "rigs/transport/monte_carlo/tally.h"
#include "rigs/transport/monte_carlo/volume.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace nacre::rigs::monte_carlo::internal {

/// What kind of inner loop a volume needs.
enum class Structure { kHomogeneous, kPattern, kVoxels, kLayers };

/// A volume as the packets see it: single precision, columns that lanes gather from.
/// Media come first where a volume has several at one depth, layers where it has
/// several depths.
struct PacketVolume {
  Structure structure = Structure::kHomogeneous;
  bool isotropic = true;  ///< g = 0 everywhere
  bool box = false;
  Bottom bottom = Bottom::kAir;

  // A flight ends at a tentative collision, after −ln u of these on average.
  float free_path_mm = 0;
  float depth_mm = 0;
  float half_x_mm = 0;
  float half_y_mm = 0;
  float eta_top = 1;     ///< of the first layer
  float eta_bottom = 1;  ///< of the last
  float eta_below = 1;   ///< of what lies under the volume

  // A medium, or a layer. Of the 2³² values of a random word, those below absorb_below
  // are absorption, those above collide_last a null collision, the others scattering.
  std::vector<std::uint32_t> absorb_below;
  std::vector<std::uint32_t> collide_last;
  std::vector<float> g;

  // Layers only.
  std::vector<float> layer_free_path_mm;
  std::vector<float> layer_top_mm;
  std::vector<float> layer_bottom_mm;
  std::vector<float> eta_ratio_up;  ///< index above over index here
  std::vector<float> eta_ratio_down;
  std::vector<std::size_t> layer_medium;

  // Patterns only; stripes have 0 along y.
  float cells_per_mm_x = 0;
  float cells_per_mm_y = 0;

  // Voxels only.
  std::vector<std::uint16_t> voxel_medium;  ///< one more than voxels: read by pairs
  std::array<std::int32_t, 3> voxel_count{};
  std::array<float, 3> voxels_per_mm{};
  float voxel_left_mm = 0;
  float voxel_lower_mm = 0;
};

PacketVolume MakePacketVolume(const Volume& volume);

/// All that the photons of one simulation share.
struct PacketJob {
  PacketVolume packet_volume;
  const Volume* volume = nullptr;
  Source source;
  std::uint64_t seed = 0;
};

inline constexpr std::size_t kMostLanes = 16;

/// The photons in flight, one a lane, and the queue of those to come: the part of the
/// work that happens once a photon. Lanes without a photon rest at the origin.
class Roster {
 public:
  /// Photons [begin, end), which must agree in their upper 32 bits.
  Roster(const PacketJob& job, std::int64_t begin, std::int64_t end, CountTally& tally);

  /// Counts the ending of lane `lane`'s photon and launches the next one in it.
  void Replace(std::size_t lane);
  void Launch(std::size_t lane);
  bool Empty() const { return in_flight_ == 0; }

  alignas(64) std::array<float, kMostLanes> x{};
  alignas(64) std::array<float, kMostLanes> y{};
  alignas(64) std::array<float, kMostLanes> z{};
  alignas(64) std::array<float, kMostLanes> ux{};
  alignas(64) std::array<float, kMostLanes> uy{};
  alignas(64) std::array<float, kMostLanes> uz{};
  alignas(64) std::array<std::uint32_t, kMostLanes> photon{};
  alignas(64) std::array<std::uint32_t, kMostLanes> step{};
  alignas(64) std::array<std::uint32_t, kMostLanes> fate{};  ///< Fate
  alignas(64) std::array<std::uint32_t, kMostLanes> scattered{};
  alignas(64) std::array<std::int32_t, kMostLanes> part{};     ///< medium or layer
  alignas(64) std::array<std::uint32_t, kMostLanes> active{};  ///< all bits or none

 private:
  void Place(std::size_t lane, const Entry& entry);

  const PacketJob& job_;
  std::int64_t next_;
  std::int64_t end_;
  CountTally& tally_;
  bool always_same_entry_;
  Entry entry_;
  std::int64_t in_flight_ = 0;
};

/// Follows photons [begin, end), any of them, with the best instruction set.
void RunPhotons(const PacketJob& job,
                std::int64_t begin,
                std::int64_t end,
                CountTally& tally);

std::vector<std::string> SupportedInstructionSets();
void ChooseInstructionSet(const std::string& name);

}  // namespace nacre::rigs::monte_carlo::internal
