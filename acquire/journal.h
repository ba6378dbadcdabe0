#pragma once

#include "acquire/schedule.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace nacre::acquire {

/// One line of the journal: a picture that was taken and is on disk, or that an
/// adaptive capture left out.
struct JournalEntry {
  std::int64_t number = -1;      ///< index in the schedule
  ScheduledPicture picture;      ///< what was asked for
  std::string skipped;           ///< why it was left out; empty: taken
  std::vector<GridIndex> spots;  ///< lit in it
  double exposure_us = 0;        ///< as applied by the camera
  std::string file;              ///< relative to the session folder
  std::string hash;              ///< xxh3 of that file
  std::uint64_t frame_id = 0;
  std::int64_t timestamp_ns = 0;
  int attempts = 1;                     ///< the good one and those that were lost
  std::uint64_t resent_packets = 0;     ///< over all attempts
  std::optional<double> gain;           ///< in the camera's unit, if it tells
  std::optional<double> temperature_c;  ///< of the camera, if it tells
  int largest = 0;                      ///< count in the picture
  std::int64_t bright = 0;  ///< counts from IsBright on: may be cut off by saturation

  bool taken() const { return skipped.empty(); }
};

/// Whether a count is so close to the converter's last that it may have been cut off. A
/// tenth of the range stays for sensors whose wells are full before that.
constexpr bool IsBright(int count, int bit_depth) {
  return 10 * std::int64_t{count} >= 9 * ((std::int64_t{1} << bit_depth) - 1);
}

/// The line of an entry: a JSON object, a tab, the xxh3 of the object's text, a
/// newline.
std::string FormatJournalLine(const JournalEntry& entry);

/// A journal as found on disk.
struct Journal {
  std::vector<JournalEntry> entries;     ///< numbers 0, 1, 2, …
  std::vector<std::uint64_t> line_ends;  ///< length of the file up to each of them
  std::uint64_t good_bytes = 0;  ///< length of the file up to the last good line
  std::uint64_t torn_bytes = 0;  ///< what follows: the trace of an interruption
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
