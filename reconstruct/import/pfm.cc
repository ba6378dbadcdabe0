#include "reconstruct/import/pfm.h"

#include "core/atomic_file.h"
#include "core/error.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <string_view>

namespace nacre::reconstruct {
namespace {

// The next word of the header; exactly one white space character ends it.
std::string_view NextWord(std::string_view bytes, std::size_t& at) {
  const auto space = [&](std::size_t k) {
    return bytes[k] == ' ' || bytes[k] == '\n' || bytes[k] == '\r' || bytes[k] == '\t';
  };
  while (at < bytes.size() && space(at)) {
    ++at;
  }
  const std::size_t begin = at;
  while (at < bytes.size() && !space(at)) {
    ++at;
  }
  const std::string_view word = bytes.substr(begin, at - begin);
  at = std::min(at + 1, bytes.size());
  return word;
}

template <class Number>
Number Parse(std::string_view word, const char* name, const std::string& origin) {
  Number number{};
  const auto [end, error] =
      std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || end != word.data() + word.size()) {
    throw BadData(fmt::format("{}: not a PFM picture: {} is '{}', not a number",
                              origin,
                              name,
                              word.substr(0, 32)));
  }
  return number;
}

float LoadFloat(const char* at, bool little) {
  std::uint32_t bits = 0;
  for (int b = 0; b < 4; ++b) {
    const auto byte = static_cast<unsigned char>(at[little ? 3 - b : b]);
    bits = bits << 8 | byte;
  }
  return std::bit_cast<float>(bits);
}

}  // namespace

ExrPart ReadPfm(const std::filesystem::path& path) {
  const std::string origin = path.string();
  const std::string bytes = ReadFile(path);
  std::size_t at = 0;
  const std::string_view magic = NextWord(bytes, at);
  if (magic != "PF" && magic != "Pf") {
    throw BadData(origin + ": not a PFM picture: it doesn't start with PF or Pf");
  }
  ExrPart picture;
  picture.channels = magic == "PF" ? std::vector<std::string>{"R", "G", "B"}
                                   : std::vector<std::string>{"Y"};
  picture.width = Parse<int>(NextWord(bytes, at), "the width", origin);
  picture.height = Parse<int>(NextWord(bytes, at), "the height", origin);
  const double scale = Parse<double>(NextWord(bytes, at), "the scale", origin);
  if (picture.width < 1 || picture.height < 1 || !std::isfinite(scale) || scale == 0) {
    throw BadData(fmt::format("{}: not a PFM picture: width {}, height {}, scale {}",
                              origin,
                              picture.width,
                              picture.height,
                              scale));
  }
  const std::size_t channels = picture.channels.size();
  const double expected =
      4.0 * static_cast<double>(channels) * picture.width * picture.height;
  const double found = static_cast<double>(bytes.size()) - static_cast<double>(at);
  if (found != expected) {
    throw BadData(
        fmt::format("{}: {} x {} pixels of {} channels need {:.0f} bytes, found {:.0f}",
                    origin,
                    picture.width,
                    picture.height,
                    channels,
                    expected,
                    std::max(0.0, found)));
  }
  picture.values.resize(channels * picture.PixelCount());
  const auto factor = static_cast<float>(std::abs(scale));
  const auto width = static_cast<std::size_t>(picture.width);
  const auto height = static_cast<std::size_t>(picture.height);
  for (std::size_t row = 0; row < height; ++row) {  // from the bottom
    for (std::size_t x = 0; x < width; ++x) {
      for (std::size_t c = 0; c < channels; ++c) {
        const float value = LoadFloat(&bytes[at], scale < 0);
        picture.Channel(c)[(height - 1 - row) * width + x] =
            factor == 1.0F ? value : value * factor;
        at += 4;
      }
    }
  }
  return picture;
}

}  // namespace nacre::reconstruct
