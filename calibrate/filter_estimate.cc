#include "calibrate/filter_estimate.h"

#include "acquire/mosaic.h"
#include "calibrate/internal/pictures.h"
#include "core/error.h"

#include <algorithm>
#include <cstdint>
#include <fmt/format.h>

namespace nacre::calibrate {
namespace {

using acquire::Frame;
using acquire::Target;
using Colours = std::array<double, 3>;

// Mean counts of each colour's pixels, hot ones left out.
Colours MeanColours(const Frame& frame,
                    const std::string& mosaic,
                    const std::vector<bool>& hot) {
  Colours sums{};
  Colours counts{};
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const auto k = static_cast<std::size_t>(std::int64_t{y} * frame.width + x);
      if (hot.empty() || !hot[k]) {
        const auto colour = static_cast<std::size_t>(acquire::ColourAt(mosaic, x, y));
        sums[colour] += frame.counts[k];
        counts[colour] += 1;
      }
    }
  }
  for (std::size_t c = 0; c < sums.size(); ++c) {
    sums[c] /= counts[c];
  }
  return sums;
}

double Strongest(const Colours& colours) {
  return *std::max_element(colours.begin(), colours.end());
}

Colours Relative(Colours colours) {
  const double strongest = Strongest(colours);
  for (double& colour : colours) {
    colour /= strongest;
  }
  return colours;
}

bool IsOverexposed(const Frame& frame, int bit_depth) {
  const auto full = static_cast<std::uint16_t>((1 << bit_depth) - 1);
  const auto at_full = std::count(frame.counts.begin(), frame.counts.end(), full);
  return at_full > std::ssize(frame.counts) / 1000;
}

// Rates of the colours, means over some pictures.
class MeanRates {
 public:
  MeanRates(const acquire::SessionReader& session, const DarkResult& dark)
      : session_(session), dark_(dark) {}

  Colours Of(const std::vector<std::int64_t>& numbers) const {
    Colours rates{};
    for (const std::int64_t number : numbers) {
      const Frame frame = session_.ReadFrame(number);
      const Colours counts =
          MeanColours(frame,
                      session_.manifest().camera.mosaic,
                      internal::MaskOf(dark_.hot_pixels, frame.counts.size()));
      for (std::size_t c = 0; c < rates.size(); ++c) {
        rates[c] += (counts[c] - dark_.level.Counts(frame.exposure_us)) /
                    frame.exposure_us / static_cast<double>(numbers.size());
      }
    }
    return rates;
  }

 private:
  const acquire::SessionReader& session_;
  const DarkResult& dark_;
};

}  // namespace

Colours EstimateWhite(const acquire::SessionReader& session) {
  const acquire::CameraInfo& camera = session.manifest().camera;
  Colours dark{};
  const std::vector<std::int64_t> nothing =
      internal::PicturesOf(session, Target::kNothing);
  for (const std::int64_t number : nothing) {
    const Colours counts = MeanColours(session.ReadFrame(number), camera.mosaic, {});
    for (std::size_t c = 0; c < dark.size(); ++c) {
      dark[c] += counts[c] / static_cast<double>(nothing.size());
    }
  }
  Colours sums{};
  for (const std::int64_t number : internal::PicturesOf(session, Target::kFlat)) {
    const Frame frame = session.ReadFrame(number);
    if (IsOverexposed(frame, camera.bit_depth)) {
      continue;
    }
    const Colours counts = MeanColours(frame, camera.mosaic, {});
    for (std::size_t c = 0; c < sums.size(); ++c) {
      sums[c] += counts[c] - dark[c];
    }
  }
  if (!(*std::min_element(sums.begin(), sums.end()) > 0)) {
    throw BadData(fmt::format(
        "{}: a colour of the camera's mosaic doesn't see the white card; was it lit "
        "by white light, and is one of flat_exposures_us short enough?",
        session.folder().string()));
  }
  return Relative(sums);
}

ColourFilters EstimateFilters(const acquire::SessionReader& session,
                              const DarkResult& dark) {
  const std::string& mosaic = session.manifest().camera.mosaic;
  ColourFilters filters;
  if (mosaic.empty()) {
    return filters;
  }
  filters.mosaic = mosaic;
  filters.white = EstimateWhite(session);
  const MeanRates rates(session, dark);
  Colours on_reference{};
  if (const auto numbers = internal::PicturesOf(session, Target::kAmbient, -1, 0);
      !numbers.empty()) {
    on_reference = rates.Of(numbers);
  }
  const auto on_sample = internal::PicturesOf(session, Target::kAmbient, -1, 1);
  if (const Colours ambient = on_sample.empty() ? Colours{} : rates.Of(on_sample);
      *std::min_element(ambient.begin(), ambient.end()) > 0) {
    filters.ambient = Relative(ambient);
  }
  const std::vector<std::string>& names = session.rig().scanner.channels;
  for (int channel = 0; channel < std::ssize(names); ++channel) {
    Colours laser =
        rates.Of(internal::PicturesOf(session, Target::kReference, channel));
    for (std::size_t c = 0; c < laser.size(); ++c) {
      laser[c] = std::max(0.0, laser[c] - on_reference[c]);
    }
    if (!(Strongest(laser) > 0)) {
      throw BadData(fmt::format("{}: no colour of the camera's mosaic sees channel {}",
                                session.folder().string(),
                                names[static_cast<std::size_t>(channel)]));
    }
    filters.lasers.push_back(Relative(laser));
  }
  return filters;
}

}  // namespace nacre::calibrate
