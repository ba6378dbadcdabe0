#pragma once

#include "acquire/rig.h"
#include "rigs/pattern.h"
#include "rigs/phantom_voxels.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace nacre::rigs {

/// What lies under the slab.
enum class Bottom {
  kAir,      ///< as above: the same Fresnel reflection
  kMatched,  ///< the same refractive index: what arrives leaves
  kBlack,    ///< absorbs all that arrives, reflects nothing
  kWhite,    ///< reflects all that arrives, diffusely
};

const char* Name(Bottom bottom);

struct Slab {
  double thickness_mm = 0;  ///< of all layers; infinity allowed
  double eta = 1;           ///< refractive index, of the first layer; outside is 1
  Bottom bottom = Bottom::kAir;
};

/// A medium's coefficients, one value a channel.
struct Medium {
  std::string name;
  std::vector<double> sigma_a_per_mm;
  std::vector<double> sigma_s_per_mm;
  std::vector<double> g;  ///< mean cosine of scattering

  /// σ_s' = σ_s (1 − g).
  double ReducedScattering(std::size_t channel) const {
    return sigma_s_per_mm[channel] * (1 - g[channel]);
  }
};

/// A layer of one medium.
struct SlabLayer {
  double thickness_mm = 0;  ///< infinite only at the bottom
  double eta = 1;
  std::size_t medium = 0;  ///< index into Phantom::media
};

enum class BeamShape { kPencil, kSquare, kDisc, kGaussian };

const char* Name(BeamShape shape);

/// Light that enters the slab around x_i.
struct Beam {
  BeamShape shape = BeamShape::kPencil;
  /// Side of a square, diameter of a disc, 1/e² diameter of a Gaussian (four standard
  /// deviations).
  double width_mm = 0;
  double angle_rad = 0;  ///< from the normal, towards +x
};

/// A slab of known media: what a simulated rig captures and what `nacre simulate`
/// computes R_d of. The file format is described in rigs/README.md.
struct Phantom {
  std::vector<std::string> channels;
  Slab slab;
  std::vector<Medium> media;
  /// How the first two media share the plane; homogeneous if the media are arranged
  /// otherwise, in layers or voxels.
  Pattern pattern;
  std::vector<SlabLayer> layers;  ///< from the top; empty if the slab is one layer
  std::shared_ptr<const Voxels> voxels = nullptr;  ///< null if media aren't in voxels
  Beam beam;
  acquire::GridDescription grid;  ///< points_x = 0 if the file has no [grid]
};

/// Throws BadData, which names the solver by Monte Carlo as the one that can, unless
/// the phantom is one layer whose media are the same at every depth. `solver`: who
/// can't, for the message.
void RequirePlanePattern(const Phantom& phantom, const std::string& solver);

/// Reads a phantom and the files it names. Throws BadData "file:line: key: …" for
/// everything that is missing, unknown, out of range or contradictory.
Phantom ReadPhantom(const std::filesystem::path& path);

/// The same from text; `origin` is for messages and the folder of files.
Phantom ParsePhantom(const std::string& text, const std::string& origin);

}  // namespace nacre::rigs
