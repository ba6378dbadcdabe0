#include "acquire/journal.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/write_all.h"

#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <optional>
#include <string_view>
#include <unistd.h>

namespace nacre::acquire {
namespace {

std::optional<Target> TargetFromName(const std::string& name) {
  for (const Target target : {Target::kNothing,
                              Target::kCheckerboard,
                              Target::kFlat,
                              Target::kReference,
                              Target::kGlare,
                              Target::kAmbient,
                              Target::kSample}) {
    if (name == Name(target)) {
      return target;
    }
  }
  return std::nullopt;
}

// The entry of a line without its newline; empty if its checksum doesn't match.
std::optional<JournalEntry> ParseLine(std::string_view line,
                                      const std::string& origin) {
  const std::size_t tab = line.rfind('\t');
  if (tab == std::string_view::npos ||
      line.substr(tab + 1) != HashHex(line.data(), tab)) {
    return std::nullopt;
  }
  // From here on the text is what a writer wrote: what's wrong with it is no accident.
  const Json json = ParseJson(std::string(line.substr(0, tab)), origin);
  JournalEntry entry;
  entry.number = Get<std::int64_t>(json, "number", origin);
  const auto target = TargetFromName(Get<std::string>(json, "target", origin));
  if (!target) {
    throw BadData(origin + ": field 'target': no such target");
  }
  entry.picture.target = *target;
  entry.picture.pose = Get<int>(json, "pose", origin);
  entry.picture.channel = Get<int>(json, "channel", origin);
  entry.picture.group = Get<int>(json, "group", origin);
  entry.picture.repeat = Get<int>(json, "repeat", origin);
  entry.picture.exposure_us = Get<double>(json, "exposure_us", origin);
  for (const auto& [i, j] :
       Get<std::vector<std::pair<int, int>>>(json, "spots", origin)) {
    entry.spots.push_back({i, j});
  }
  if (json.contains("skipped")) {
    entry.skipped = Get<std::string>(json, "skipped", origin);
    if (entry.skipped.empty()) {
      throw BadData(origin + ": field 'skipped': no reason");
    }
    return entry;
  }
  entry.exposure_us = Get<double>(json, "applied_exposure_us", origin);
  entry.file = Get<std::string>(json, "file", origin);
  const auto file = std::filesystem::path(entry.file).lexically_normal();
  if (!file.is_relative() || file.empty() || *file.begin() == "..") {
    throw BadData(origin + ": field 'file': '" + entry.file + "' isn't in the session");
  }
  entry.hash = Get<std::string>(json, "xxh3", origin);
  entry.frame_id = Get<std::uint64_t>(json, "frame_id", origin);
  entry.timestamp_ns = Get<std::int64_t>(json, "timestamp_ns", origin);
  // Fields that came later, or that not every camera has.
  if (json.contains("attempts")) {
    entry.attempts = Get<int>(json, "attempts", origin);
    entry.largest = Get<int>(json, "largest", origin);
    entry.bright = Get<std::int64_t>(json, "bright", origin);
  }
  if (json.contains("resent_packets")) {
    entry.resent_packets = Get<std::uint64_t>(json, "resent_packets", origin);
  }
  if (json.contains("gain")) {
    entry.gain = Get<double>(json, "gain", origin);
  }
  if (json.contains("temperature_c")) {
    entry.temperature_c = Get<double>(json, "temperature_c", origin);
  }
  return entry;
}

}  // namespace

std::string FormatJournalLine(const JournalEntry& entry) {
  Json spots = Json::array();
  for (const GridIndex& spot : entry.spots) {
    spots.push_back({spot.i, spot.j});
  }
  Json json{{"number", entry.number},
            {"target", Name(entry.picture.target)},
            {"pose", entry.picture.pose},
            {"channel", entry.picture.channel},
            {"group", entry.picture.group},
            {"repeat", entry.picture.repeat},
            {"spots", spots},
            {"exposure_us", entry.picture.exposure_us}};
  if (!entry.taken()) {
    json["skipped"] = entry.skipped;
  } else {
    json["applied_exposure_us"] = entry.exposure_us;
    json["file"] = entry.file;
    json["xxh3"] = entry.hash;
    json["frame_id"] = entry.frame_id;
    json["timestamp_ns"] = entry.timestamp_ns;
    json["attempts"] = entry.attempts;
    json["largest"] = entry.largest;
    json["bright"] = entry.bright;
    if (entry.resent_packets > 0) {
      json["resent_packets"] = entry.resent_packets;
    }
    if (entry.gain) {
      json["gain"] = *entry.gain;
    }
    if (entry.temperature_c) {
      json["temperature_c"] = *entry.temperature_c;
    }
  }
  const std::string text = json.dump();
  return text + '\t' + HashHex(text.data(), text.size()) + '\n';
}

Journal ParseJournal(const std::string& text, const std::string& origin) {
  Journal journal;
  std::int64_t line_number = 0;
  std::int64_t first_bad_line = 0;  // 0: none so far
  for (std::size_t begin = 0; begin < text.size();) {
    ++line_number;
    const std::size_t end = text.find('\n', begin);
    const std::string where = fmt::format("{}:{}", origin, line_number);
    const std::optional<JournalEntry> entry =
        end == std::string::npos
            ? std::nullopt
            : ParseLine(std::string_view(text).substr(begin, end - begin), where);
    if (!entry) {
      first_bad_line = first_bad_line == 0 ? line_number : first_bad_line;
    } else if (first_bad_line != 0) {
      throw BadData(fmt::format(
          "{}:{}: this line is damaged, and good ones follow it; restore the journal "
          "from a copy, or cut it off before this line to take the pictures from here "
          "on again",
          origin,
          first_bad_line));
    } else if (entry->number != std::ssize(journal.entries)) {
      throw BadData(fmt::format("{}: picture {} where {} was to follow",
                                where,
                                entry->number,
                                journal.entries.size()));
    } else {
      journal.entries.push_back(*entry);
      journal.good_bytes = end + 1;
      journal.line_ends.push_back(end + 1);
    }
    begin = end == std::string::npos ? text.size() : end + 1;
  }
  journal.torn_bytes = text.size() - journal.good_bytes;
  return journal;
}

JournalWriter::JournalWriter(const std::filesystem::path& path,
                             std::uint64_t keep_bytes)
    : path_(path),
      fd_(::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666)) {
  if (fd_ < 0) {
    throw SystemError("cannot open " + path_.string());
  }
  if (::ftruncate(fd_, static_cast<off_t>(keep_bytes)) != 0) {
    const Error error = SystemError("cannot cut off the torn end of " + path_.string());
    ::close(fd_);
    throw error;
  }
}

JournalWriter::~JournalWriter() {
  ::close(fd_);
}

void JournalWriter::Append(const JournalEntry& entry) {
  if (!WriteAll(fd_, FormatJournalLine(entry))) {
    throw SystemError("cannot write " + path_.string());
  }
}

void JournalWriter::Flush() {
  if (::fdatasync(fd_) != 0) {
    throw SystemError("cannot flush " + path_.string());
  }
}

}  // namespace nacre::acquire
