#include "acquire/session_writer.h"

#include "acquire/frame_file.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/simd_clones.h"
#include "core/version.h"

#include <algorithm>
#include <fcntl.h>
#include <fmt/format.h>
#include <sstream>
#include <unistd.h>

namespace nacre::acquire {
namespace {

void MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw Error(
        fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
  }
}

// What a process killed while it wrote the manifest has left behind. Only called under
// the lock: no living process is writing.
void RemoveHalfManifests(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(".session.") && name.ends_with(".tmp.json")) {
      std::filesystem::remove(entry.path());
    }
  }
}

// The first line in which two texts differ, both versions of it.
std::string FirstDifference(const std::string& before, const std::string& now) {
  std::istringstream before_lines(before);
  std::istringstream now_lines(now);
  std::string a;
  std::string b;
  for (int line = 1;; ++line) {
    const bool has_a = static_cast<bool>(std::getline(before_lines, a));
    const bool has_b = static_cast<bool>(std::getline(now_lines, b));
    if (!has_a && !has_b) {
      return "only the ends of lines differ";
    }
    if (has_a != has_b || a != b) {
      return fmt::format("line {} was '{}' and is '{}'",
                         line,
                         has_a ? a : "(no such line)",
                         has_b ? b : "(no such line)");
    }
  }
}

void RequireSame(const std::filesystem::path& folder,
                 const SessionManifest& before,
                 const SessionManifest& now) {
  const auto refuse = [&](const std::string& what) {
    throw UsageError(
        fmt::format("{}: can't resume: {}. Restore that, or capture into a new folder",
                    folder.string(),
                    what));
  };
  if (before.rig_text != now.rig_text) {
    refuse(fmt::format("{} changed since the session began: {}",
                       now.rig_file,
                       FirstDifference(before.rig_text, now.rig_text)));
  }
  if (before.seed != now.seed) {
    const auto name = [](const std::optional<std::uint64_t>& seed) {
      return seed ? std::to_string(*seed) : std::string("the rig's own");
    };
    refuse(fmt::format("the seed was {} and is {}", name(before.seed), name(now.seed)));
  }
  if (before.camera.model != now.camera.model ||
      before.camera.serial != now.camera.serial ||
      before.camera.width != now.camera.width ||
      before.camera.height != now.camera.height ||
      before.camera.bit_depth != now.camera.bit_depth ||
      before.camera.mosaic != now.camera.mosaic) {
    refuse(fmt::format("it was begun with the camera {} {} and this is {} {}",
                       before.camera.model,
                       before.camera.serial,
                       now.camera.model,
                       now.camera.serial));
  }
  if (before.illuminator.model != now.illuminator.model ||
      before.illuminator.serial != now.illuminator.serial ||
      before.illuminator.channels != now.illuminator.channels) {
    refuse(fmt::format("it was begun with the laser {} {} and this is {} {}",
                       before.illuminator.model,
                       before.illuminator.serial,
                       now.illuminator.model,
                       now.illuminator.serial));
  }
  if (before.picture_count != now.picture_count) {
    refuse(
        fmt::format("it was begun by version {}, which schedules {} pictures for "
                    "this rig instead of {}",
                    before.software_version,
                    before.picture_count,
                    now.picture_count));
  }
}

struct CountFigures {
  std::uint16_t largest = 0;
  std::int64_t bright = 0;
};

NACRE_AVX2_CLONES CountFigures Figures(const std::vector<std::uint16_t>& counts,
                                       int bit_depth) {
  std::uint16_t first_bright = 0;  // IsBright is monotonic
  while (!IsBright(first_bright, bit_depth)) {
    ++first_bright;
  }
  CountFigures figures;
  constexpr std::size_t kBlock = 16384;  // whose bright ones a small counter can hold
  for (std::size_t begin = 0; begin < counts.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, counts.size());
    std::uint16_t bright = 0;
    for (std::size_t k = begin; k < end; ++k) {
      figures.largest = std::max(figures.largest, counts[k]);
      bright = static_cast<std::uint16_t>(bright + (counts[k] >= first_bright ? 1 : 0));
    }
    figures.bright += bright;
  }
  return figures;
}

bool IsGoodFrame(const std::filesystem::path& folder, const JournalEntry& entry) {
  if (!entry.taken()) {
    return true;
  }
  const std::filesystem::path path = folder / entry.file;
  return entry.file == FrameFileName(entry.number) &&
         std::filesystem::is_regular_file(path) && HashFile(path) == entry.hash;
}

}  // namespace

SessionManifest MakeManifest(const RigDescription& rig,
                             const CameraInfo& camera,
                             const IlluminatorInfo& illuminator,
                             std::optional<std::uint64_t> seed) {
  if (illuminator.channels != rig.scanner.channels) {
    throw DeviceError(
        fmt::format("{}: scanner.channels is [{}], but the laser {} has [{}]",
                    rig.path.string(),
                    fmt::join(rig.scanner.channels, ", "),
                    illuminator.model,
                    fmt::join(illuminator.channels, ", ")));
  }
  return {.rig_text = rig.text,
          .rig_hash = rig.hash,
          .rig_file = rig.path.filename().string(),
          .camera = camera,
          .illuminator = illuminator,
          .picture_count = Schedule(rig).size(),
          .scan_map = std::nullopt,
          .seed = seed,
          .software_version = Version()};
}

SessionWriter::SessionWriter(const std::filesystem::path& folder,
                             const SessionManifest& manifest,
                             bool durable)
    : folder_(folder),
      lock_(std::make_unique<SessionLock>(folder)),
      manifest_(manifest),
      rig_(ParseRig(manifest.rig_text, folder / manifest.rig_file)),
      schedule_(rig_),
      durable_(durable) {
  RemoveHalfManifests(folder);
}

SessionWriter SessionWriter::Create(const std::filesystem::path& folder,
                                    const SessionManifest& manifest,
                                    bool durable) {
  MakeFolder(folder / "frames");
  SessionWriter writer(folder, manifest, durable);
  if (std::filesystem::exists(folder / "session.json")) {
    throw UsageError(folder.string() +
                     ": there is a session already; --resume goes on with it");
  }
  // The manifest comes last: a folder without one is no session and may be begun again.
  writer.journal_ = std::make_unique<JournalWriter>(folder / "journal", 0);
  WriteManifest(folder, manifest);
  return writer;
}

SessionWriter SessionWriter::Resume(const std::filesystem::path& folder,
                                    const SessionManifest& manifest,
                                    bool durable,
                                    const ProgressFunction& progress) {
  SessionManifest found = ReadManifest(folder);
  RequireSame(folder, found, manifest);
  SessionWriter writer(folder, found, durable);
  const std::filesystem::path path = folder / "journal";
  Journal journal = ParseJournal(ReadFile(path), path.string());
  writer.VerifyFrames(journal, progress);
  writer.journal_ = std::make_unique<JournalWriter>(path, journal.good_bytes);
  writer.entries_ = std::move(journal.entries);
  return writer;
}

void SessionWriter::VerifyFrames(Journal& journal, const ProgressFunction& progress) {
  const std::int64_t total = std::ssize(journal.entries);
  for (std::int64_t k = 0; k < total; ++k) {
    const JournalEntry& entry = journal.entries[static_cast<std::size_t>(k)];
    if (!IsGoodFrame(folder_, entry)) {
      dropped_count_ = total - k;
      journal.entries.resize(static_cast<std::size_t>(k));
      journal.good_bytes =
          k == 0 ? 0 : journal.line_ends[static_cast<std::size_t>(k - 1)];
      return;
    }
    Report(progress, {.stage = "verify", .done = k + 1, .total = total, .note = ""});
  }
}

std::vector<GridIndex> SessionWriter::LitPoints(int group) const {
  std::vector<GridIndex> lit;
  for (const GridIndex& point : schedule_.Group(group)) {
    const bool is_empty =
        manifest_.adaptive_plan &&
        std::find(manifest_.adaptive_plan->empty_points.begin(),
                  manifest_.adaptive_plan->empty_points.end(),
                  point) != manifest_.adaptive_plan->empty_points.end();
    if (!is_empty) {
      lit.push_back(point);
    }
  }
  return lit;
}

JournalEntry SessionWriter::NextEntry() const {
  Expect(picture_count() < schedule_.size(), "a picture that is scheduled");
  JournalEntry entry;
  entry.number = picture_count();
  entry.picture = schedule_[entry.number];
  if (entry.picture.group >= 0) {
    entry.spots = LitPoints(entry.picture.group);
  }
  return entry;
}

void SessionWriter::Commit(JournalEntry entry) {
  journal_->Append(entry);
  if (durable_) {
    journal_->Flush();
  }
  entries_.push_back(std::move(entry));
}

void SessionWriter::Append(const Frame& frame) {
  JournalEntry entry = NextEntry();
  const CameraInfo& camera = manifest_.camera;
  const std::size_t count = static_cast<std::size_t>(camera.width) *
                            static_cast<std::size_t>(camera.height) *
                            static_cast<std::size_t>(camera.SamplesPerPixel());
  if (frame.width != camera.width || frame.height != camera.height ||
      frame.counts.size() != count) {
    throw DeviceError(fmt::format(
        "picture {}: the camera {} announced {} x {} pixels and delivered {} x {} ({})",
        entry.number,
        camera.model,
        camera.width,
        camera.height,
        frame.width,
        frame.height,
        frame.counts.size()));
  }
  const CountFigures figures = Figures(frame.counts, camera.bit_depth);
  if (figures.largest >= 1 << camera.bit_depth) {
    throw DeviceError(fmt::format("picture {}: a count of {} from a camera of {} bits",
                                  entry.number,
                                  figures.largest,
                                  camera.bit_depth));
  }
  EncodeFrame(frame, camera.bit_depth, encoded_);
  entry.exposure_us = frame.exposure_us;
  entry.file = FrameFileName(entry.number);
  entry.hash = HashHex(encoded_.data(), encoded_.size());
  entry.frame_id = frame.frame_id;
  entry.timestamp_ns = frame.timestamp_ns;
  entry.attempts = frame.attempts;
  entry.resent_packets = frame.resent_packets;
  entry.gain = frame.gain;
  entry.temperature_c = frame.temperature_c;
  entry.largest = figures.largest;
  entry.bright = figures.bright;
  WriteFrameFile(folder_ / entry.file, encoded_, durable_);
  Commit(std::move(entry));
}

void SessionWriter::Skip(const std::string& reason) {
  JournalEntry entry = NextEntry();
  Expect(entry.picture.target == Target::kSample && !reason.empty(),
         "a picture of the sample, and a reason");
  entry.skipped = reason;
  Commit(std::move(entry));
}

void SessionWriter::SetScanMap(const ScanMap& map) {
  if (manifest_.scan_map) {
    Expect(*manifest_.scan_map == map, "one laser map a session");
    return;
  }
  manifest_.scan_map = map;
  WriteManifest(folder_, manifest_);
}

void SessionWriter::SetAdaptivePlan(const AdaptivePlan& plan) {
  if (manifest_.adaptive_plan) {
    Expect(*manifest_.adaptive_plan == plan, "one adaptive plan a session");
    return;
  }
  manifest_.adaptive_plan = plan;
  WriteManifest(folder_, manifest_);
}

void SessionWriter::Flush() {
  // One call for all the frames of a session instead of one for each.
  const int fd = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool failed = fd < 0 || ::syncfs(fd) != 0;
  const Error error = SystemError("cannot flush " + folder_.string());
  if (fd >= 0) {
    ::close(fd);
  }
  if (failed) {
    throw error;
  }
}

}  // namespace nacre::acquire
