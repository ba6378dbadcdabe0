#pragma once

#include "acquire/journal.h"
#include "acquire/session.h"
#include "core/progress.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace nacre::acquire {

/// Only one process may write a session: holds an flock(2) on `folder`/lock, which the
/// system releases with the process, however that ends.
class SessionLock {
 public:
  /// Throws Error naming the process that holds it.
  explicit SessionLock(const std::filesystem::path& folder);
  ~SessionLock();
  SessionLock(const SessionLock&) = delete;
  SessionLock& operator=(const SessionLock&) = delete;

 private:
  int fd_ = -1;
};

/// A session folder opened for writing.
///
/// What survives: a killed process loses at most the frame in flight, since a frame is
/// handed to the system before its line is. After a power cut the newest frames, which
/// the system hadn't put on disk, may be gone or torn; Resume finds that out by their
/// checksums and takes them again. With `durable`, each frame and line is flushed to
/// disk, and a power cut costs no more than a kill.
class SessionWriter {
 public:
  /// Makes the folder and its manifest. Throws a usage Error if there is one already.
  static SessionWriter Create(const std::filesystem::path& folder,
                              const SessionManifest& manifest,
                              bool durable);

  /// Goes on with a session: drops a torn end of the journal, verifies the checksum of
  /// every frame and drops all from the first bad one on. Throws a usage Error that
  /// says what differs if it was begun with another rig description or device.
  static SessionWriter Resume(const std::filesystem::path& folder,
                              const SessionManifest& manifest,
                              bool durable,
                              const ProgressFunction& progress = {});

  const std::filesystem::path& folder() const { return folder_; }
  const SessionManifest& manifest() const { return manifest_; }
  const RigDescription& rig() const { return rig_; }
  const Schedule& schedule() const { return schedule_; }

  /// Pictures that are there, or were skipped: the number of the next one.
  std::int64_t picture_count() const { return std::ssize(entries_); }
  const JournalEntry& Entry(std::int64_t number) const {
    return entries_[static_cast<std::size_t>(number)];
  }
  /// Pictures that Resume had to drop because their frames were damaged.
  std::int64_t dropped_count() const { return dropped_count_; }

  /// Writes the next picture's frame, then its line. Throws BadData if the frame isn't
  /// what the camera said it would deliver.
  void Append(const Frame& frame);

  /// Notes that the next picture, one of the sample, is left out, and why.
  void Skip(const std::string& reason);

  /// The points of a group that are lit: all but those that the adaptive plan leaves
  /// out.
  std::vector<GridIndex> LitPoints(int group) const;

  /// Notes the laser map in the manifest; it may be set once only.
  void SetScanMap(const ScanMap& map);
  /// Likewise what the preview said.
  void SetAdaptivePlan(const AdaptivePlan& plan);

  /// Returns once everything so far is on the disk itself.
  void Flush();

 private:
  SessionWriter(const std::filesystem::path& folder,
                const SessionManifest& manifest,
                bool durable);
  JournalEntry NextEntry() const;
  void Commit(JournalEntry entry);
  void VerifyFrames(Journal& journal, const ProgressFunction& progress);

  std::filesystem::path folder_;
  std::unique_ptr<SessionLock> lock_;
  SessionManifest manifest_;
  RigDescription rig_;
  Schedule schedule_;
  bool durable_ = false;
  std::unique_ptr<JournalWriter> journal_;
  std::vector<JournalEntry> entries_;
  std::string encoded_;  // kept for its memory
  std::int64_t dropped_count_ = 0;
};

/// The manifest of a session that is to begin.
SessionManifest MakeManifest(const RigDescription& rig,
                             const CameraInfo& camera,
                             const IlluminatorInfo& illuminator,
                             std::optional<std::uint64_t> seed = std::nullopt);

}  // namespace nacre::acquire
