#pragma once

#include "acquire/schedule.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace nacre::acquire {

/// One line of the journal: a picture that was taken and is on disk.
struct JournalEntry {
  std::int64_t number = -1;  ///< index in the schedule
  ScheduledPicture picture;  ///< what was asked for
  std::vector<GridIndex> spots;
  double exposure_us = 0;  ///< as applied by the camera
  std::string file;        ///< relative to the session folder
  std::string hash;        ///< xxh3 of that file
  std::uint64_t frame_id = 0;
  std::int64_t timestamp_ns = 0;
};

/// The line of an entry: a JSON object, a tab, the xxh3 of the object's text, a
/// newline.
std::string FormatJournalLine(const JournalEntry& entry);

/// A journal as found on disk.
struct Journal {
  std::vector<JournalEntry> entries;  ///< numbers 0, 1, 2, …
  std::uint64_t good_bytes = 0;       ///< length of the file up to the last good line
  std::uint64_t torn_bytes = 0;       ///< what follows: the trace of an interruption
};

/// Parses a journal that came from `origin`. The end of the file may be torn, since
/// that is what a killed process or a power cut leaves. A bad line that a good one
/// follows, or a number out of sequence, is damage: BadData "origin:line: …".
Journal ParseJournal(const std::string& text, const std::string& origin);

/// Appends lines, each by one write(2), so that a killed process leaves a torn line at
/// most.
class JournalWriter {
 public:
  /// Opens `path`, creating it if need be, and cuts it off after `keep_bytes`.
  JournalWriter(const std::filesystem::path& path, std::uint64_t keep_bytes);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  void Append(const JournalEntry& entry);
  /// Returns once all lines are on the disk itself (fdatasync).
  void Flush();

 private:
  std::filesystem::path path_;
  int fd_ = -1;
};

}  // namespace nacre::acquire
