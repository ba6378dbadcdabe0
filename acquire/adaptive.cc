#include "acquire/adaptive.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <map>

namespace nacre::acquire {
namespace {

// Of a picture's pixels: what noise and cosmic rays lift above the floor now and then.
constexpr double kNegligible = 1e-4;
// Pixels in a window that make it scatter.
constexpr int kPixelsOfLight = 4;

// Of the dark pictures' spread: above it is light.
constexpr double kLightSigmas = 5;

// The dark at one exposure. Median and quantile, since hot pixels would spoil a mean.
struct Dark {
  double counts = 0;
  double sigma = 0;
  std::vector<bool> hot;
};

Dark DarkOf(const SessionReader& session, double exposure_us) {
  std::vector<Frame> frames;
  std::vector<std::int64_t> histogram(1 << 16, 0);
  std::int64_t total = 0;
  for (std::int64_t k = 0; k < session.schedule().grid_begin(); ++k) {
    const ScheduledPicture& picture = session.schedule()[k];
    if (picture.target == Target::kNothing && picture.exposure_us == exposure_us) {
      frames.push_back(session.ReadFrame(k));
      for (const std::uint16_t count : frames.back().counts) {
        ++histogram[count];
      }
      total += std::ssize(frames.back().counts);
    }
  }
  Expect(!frames.empty(), "dark pictures at every exposure");
  const auto quantile = [&](double share) {
    std::int64_t below = 0;
    std::size_t count = 0;
    while (static_cast<double>(below + histogram[count]) <
           share * static_cast<double>(total)) {
      below += histogram[count++];
    }
    return static_cast<double>(count);
  };
  Dark dark;
  dark.counts = quantile(0.5);
  dark.sigma = std::max(quantile(0.8413) - dark.counts, 0.5);  // one of a Gaussian's
  dark.hot.resize(frames.front().counts.size());
  for (const Frame& frame : frames) {
    for (std::size_t k = 0; k < frame.counts.size(); ++k) {
      dark.hot[k] =
          dark.hot[k] || frame.counts[k] > dark.counts + kLightSigmas * dark.sigma;
    }
  }
  return dark;
}

// The pictures of the preview.
class Preview {
 public:
  explicit Preview(const SessionReader& session) : session_(session) {
    for (const double exposure_us : session.rig().camera.exposures_us) {
      darks_.push_back(DarkOf(session, exposure_us));
    }
  }

  // Of the preview's picture with this channel and exposure.
  Frame Read(int channel, std::size_t exposure) const {
    return session_.ReadFrame(session_.schedule().grid_begin() +
                              std::int64_t{channel} * std::ssize(darks_) +
                              static_cast<std::int64_t>(exposure));
  }

  bool IsAbove(double sigmas,
               const Frame& frame,
               std::size_t exposure,
               std::size_t pixel) const {
    const Dark& dark = darks_[exposure];
    return frame.counts[pixel] > dark.counts + sigmas * dark.sigma && !dark.hot[pixel];
  }
  bool IsLit(const Frame& frame, std::size_t exposure, std::size_t pixel) const {
    return IsAbove(kLightSigmas, frame, exposure, pixel);
  }

 private:
  const SessionReader& session_;
  std::vector<Dark> darks_;
};

// A longer exposure adds something where it sees light that isn't cut off and that the
// shorter one doesn't lift far enough out of the noise.
int OmittedExposures(const SessionReader& session,
                     const Preview& preview,
                     int channel) {
  const std::size_t exposure_count = session.rig().camera.exposures_us.size();
  const int bit_depth = session.manifest().camera.bit_depth;
  const double sigmas = session.rig().adaptive->noise_sigmas;
  Frame longer = preview.Read(channel, 0);
  for (std::size_t e = 0; e + 1 < exposure_count; ++e) {
    Frame shorter = preview.Read(channel, e + 1);
    std::int64_t gained = 0;
    for (std::size_t k = 0; k < longer.counts.size(); ++k) {
      gained += preview.IsLit(longer, e, k) && !IsBright(longer.counts[k], bit_depth) &&
                        !preview.IsAbove(sigmas, shorter, e + 1, k)
                    ? 1
                    : 0;
    }
    if (static_cast<double>(gained) >
        kNegligible * static_cast<double>(longer.counts.size())) {
      return static_cast<int>(e);
    }
    longer = std::move(shorter);
  }
  return static_cast<int>(exposure_count) - 1;
}

// Whether there is light in the window of one core around a point, as the camera sees
// it.
bool Scatters(const Preview& preview,
              const Frame& frame,
              PointMm centre,
              double half_mm,
              const PixelFromSample& pixel_from_sample) {
  double left = 1e9;
  double right = -1e9;
  double top = 1e9;
  double bottom = -1e9;
  for (const double dx : {-half_mm, half_mm}) {
    for (const double dy : {-half_mm, half_mm}) {
      const auto [x, y] = pixel_from_sample({centre.x + dx, centre.y + dy});
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
  }
  const auto clamp = [](double value, int size) {
    return static_cast<int>(std::clamp(std::round(value), 0.0, size - 1.0));
  };
  const std::size_t samples =
      frame.counts.size() /
      (static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
  const auto row = static_cast<std::size_t>(frame.width) * samples;
  int lit = 0;
  for (int y = clamp(top, frame.height); y <= clamp(bottom, frame.height); ++y) {
    const std::size_t begin = static_cast<std::size_t>(y) * row;
    for (std::size_t k = static_cast<std::size_t>(clamp(left, frame.width)) * samples;
         k < (static_cast<std::size_t>(clamp(right, frame.width)) + 1) * samples;
         ++k) {
      lit += preview.IsLit(frame, 0, begin + k) ? 1 : 0;
    }
  }
  return lit >= kPixelsOfLight;
}

std::vector<GridIndex> EmptyPoints(const SessionReader& session,
                                   const Preview& preview,
                                   const PixelFromSample& pixel_from_sample) {
  const RigDescription& rig = session.rig();
  const auto spots = session.schedule().Group(0);
  std::vector<bool> scatters(spots.size(), false);
  for (int channel = 0; channel < rig.ChannelCount(); ++channel) {
    const Frame frame = preview.Read(channel, 0);
    for (std::size_t k = 0; k < spots.size(); ++k) {
      scatters[k] = scatters[k] || Scatters(preview,
                                            frame,
                                            rig.grid.Point(spots[k].i, spots[k].j),
                                            0.5 * rig.grid.core * rig.grid.pitch_mm,
                                            pixel_from_sample);
    }
  }
  const int reach = rig.schedule.spot_spacing_cells;
  std::vector<GridIndex> empty;
  for (int group = 1; group < session.schedule().group_count(); ++group) {
    for (const GridIndex& point : session.schedule().Group(group)) {
      bool all_empty = true;
      bool any_spot = false;
      for (std::size_t k = 0; k < spots.size(); ++k) {
        if (std::abs(spots[k].i - point.i) < reach &&
            std::abs(spots[k].j - point.j) < reach) {
          any_spot = true;
          all_empty = all_empty && !scatters[k];
        }
      }
      if (any_spot && all_empty) {
        empty.push_back(point);
      }
    }
  }
  return empty;
}

// The most bright pixels in a dark picture of that exposure: hot ones.
std::int64_t BrightInTheDark(const SessionWriter& session, double exposure_us) {
  std::int64_t most = 0;
  for (std::int64_t k = 0; k < session.schedule().grid_begin(); ++k) {
    const JournalEntry& entry = session.Entry(k);
    if (entry.picture.target == Target::kNothing &&
        entry.picture.exposure_us == exposure_us) {
      most = std::max(most, entry.bright);
    }
  }
  return most;
}

}  // namespace

AdaptivePlan PlanFromPreview(const SessionReader& session,
                             const PixelFromSample& pixel_from_sample) {
  const RigDescription& rig = session.rig();
  Expect(rig.adaptive.has_value(), "a rig that asks for it");
  const Preview preview(session);
  AdaptivePlan plan;
  for (int channel = 0; channel < rig.ChannelCount(); ++channel) {
    plan.omitted_exposures.push_back(
        rig.adaptive->skip_exposures ? OmittedExposures(session, preview, channel) : 0);
  }
  if (rig.adaptive->skip_empty && pixel_from_sample) {
    plan.empty_points = EmptyPoints(session, preview, pixel_from_sample);
  }
  return plan;
}

std::string WhySkip(const SessionWriter& session,
                    std::int64_t number,
                    const std::function<void()>& settle) {
  const std::optional<AdaptivePlan>& plan = session.manifest().adaptive_plan;
  if (!plan) {
    return "";
  }
  const ScheduledPicture& picture = session.schedule()[number];
  if (session.LitPoints(picture.group).empty()) {
    return "nothing scatters around its points";
  }
  if (!session.rig().adaptive->skip_exposures) {
    return "";
  }
  const std::vector<double>& exposures_us = session.rig().camera.exposures_us;
  const auto exposure =
      std::find(exposures_us.begin(), exposures_us.end(), picture.exposure_us) -
      exposures_us.begin();
  if (exposure < plan->omitted_exposures[static_cast<std::size_t>(picture.channel)]) {
    return "a shorter exposure shows all that it would";
  }
  if (exposure == 0) {
    return "";
  }
  settle();
  // The longer ones of the same light are the pictures before it.
  for (std::int64_t k = number - 1; k >= number - exposure; --k) {
    const JournalEntry& longer = session.Entry(k);
    if (longer.taken() &&
        longer.bright <= BrightInTheDark(session, longer.picture.exposure_us)) {
      return fmt::format("nothing is bright in picture {}, exposed longer", k);
    }
  }
  return "";
}

}  // namespace nacre::acquire
