#pragma once

#include "acquire/aravis_options.h"
#include "acquire/helios_options.h"
#include "acquire/projector_options.h"
#include "acquire/scan_map.h"
#include "core/toml.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace nacre::acquire {

/// [sample]
struct SampleDescription {
  std::string name;
  double eta = 1;  ///< refractive index
};

/// [grid]: where the laser goes, as in reconstruct/rd_dataset.h.
struct GridDescription {
  int points_x = 0;
  int points_y = 0;
  double pitch_mm = 0;
  int core = 0;  ///< odd; cells a side of the window around each point
  /// Corners of a polygon: points outside of it aren't captured. Empty: all are.
  std::vector<PointMm> outline_mm = {};

  std::int64_t PointCount() const { return std::int64_t{points_x} * points_y; }
  /// Column i from the left, row j from the top.
  PointMm Point(int i, int j) const {
    return {(i - 0.5 * (points_x - 1)) * pitch_mm,
            (0.5 * (points_y - 1) - j) * pitch_mm};
  }
  /// Whether that point is to be captured.
  bool Includes(int i, int j) const;
  /// From the origin to the edge of the outermost window.
  double HalfWidthMm() const { return 0.5 * (points_x - 1 + core) * pitch_mm; }
  double HalfHeightMm() const { return 0.5 * (points_y - 1 + core) * pitch_mm; }
};

/// [camera]
struct CameraDescription {
  std::vector<double> exposures_us;       ///< bracket of a grid picture, longest first
  int dark_frames = 0;                    ///< at every exposure that is used anywhere
  double target_exposure_us = 0;          ///< checkerboard pictures
  std::vector<double> flat_exposures_us;  ///< photon transfer; a pair of pictures each
  std::optional<AravisOptions> device;    ///< [camera.device], of kind "hardware"
};

/// [targets]
struct TargetsDescription {
  int checkerboard_columns = 0;  ///< inner corners along x
  int checkerboard_rows = 0;     ///< inner corners along y
  double checkerboard_square_mm = 0;
  int checkerboard_poses = 0;        ///< pose 0 lies in the sample plane
  double reference_reflectance = 0;  ///< ρ of the diffuse standard
  double reference_exposure_us = 0;
  int reference_frames = 0;      ///< pictures of the reference a channel
  int laser_lattice = 0;         ///< n: the reference is lit by n × n spots at once
  bool reverse_lattice = false;  ///< in every second of those pictures, last spot first
  /// Of the reference lit by one spot, a picture a channel; may be empty.
  std::vector<double> glare_exposures_us;
  int ambient_frames = 0;  ///< laser off, on reference and sample each
  /// A diffuse patch that stays beside the sample, lit in each of its pictures.
  std::optional<PointMm> patch_mm;
  double patch_reflectance = 0;
};

/// [scanner]
struct ScannerDescription {
  double mm_per_rad = 0;  ///< nominal, on the sample plane; a few per cent will do
  std::vector<std::string> channels;
};

/// [schedule]
struct ScheduleDescription {
  int spot_spacing_cells = 0;  ///< between spots of one picture, along each axis
  std::uint64_t order_seed = 0;
};

/// [adaptive]: what a capture may leave out, see acquire/adaptive.h.
struct AdaptiveDescription {
  bool skip_exposures = true;  ///< that add nothing
  bool skip_empty = true;      ///< grid points around which nothing scatters
  double noise_sigmas = 20;    ///< of the dark: what is above needs no longer exposure
};

/// [illuminator] and [safety]
struct LightDescription {
  HeliosOptions device;  ///< [illuminator.device]
  SafetyDescription safety;
};

/// A rig and what is to be captured with it, as written in rig.toml.
struct RigDescription {
  std::filesystem::path path;  ///< of rig.toml
  std::string text;            ///< its content, verbatim
  std::string hash;            ///< of `text`
  std::string kind;            ///< "simulated" or "hardware"
  SampleDescription sample;
  GridDescription grid;
  CameraDescription camera;
  TargetsDescription targets;
  ScannerDescription scanner;
  ScheduleDescription schedule;
  std::optional<LightDescription> illuminator;  ///< none: kind "simulated", or no laser
  std::optional<ProjectorOptions> projector;    ///< instead of a laser
  std::optional<AdaptiveDescription> adaptive;  ///< none: every picture is taken

  int ChannelCount() const { return static_cast<int>(scanner.channels.size()); }
};

/// Reads rig.toml. Throws BadData "file:line: key: …" for everything that is missing,
/// unknown, out of range or contradictory, and DeviceError for a kind of rig that this
/// build has no driver for. The table [simulated] belongs to rigs/ and is not looked
/// into.
RigDescription ReadRig(const std::filesystem::path& path);

/// The same from text; `path` is for messages and for files named relative to it.
RigDescription ParseRig(const std::string& text, const std::filesystem::path& path);

}  // namespace nacre::acquire
