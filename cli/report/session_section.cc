#include "cli/report/html.h"
#include "cli/report/raster.h"
#include "cli/report/sections.h"
#include "core/json.h"
#ifdef NACRE_HAS_ACQUIRE
#include "acquire/session.h"
#endif
#ifdef NACRE_HAS_CALIBRATE
#include "calibrate/calibration.h"
#endif

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::cli::report {
namespace {

#if !defined(NACRE_HAS_ACQUIRE) || !defined(NACRE_HAS_CALIBRATE)
// Scalars of an object, and of the objects in it with their key before, as facts.
void AddScalars(const Json& json, const std::string& prefix, std::vector<Fact>& facts) {
  constexpr std::size_t kMaxText = 60;
  for (const auto& [key, value] : json.items()) {
    std::string name = prefix + key;
    std::replace(name.begin(), name.end(), '_', ' ');
    if (value.is_object() && prefix.size() < 20) {
      AddScalars(value, prefix + key + " ", facts);
    } else if (value.is_number_float()) {
      facts.push_back({Escape(name), Number(value.get<double>(), 4)});
    } else if (value.is_number() || value.is_boolean()) {
      facts.push_back({Escape(name), value.dump()});
    } else if (value.is_string() && value.get<std::string>().size() <= kMaxText &&
               value.get<std::string>().find('\n') == std::string::npos) {
      facts.push_back({Escape(name), Escape(value.get<std::string>())});
    }
  }
}

#endif

#ifdef NACRE_HAS_CALIBRATE

std::string WithSigma(double value, double sigma) {
  return Number(value, 4) + " ± " + Number(sigma, 2);
}

std::string CalibrationBody(const std::filesystem::path& path) {
  const calibrate::Calibration c = calibrate::ReadCalibration(path);
  std::string body = FactList(
      {{"Reprojection, rms", Number(c.reprojection_rms_px) + " px"},
       {"Laser map, rms", Number(c.laser_map_rms_mm) + " mm"},
       {"Laser map, largest", Number(c.laser_map_max_mm) + " mm"},
       {"Laser map, held out", Number(c.laser_map_held_out_rms_mm) + " mm"},
       {"Focal length",
        fmt::format("{} × {} ± {} px",
                    Number(c.camera.fx_px, 4),
                    Number(c.camera.fy_px, 4),
                    Number(c.focal_sigma_px, 2))},
       {"Principal point",
        fmt::format("{}, {} ± {} px",
                    Number(c.camera.cx_px, 4),
                    Number(c.camera.cy_px, 4),
                    Number(c.centre_sigma_px, 2))},
       {"Distortion k<sub>1</sub>, k<sub>2</sub>",
        Number(c.camera.k1) + ", " + Number(c.camera.k2)},
       {"Dark level",
        WithSigma(c.dark.offset_counts, c.dark.offset_sigma_counts) + " counts"},
       {"Gain",
        WithSigma(c.gain_electrons_per_count, c.gain_sigma_electrons_per_count) +
            " e<sup>−</sup> a count"},
       {"Read noise",
        WithSigma(c.read_noise_electrons, c.read_noise_sigma_electrons) +
            " e<sup>−</sup>"},
       {"Saturation", Number(c.saturation_counts, 4) + " counts"}});
  std::vector<std::vector<std::string>> rows;
  for (const calibrate::ChannelResponse& channel : c.channels) {
    rows.push_back({Escape(channel.name),
                    Number(channel.flux_scale_counts_mm2_sr_per_us, 4),
                    "± " + Percent(channel.flux_scale_sigma),
                    "± " + Percent(channel.flux_scale_spread)});
  }
  return body + Table({"Channel",
                       "flux scale kΦ (counts mm<sup>2</sup> sr µs<sup>−1</sup>)",
                       "uncertainty",
                       "over the reference target"},
                      rows);
}

#else

std::string CalibrationBody(const std::filesystem::path& path) {
  std::vector<Fact> facts;
  AddScalars(ReadJson(path), "", facts);
  return FactList(facts);
}

#endif

#ifdef NACRE_HAS_ACQUIRE

using acquire::Target;

std::string TargetName(const acquire::SessionReader& session, std::int64_t number) {
  const acquire::ScheduledPicture& picture = session.schedule()[number];
  std::string name = acquire::Name(picture.target);
  if (picture.channel >= 0) {
    name += ", laser " +
            session.rig().scanner.channels[static_cast<std::size_t>(picture.channel)];
  }
  return name;
}

// The middle one of each kind of picture that was taken: by target and laser.
std::vector<std::int64_t> TypicalPictures(const acquire::SessionReader& session) {
  std::vector<std::pair<std::string, std::vector<std::int64_t>>> kinds;
  for (std::int64_t n = 0; n < session.picture_count(); ++n) {
    if (!session.WasTaken(n)) {
      continue;
    }
    const std::string name = TargetName(session, n);
    auto kind = std::find_if(
        kinds.begin(), kinds.end(), [&](const auto& k) { return k.first == name; });
    if (kind == kinds.end()) {
      kind = kinds.insert(kinds.end(), {name, {}});
    }
    kind->second.push_back(n);
  }
  std::vector<std::int64_t> typical;
  for (const auto& [name, numbers] : kinds) {
    // Of a bracket the longest exposure, which shows most.
    std::int64_t best = numbers[numbers.size() / 2];
    for (std::size_t n = numbers.size() / 2;
         n < std::min(numbers.size(), numbers.size() / 2 + 6);
         ++n) {
      if (session.Entry(numbers[n]).exposure_us > session.Entry(best).exposure_us) {
        best = numbers[n];
      }
    }
    typical.push_back(best);
  }
  return typical;
}

std::string FrameFigure(const acquire::SessionReader& session, std::int64_t number) {
  const acquire::Frame frame = session.ReadFrame(number);
  // The mean of what a pixel has.
  const std::size_t pixels =
      static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  const std::size_t samples = frame.counts.size() / pixels;
  std::vector<float> counts(pixels, 0.0F);
  for (std::size_t k = 0; k < frame.counts.size(); ++k) {
    counts[k / samples] +=
        static_cast<float>(frame.counts[k]) / static_cast<float>(samples);
  }
  const OwnedPlane small = Shrink({frame.width, frame.height, counts}, 520);
  const auto [low, high] = std::minmax_element(counts.begin(), counts.end());
  const auto full = static_cast<double>((1 << session.manifest().camera.bit_depth) - 1);
  return Figure(ImageTag(ColorImage({small.View()}, 1 / full), "camera picture"),
                fmt::format("Picture {}: {}, {} ms, {} to {} counts of {}.",
                            number,
                            Escape(TargetName(session, number)),
                            Number(frame.exposure_us / 1000),
                            Number(static_cast<double>(*low)),
                            Number(static_cast<double>(*high), 4),
                            full),
                "frame");
}

std::string SessionBody(const std::filesystem::path& folder) {
  const acquire::SessionReader session(folder);
  const acquire::SessionManifest& m = session.manifest();
  const std::int64_t taken = session.picture_count();
  const std::int64_t all = session.schedule().size();
  std::string body = FactList(
      {{"Sample", Escape(session.rig().sample.name)},
       {"Rig",
        Escape(session.rig().kind) + "<br><code>" + Escape(m.rig_file) + "</code>"},
       {"Camera", Escape(m.camera.model)},
       {"Sensor",
        fmt::format(
            "{} × {}, {} bits", m.camera.width, m.camera.height, m.camera.bit_depth)},
       {"Illuminator", Escape(m.illuminator.model)},
       {"Laser channels",
        Escape(fmt::format("{}", fmt::join(m.illuminator.channels, ", ")))},
       {"Grid",
        fmt::format("{} × {}, {} mm",
                    session.rig().grid.points_x,
                    session.rig().grid.points_y,
                    Number(session.rig().grid.pitch_mm))},
       {"Pictures", fmt::format("{} of {}", taken, all)}});
  body += Check(
      session.IsComplete(),
      session.IsComplete()
          ? std::string("The session is complete.")
          : fmt::format("{} pictures are still to be taken; go on with <code>nacre "
                        "capture --resume</code>.",
                        all - taken));
  std::vector<std::string> frames;
  for (const std::int64_t number : TypicalPictures(session)) {
    frames.push_back(FrameFigure(session, number));
  }
  return body + Row(frames);
}

#else

std::string SessionBody(const std::filesystem::path& folder) {
  const std::filesystem::path manifest = folder / "session.json";
  std::vector<Fact> facts;
  AddScalars(ReadJson(manifest), "", facts);
  return FactList(facts) +
         Check(false, "This build can't read the pictures of a session (no acquire).");
}

#endif

}  // namespace

std::string SessionSection(const std::filesystem::path& folder) {
  return Section("Capture session", folder.filename().string(), SessionBody(folder));
}

std::string CalibrationSection(const std::filesystem::path& path) {
  return Section("Calibration",
                 path.filename().string(),
                 CalibrationBody(path) + CalibrationFigures(path));
}

}  // namespace nacre::cli::report
