#pragma once

#include "acquire/adaptive_plan.h"
#include "acquire/camera.h"
#include "acquire/illuminator.h"
#include "acquire/journal.h"
#include "acquire/rig.h"
#include "acquire/scan_map.h"
#include "acquire/schedule.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace nacre::acquire {

/// What session.json holds.
struct SessionManifest {
  std::string rig_text;  ///< rig.toml, verbatim
  std::string rig_hash;
  std::string rig_file;  ///< name only
  CameraInfo camera;
  IlluminatorInfo illuminator;
  std::int64_t picture_count = 0;
  std::optional<ScanMap> scan_map;  ///< once the calibration pictures are taken
  /// Of a simulated rig's noise, if another than the rig description's.
  std::optional<std::uint64_t> seed;
  /// Of an adaptive capture, once the preview of the sample is taken.
  std::optional<AdaptivePlan> adaptive_plan = std::nullopt;
  std::string software_version;  ///< that began the session
  /// When it was begun, seconds of Unix time; a simulated session is of no time, so
  /// that the same rig gives the same bytes.
  std::optional<std::int64_t> captured_unix_s = std::nullopt;
};

/// session.json of a folder. Throws BadData for anything missing or contradictory.
SessionManifest ReadManifest(const std::filesystem::path& folder);
void WriteManifest(const std::filesystem::path& folder,
                   const SessionManifest& manifest);

/// How a colour camera's frames are read; a monochrome one's are the same either way.
enum class FrameView {
  kRaw,   ///< as the sensor gave them
  kGrey,  ///< by MakeGrey, for whoever looks for shapes only
};

/// A session folder opened for reading:
///
///   session.json       the manifest
///   journal            one checksummed line a picture, append only
///   frames/000000.pgm  as the sensor gave it; the number is the index in the schedule
///
/// Reading is const and may be done from several threads.
class SessionReader {
 public:
  /// Throws BadData for a folder that is no session, a manifest that doesn't parse, or
  /// a journal with a bad line before a good one. A torn end is ignored: those pictures
  /// weren't taken.
  explicit SessionReader(std::filesystem::path folder,
                         FrameView view = FrameView::kRaw);

  const std::filesystem::path& folder() const { return folder_; }
  const SessionManifest& manifest() const { return manifest_; }
  const RigDescription& rig() const { return rig_; }
  const Schedule& schedule() const { return schedule_; }

  /// How many pictures were taken, or skipped by an adaptive capture: the numbers below
  /// it are there, the others not.
  std::int64_t picture_count() const {
    return static_cast<std::int64_t>(journal_.size());
  }
  bool IsComplete() const { return picture_count() == schedule_.size(); }

  /// Throws BadData if the capture didn't come that far (resume it).
  const JournalEntry& Entry(std::int64_t number) const;

  /// False for a picture that an adaptive capture left out. BadData as Entry.
  bool WasTaken(std::int64_t number) const { return Entry(number).taken(); }

  /// Reads a picture and verifies checksum and size; exposure_us is the one applied.
  /// BadData for one that was skipped.
  Frame ReadFrame(std::int64_t number) const;

 private:
  std::filesystem::path folder_;
  FrameView view_;
  SessionManifest manifest_;
  RigDescription rig_;
  Schedule schedule_;
  std::vector<JournalEntry> journal_;
};

}  // namespace nacre::acquire
