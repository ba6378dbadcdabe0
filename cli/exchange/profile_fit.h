#pragma once

#include "core/exr.h"
#include "core/json_fwd.h"
#include "core/progress.h"
#include "factor/material.h"
#include "reconstruct/rd_dataset.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace nacre::exchange {

/// A material as other renderers can take it: of each grid point and channel, albedo A
/// and length d of Burley's profile (burley.h). Maps are [channel][j][i], as pictures.
struct ProfileMaps {
  int points_x = 0;
  int points_y = 0;
  double pitch_mm = 0;
  double eta = 1;
  std::vector<std::string> channels;
  std::vector<float> albedo;
  std::vector<float> d_mm;
  /// Rms over radii of (share of A within the radius, model − data): 0.05 is 5 % of A.
  std::vector<float> residual;

  std::size_t PixelCount() const {
    return static_cast<std::size_t>(points_x) * static_cast<std::size_t>(points_y);
  }
  double WidthMm() const { return points_x * pitch_mm; }
  double HeightMm() const { return points_y * pitch_mm; }
};

/// What a fit loses, for people and for the files that travel with the maps.
struct ProfileFitSummary {
  double mean_residual = 0;
  double worst_residual = 0;
  double mean_outside = 0;     ///< share of A that the profile has beyond the windows
  std::int64_t above_one = 0;  ///< albedos cut to 1
  std::int64_t unlit = 0;      ///< points where nothing leaves: A = 0, d the least
  std::int64_t at_the_limit = 0;  ///< d at an end of the range that is searched
  std::string Brief() const;
  Json ToJson() const;
};

struct ProfileFit {
  ProfileMaps maps;
  ProfileFitSummary summary;
};

/// Fits the windows' ring sums: d by least squares of the share of light within each
/// radius, A from the light in all rings, so that a point is as bright as measured.
/// Model and data are summed over the same cells. Cells that weren't measured count as
/// their ring's mean. d is searched from a twentieth of a pitch to four half-widths.
ProfileFit FitProfiles(const factor::Material& material,
                       int thread_count = 0,
                       const ProgressFunction& progress = {});
ProfileFit FitProfiles(reconstruct::RdReader& reader,
                       int thread_count = 0,
                       const ProgressFunction& progress = {});

/// The maps as a picture of its own, single-part, R, G, B (or one channel Y), for
/// programs that show the first part only. `values` is one of the maps, times `scale`.
ExrPart MapPicture(const ProfileMaps& maps,
                   const std::vector<float>& values,
                   double scale = 1);

}  // namespace nacre::exchange
