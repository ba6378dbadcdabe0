#include "rigs/internal/helios_firmware.h"

#include <algorithm>
#include <utility>

namespace nacre::rigs::internal {
namespace {

constexpr std::int64_t kDeafNs = 100'000'000;
constexpr std::size_t kPointBytes = 7;
constexpr std::size_t kTailBytes = 5;
constexpr std::size_t kMostPoints = 4095;

std::uint16_t Word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

}  // namespace

void HeliosFirmware::Reset(std::int64_t now_ns) {
  Advance(now_ns);
  current_.reset();
  next_.reset();
  shutter_ = false;
  deaf_until_ns_ = 0;
  answers_.clear();
  SetLight(now_ns);
}

void HeliosFirmware::Command(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  Advance(now_ns);
  const std::uint8_t code = bytes.empty() ? std::uint8_t{0} : bytes[0];
  switch (code) {
    case 0x01:
      ++counts_.stops;
      current_.reset();
      next_.reset();
      deaf_until_ns_ = now_ns + kDeafNs;
      break;
    case 0x02:
      shutter_ = bytes.size() > 1 && bytes[1] != 0;
      break;
    case 0x03:
      answers_.push_back({0x83, static_cast<std::uint8_t>(next_ ? 0 : 1)});
      break;
    case 0x04:
      answers_.push_back({0x84,
                          static_cast<std::uint8_t>(firmware_),
                          static_cast<std::uint8_t>(firmware_ >> 8),
                          static_cast<std::uint8_t>(firmware_ >> 16),
                          static_cast<std::uint8_t>(firmware_ >> 24)});
      break;
    case 0x05: {
      std::vector<std::uint8_t> answer(32, 0);
      answer[0] = 0x85;
      std::copy_n(
          name_.begin(), std::min<std::size_t>(30, name_.size()), answer.begin() + 1);
      answers_.push_back(std::move(answer));
      break;
    }
    case 0x06: {
      const auto end = std::find(bytes.begin() + 1, bytes.end(), std::uint8_t{0});
      name_.assign(bytes.begin() + 1, end);
      break;
    }
    case 0x07:
      break;
    default:
      ++counts_.malformed;
  }
  SetLight(now_ns);
}

bool HeliosFirmware::HasRoom(std::int64_t now_ns) {
  Advance(now_ns);
  return !next_;
}

void HeliosFirmware::Frame(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  Advance(now_ns);
  const std::size_t points =
      bytes.size() < kTailBytes ? 0 : Word(bytes, bytes.size() - 3);
  const int points_per_s =
      bytes.size() < kTailBytes ? 0 : Word(bytes, bytes.size() - kTailBytes);
  if (points == 0 || points > kMostPoints ||
      bytes.size() != points * kPointBytes + kTailBytes || points_per_s < 7 ||
      (points + 64 - 45) % 64 == 0) {
    ++counts_.malformed;
    return;
  }
  if (now_ns < deaf_until_ns_) {
    ++counts_.discarded;
    return;
  }
  ++counts_.frames;
  auto frame = std::make_shared<acquire::LaserFrame>();
  frame->points_per_s = points_per_s;
  for (std::size_t k = 0; k < points; ++k) {
    const std::uint8_t* p = &bytes[k * kPointBytes];
    frame->points.push_back({static_cast<std::uint16_t>(p[0] << 4 | p[1] >> 4),
                             static_cast<std::uint16_t>((p[1] & 0xF) << 8 | p[2]),
                             p[3],
                             p[4],
                             p[5],
                             p[6]});
  }
  const std::uint8_t flags = bytes[bytes.size() - 1];
  Output output{
      .frame = frame,
      .has_light = std::any_of(frame->points.begin(),
                               frame->points.end(),
                               [](const auto& point) { return point.IsLit(); }),
      .loops = (flags & 2) == 0};
  counts_.looping += output.loops ? 1 : 0;
  if (!current_ || (flags & 1) != 0) {
    Begin(std::move(output), now_ns);
  } else {
    next_ = std::move(output);
  }
}

void HeliosFirmware::Begin(Output output, std::int64_t now_ns) {
  output.end_ns = now_ns + static_cast<std::int64_t>(output.frame->Seconds() * 1e9);
  current_ = std::move(output);
  SetLight(now_ns);
}

void HeliosFirmware::Advance(std::int64_t now_ns) {
  while (current_ && current_->end_ns <= now_ns) {
    const std::int64_t end_ns = current_->end_ns;
    if (next_) {
      Begin(*std::exchange(next_, std::nullopt), end_ns);
    } else if (current_->loops) {
      Begin(*current_, end_ns);
    } else {
      current_.reset();
      SetLight(end_ns);
    }
  }
}

void HeliosFirmware::SetLight(std::int64_t now_ns) {
  const bool lit = shutter_ && current_ && current_->has_light;
  if (lit && !lit_) {
    spans_.push_back({now_ns, now_ns});
  } else if (!lit && lit_) {
    spans_.back().end_ns = now_ns;
  }
  lit_ = lit;
}

std::shared_ptr<const acquire::LaserFrame> HeliosFirmware::Emitting(
    std::int64_t now_ns) {
  Advance(now_ns);
  return lit_ ? current_->frame : nullptr;
}

std::vector<LitSpan> HeliosFirmware::LitSpans(std::int64_t now_ns) {
  Advance(now_ns);
  std::vector<LitSpan> spans = spans_;
  if (lit_) {
    spans.back().end_ns = now_ns;
  }
  return spans;
}

}  // namespace nacre::rigs::internal
