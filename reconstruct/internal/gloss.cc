#include "reconstruct/internal/gloss.h"

#include "calibrate/hysteresis.h"
#include "reconstruct/internal/gloss_fit.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::reconstruct::internal {
namespace {

constexpr double kSignificant = 3;

// The laser's spot as it looks on a diffuse target of reflectance 1, less what glare
// spreads evenly over its surroundings.
SpotRings OnReference(const acquire::SessionReader& session,
                      const calibrate::Calibration& calibration,
                      int channel,
                      double ring_mm) {
  constexpr int kPictures = 6;
  const RingReader reader(calibration, calibration.camera);
  const acquire::Schedule& schedule = session.schedule();
  SpotRings rings;
  SpotRings wide;  // the last of these lie where there is no spot any more
  int pictures = 0;
  for (std::int64_t n = 0; n < schedule.grid_begin() && pictures < kPictures; ++n) {
    if (schedule[n].target != acquire::Target::kReference ||
        schedule[n].channel != channel) {
      continue;
    }
    ++pictures;
    const std::array frames = {session.ReadFrame(n)};
    const RateFrame rates = MergeExposures(frames, calibration);
    for (const PointMm& spot :
         calibrate::BeamPositions(calibration, schedule.Beams(n, nullptr))) {
      rings.Add(reader.Around(rates, channel, spot, ring_mm));
      wide.Add(reader.Around(rates, channel, spot, 2 * ring_mm));
    }
  }
  const float background = wide.Mean(SpotRings::kCount - 1);
  const auto scale =
      static_cast<float>(1 / session.rig().targets.reference_reflectance);
  for (std::size_t k = 0; k < SpotRings::kCount; ++k) {
    rings.sum[k] = scale * (rings.sum[k] - background * rings.pixels[k]);
  }
  return rings;
}

SpotRings PerFlux(SpotRings rings, float flux) {
  for (float& sum : rings.sum) {
    sum /= flux;
  }
  return rings;
}

}  // namespace

bool Gloss::IsFound() const {
  bool is_found = false;
  for (std::size_t c = 0; c < reflectance.size(); ++c) {
    is_found = is_found || reflectance[c] > kSignificant * sigma[c];
  }
  return is_found;
}

std::string Gloss::Warning(const std::vector<std::string>& channels) const {
  std::string text;
  for (std::size_t c = 0; c < reflectance.size(); ++c) {
    if (reflectance[c] > kSignificant * sigma[c]) {
      text += fmt::format("{}{:.2f} +- {:.2f} % in {}",
                          text.empty() ? "" : ", ",
                          100 * reflectance[c],
                          100 * sigma[c],
                          channels[c]);
    }
  }
  return text.empty() ? ""
                      : "gloss: the surface itself throws back " + text +
                            " at the lit point; taken out of the lit cell";
}

Gloss MeasureGloss(const acquire::SessionReader& session,
                   const calibrate::Calibration& calibration,
                   const GroupReader& reader,
                   const GroupSpool& spool) {
  // Enough spots, evenly over the groups.
  constexpr int kMostSpots = 4096;
  const acquire::Schedule& schedule = session.schedule();
  const int groups = schedule.group_count();
  const int spots =
      static_cast<int>(std::max<std::size_t>(1, schedule.Group(0).size()));
  const int step = std::max(1, groups * spots / kMostSpots);
  std::vector<SpotsOfChannel> channels;
  for (int c = 0; c < session.rig().ChannelCount(); ++c) {
    SpotsOfChannel& channel = channels.emplace_back();
    channel.reference = OnReference(session, calibration, c, reader.RingMm());
    for (int g = 0; g < groups; g += step) {
      if (!spool.Holds(g)) {
        continue;
      }
      const auto flux = static_cast<float>(reader.RelativeFlux(g, c));
      for (const SpotRings& rings : spool.Rings(g, c)) {
        if (!rings.empty()) {
          channel.spots.push_back(PerFlux(rings, flux));
        }
      }
    }
  }
  Gloss gloss;
  for (const Estimate& estimate : FitGloss(channels, session.rig().sample.eta)) {
    gloss.reflectance.push_back(std::max(0.0, estimate.value));
    gloss.sigma.push_back(estimate.sigma);
  }
  SpotRings all;
  for (const SpotsOfChannel& channel : channels) {
    all.Add(channel.reference);
  }
  for (std::size_t k = 0; k < SpotRings::kCount && all.sum[k] > 0; ++k) {
    gloss.square_mm2.push_back(static_cast<double>(all.square_mm2[k] / all.pixels[k]));
    gloss.log_density.push_back(std::log(static_cast<double>(all.Mean(k))));
  }
  return gloss;
}

}  // namespace nacre::reconstruct::internal
