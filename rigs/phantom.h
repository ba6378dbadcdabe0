#pragma once

#include "acquire/rig.h"
#include "rigs/pattern.h"

#include <cstddef>
#include <filesystem>
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
  double thickness_mm = 0;  ///< infinity allowed
  double eta = 1;           ///< refractive index, the same in all media; outside is 1
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
  Pattern pattern;
  Beam beam;
  acquire::GridDescription grid;  ///< points_x = 0 if the file has no [grid]
};

/// Reads a phantom. Throws BadData "file:line: key: …" for everything that is missing,
/// unknown, out of range or contradictory.
Phantom ReadPhantom(const std::filesystem::path& path);

/// The same from text; `origin` is for messages.
Phantom ParsePhantom(const std::string& text, const std::string& origin);

}  // namespace nacre::rigs
