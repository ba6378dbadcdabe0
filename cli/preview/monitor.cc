#include "cli/preview/monitor.h"

#include "cli/preview/frame_png.h"
#include "core/json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace nacre::cli::preview {
namespace {

constexpr int kBins = 64;

struct Figures {
  std::array<std::int64_t, kBins> histogram{};
  int largest = 0;
  double saturated = 0;  // share of the counts
  double mean = 0;
};

Figures FiguresOf(const acquire::Frame& frame, int bit_depth) {
  Figures figures;
  const int full = (1 << bit_depth) - 1;
  std::int64_t saturated = 0;
  double sum = 0;
  for (const std::uint16_t count : frame.counts) {
    const int bin = std::min(kBins - 1, count * kBins >> bit_depth);
    ++figures.histogram[static_cast<std::size_t>(bin)];
    figures.largest = std::max<int>(figures.largest, count);
    saturated += count >= full ? 1 : 0;
    sum += count;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(1, frame.counts.size()));
  figures.saturated = static_cast<double>(saturated) / n;
  figures.mean = sum / n;
  return figures;
}

}  // namespace

Monitor::Monitor(const acquire::RigDescription& rig, const acquire::CameraInfo& camera)
    : rig_(rig), schedule_(rig), camera_(camera) {}

void Monitor::OnFrame(std::int64_t number,
                      std::shared_ptr<const acquire::Frame> frame) {
  const std::lock_guard lock(mutex_);
  ++frames_;
  retaken_ += frame->attempts - 1;
  resent_packets_ += frame->resent_packets;
  last_ = {number, std::move(frame)};
}

void Monitor::OnProgress(const Progress& progress) {
  const std::lock_guard lock(mutex_);
  if (progress.stage != progress_.stage || first_done_ < 0) {
    first_done_ = progress.done - 1;
    stage_start_ = Clock::now();
  }
  progress_ = progress;
}

void Monitor::OnEnd(const std::string& message) {
  const std::lock_guard lock(mutex_);
  end_ = message;
}

bool Monitor::IsLastWordAwaited() const {
  constexpr std::chrono::seconds kJustNow{2};
  const std::lock_guard lock(mutex_);
  return Clock::now() - asked_ < kJustNow && !end_told_;
}

Monitor::Last Monitor::LastFrame() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

std::string Monitor::StateJson() const {
  const Last last = LastFrame();
  Json picture;
  if (last.frame) {
    const Figures figures = FiguresOf(*last.frame, camera_.bit_depth);
    const acquire::ScheduledPicture& scheduled = schedule_[last.number];
    picture = Json{
        {"number", last.number},
        {"target", acquire::Name(scheduled.target)},
        {"channel",
         scheduled.channel < 0
             ? Json()
             : Json(
                   rig_.scanner.channels[static_cast<std::size_t>(scheduled.channel)])},
        {"group", scheduled.group},
        {"exposure_us", last.frame->exposure_us},
        {"largest", figures.largest},
        {"mean", figures.mean},
        {"saturated", figures.saturated},
        {"histogram", figures.histogram},
        {"gain", last.frame->gain ? Json(*last.frame->gain) : Json()},
        {"temperature_c",
         last.frame->temperature_c ? Json(*last.frame->temperature_c) : Json()}};
  }
  const std::lock_guard lock(mutex_);
  asked_ = Clock::now();
  end_told_ = !end_.empty();
  const auto seconds = [](Clock::duration time) {
    return std::chrono::duration<double>(time).count();
  };
  const auto done_now = static_cast<double>(progress_.done - first_done_);
  const double per_unit =
      done_now > 0 ? seconds(Clock::now() - stage_start_) / done_now : 0;
  return Json{
      {"sample", rig_.sample.name},
      {"camera", camera_.model + ' ' + camera_.serial},
      {"full_count", (1 << camera_.bit_depth) - 1},
      {"mosaic", camera_.mosaic},
      {"stage", progress_.stage},
      {"done", progress_.done},
      {"total", progress_.total},
      {"elapsed_s", seconds(Clock::now() - start_)},
      {"eta_s", per_unit * static_cast<double>(progress_.total - progress_.done)},
      {"faults",
       {{"frames_retaken", retaken_},
        {"packets_resent", resent_packets_},
        {"frames", frames_}}},
      {"picture", picture},
      {"end", end_}}
      .dump();
}

std::string Monitor::FramePng(int max_side_px) const {
  const Last last = LastFrame();
  return last.frame ? preview::FramePng(*last.frame, camera_, max_side_px) : "";
}

}  // namespace nacre::cli::preview
