#include "rigs/transport/monte_carlo/internal/packet.h"

#include "core/error.h"
#include "rigs/transport/monte_carlo/threefry.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs::monte_carlo::internal {
namespace {

// A free path that leaves every volume, and whose square is still finite.
constexpr double kLongestFreePathMm = 1e15;

double FreePath(double sigma_t) {
  return sigma_t > 0 ? std::min(1 / sigma_t, kLongestFreePathMm) : kLongestFreePathMm;
}

std::uint32_t Words(double fraction) {
  return static_cast<std::uint32_t>(
      std::clamp(std::round(fraction * 0x1p32), 0.0, 0x1p32 - 1));
}

void AddOptics(const Optics& optics, double majorant, PacketVolume& out) {
  const double absorbed = majorant > 0 ? optics.sigma_a_per_mm / majorant : 0;
  const double collided = majorant > 0 ? optics.SigmaT() / majorant : 1;
  out.absorb_below.push_back(Words(absorbed));
  const std::uint32_t collide_below = Words(collided);
  out.collide_last.push_back(
      collided >= 1 ? 0xFFFFFFFFU : collide_below - (collide_below > 0 ? 1 : 0));
  out.g.push_back(static_cast<float>(optics.g));
}

void AddLayers(const Volume& volume, PacketVolume& out) {
  double top = 0;
  const std::size_t count = volume.layers.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Layer& layer = volume.layers[k];
    const Optics& optics = volume.media[layer.medium];
    AddOptics(optics, optics.SigmaT(), out);
    out.layer_free_path_mm.push_back(static_cast<float>(FreePath(optics.SigmaT())));
    out.layer_top_mm.push_back(static_cast<float>(top));
    top += layer.thickness_mm;
    out.layer_bottom_mm.push_back(static_cast<float>(top));
    const double above = k > 0 ? volume.layers[k - 1].eta : 1;
    const double below =
        k + 1 < count ? volume.layers[k + 1].eta : static_cast<double>(out.eta_below);
    out.eta_ratio_up.push_back(static_cast<float>(above / layer.eta));
    out.eta_ratio_down.push_back(static_cast<float>(below / layer.eta));
    out.layer_medium.push_back(layer.medium);
  }
}

void AddVoxels(const VoxelGrid& grid, PacketVolume& out) {
  out.voxel_medium = grid.medium;
  out.voxel_medium.push_back(0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.voxel_count[axis] = grid.count[axis];
    out.voxels_per_mm[axis] = static_cast<float>(1 / grid.size_mm[axis]);
  }
  out.voxel_left_mm = static_cast<float>(grid.left_mm);
  out.voxel_lower_mm = static_cast<float>(grid.lower_mm);
}

Structure StructureOf(const Volume& volume) {
  if (volume.layers.size() > 1) {
    return Structure::kLayers;
  }
  if (volume.voxels) {
    return Structure::kVoxels;
  }
  return volume.pattern.MediumCount() > 1 ? Structure::kPattern
                                          : Structure::kHomogeneous;
}

// Cosine in air of light that meets a face from inside at `cosine`.
double ExitCosine(double cosine, double eta) {
  return std::sqrt(std::max(0.0, 1 - eta * eta * (1 - cosine * cosine)));
}

}  // namespace

PacketVolume MakePacketVolume(const Volume& volume) {
  PacketVolume out;
  out.structure = StructureOf(volume);
  out.isotropic = std::all_of(volume.media.begin(),
                              volume.media.end(),
                              [](const Optics& m) { return m.g == 0; });
  out.bottom = volume.bottom;
  out.depth_mm = static_cast<float>(volume.DepthMm());
  out.eta_top = static_cast<float>(volume.layers.front().eta);
  out.eta_bottom = static_cast<float>(volume.layers.back().eta);
  out.eta_below = volume.bottom == Bottom::kMatched ? out.eta_bottom : 1;
  if (volume.box) {
    out.box = true;
    out.half_x_mm = static_cast<float>(volume.box->half_x_mm);
    out.half_y_mm = static_cast<float>(volume.box->half_y_mm);
  }
  if (out.structure == Structure::kLayers) {
    AddLayers(volume, out);
    return out;
  }
  double majorant = 0;
  const bool mixed = out.structure != Structure::kHomogeneous;
  for (const Optics& optics : volume.media) {
    majorant = std::max(majorant, optics.SigmaT());
  }
  if (!mixed) {
    const Optics& only = volume.media[volume.layers.front().medium];
    majorant = only.SigmaT();
    AddOptics(only, majorant, out);
  } else {
    for (const Optics& optics : volume.media) {
      AddOptics(optics, majorant, out);
    }
  }
  out.free_path_mm = static_cast<float>(FreePath(majorant));
  if (out.structure == Structure::kPattern) {
    out.cells_per_mm_x = static_cast<float>(1 / volume.pattern.cell_mm);
    out.cells_per_mm_y =
        volume.pattern.type == PatternType::kChessboard ? out.cells_per_mm_x : 0;
  }
  if (volume.voxels) {
    AddVoxels(*volume.voxels, out);
  }
  return out;
}

Roster::Roster(const PacketJob& job,
               std::int64_t begin,
               std::int64_t end,
               CountTally& tally)
    : job_(job), next_(begin), end_(end), tally_(tally) {
  always_same_entry_ = job.source.shape == BeamShape::kPencil && !job.source.diffuse &&
                       !job.source.footprint;
  if (always_same_entry_) {
    entry_ = DrawEntry(job.source, *job.volume, [] { return 0.0; });
  }
}

void Roster::Launch(std::size_t lane) {
  fate[lane] = static_cast<std::uint32_t>(Fate::kAlive);
  step[lane] = 0;
  scattered[lane] = 0;
  part[lane] = 0;
  if (next_ == end_) {
    active[lane] = 0;
    Place(lane, {});
    return;
  }
  const auto index = static_cast<std::uint64_t>(next_++);
  ++in_flight_;
  active[lane] = 0xFFFFFFFFU;
  photon[lane] = static_cast<std::uint32_t>(index);
  if (always_same_entry_) {
    Place(lane, entry_);
    return;
  }
  std::uint32_t draw = 0;
  Place(lane, DrawEntry(job_.source, *job_.volume, [&] {
          const std::uint32_t word =
              Threefry({static_cast<std::uint32_t>(index),
                        static_cast<std::uint32_t>(index >> 32),
                        draw++,
                        0},
                       {static_cast<std::uint32_t>(job_.seed),
                        static_cast<std::uint32_t>(job_.seed >> 32),
                        1,  // flights have 0 here
                        0})[0];
          return word * 0x1p-32;
        }));
}

void Roster::Place(std::size_t lane, const Entry& entry) {
  x[lane] = static_cast<float>(entry.x_mm);
  y[lane] = static_cast<float>(entry.y_mm);
  z[lane] = 0;
  ux[lane] = static_cast<float>(entry.ux);
  uy[lane] = static_cast<float>(entry.uy);
  uz[lane] = static_cast<float>(entry.uz);
}

void Roster::Replace(std::size_t lane) {
  const PacketVolume& volume = job_.packet_volume;
  Ending ending;
  ending.fate = static_cast<Fate>(fate[lane]);
  ending.x_mm = static_cast<double>(x[lane]);
  ending.y_mm = static_cast<double>(y[lane]);
  ending.depth_mm = static_cast<double>(z[lane]);
  ending.scattered = scattered[lane] != 0;
  const double cosine = std::abs(static_cast<double>(uz[lane]));
  if (ending.fate == Fate::kReflected) {
    ending.cosine = ExitCosine(cosine, static_cast<double>(volume.eta_top));
  } else if (ending.fate == Fate::kTransmitted) {
    ending.cosine =
        ExitCosine(cosine, static_cast<double>(volume.eta_bottom / volume.eta_below));
  } else {
    const auto index = static_cast<std::size_t>(part[lane]);
    ending.medium = volume.structure == Structure::kLayers ? volume.layer_medium[index]
                    : volume.structure == Structure::kHomogeneous
                        ? job_.volume->layers.front().medium
                        : index;
  }
  tally_.Add(ending);
  tally_.AddSteps(step[lane]);
  --in_flight_;
  Launch(lane);
}

}  // namespace nacre::rigs::monte_carlo::internal
