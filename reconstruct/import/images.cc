#include "reconstruct/import/images.h"

#include "core/error.h"
#include "core/exr.h"
#include "core/hash.h"
#include "core/options_json.h"
#include "core/png.h"
#include "core/provenance.h"
#include "reconstruct/import/pfm.h"
#include "reconstruct/rd_dataset.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <regex>

namespace nacre::reconstruct {
namespace {

using ImageMap = std::map<std::pair<int, int>, std::filesystem::path>;

struct NamePattern {
  std::regex expression;
  bool i_first = true;  ///< {i} stands before {j}
};

// {i} and {j} become groups of digits, * and ? what they are in a shell.
NamePattern Compile(const std::string& pattern) {
  const std::size_t i = pattern.find("{i}");
  const std::size_t j = pattern.find("{j}");
  if (i == std::string::npos || j == std::string::npos ||
      pattern.find("{i}", i + 1) != std::string::npos ||
      pattern.find("{j}", j + 1) != std::string::npos) {
    throw UsageError(
        fmt::format("--pattern '{}' must hold {{i}} and {{j}} once each, as in "
                    "'scan_{{i}}_{{j}}.exr'",
                    pattern));
  }
  std::string text;
  for (std::size_t at = 0; at < pattern.size(); ++at) {
    if (at == i || at == j) {
      text += "([0-9]{1,7})";
      at += 2;
    } else if (pattern[at] == '*') {
      text += ".*";
    } else if (pattern[at] == '?') {
      text += '.';
    } else {
      text += std::isalnum(static_cast<unsigned char>(pattern[at])) != 0
                  ? std::string(1, pattern[at])
                  : std::string("\\") + pattern[at];
    }
  }
  return {std::regex(text), i < j};
}

ExrPart ReadPngPart(const std::filesystem::path& path) {
  const PngImage image = ReadPng(path);
  ExrPart part;
  part.width = image.width;
  part.height = image.height;
  part.channels = image.channel_count >= 3 ? std::vector<std::string>{"R", "G", "B"}
                                           : std::vector<std::string>{"Y"};
  part.values.resize(part.channels.size() * part.PixelCount());
  const float full = image.bit_depth == 16 ? 65535.0F : 255.0F;
  const auto stride = static_cast<std::size_t>(image.channel_count);
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    for (std::size_t p = 0; p < part.PixelCount(); ++p) {
      part.Channel(c)[p] = static_cast<float>(image.values[p * stride + c]) / full;
    }
  }
  return part;
}

ExrPart ReadPicture(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  if (extension == ".exr") {
    ExrPart part = std::move(ReadExr(path).at(0));
    // Opacity isn't a colour of light.
    if (part.channels.size() > 1 && part.channels.back() == "A") {
      part.values.resize((part.channels.size() - 1) * part.PixelCount());
      part.channels.pop_back();
    }
    return part;
  }
  if (extension == ".pfm") {
    return ReadPfm(path);
  }
  if (extension == ".png") {
    return ReadPngPart(path);
  }
  throw BadData(fmt::format(
      "{}: pictures of this kind aren't read; convert to .exr, .pfm or 16-bit .png",
      path.string()));
}

// Windows cut from pictures: `left` and `top` are the pixel of window cell (0, 0).
struct Cutter {
  const ImportOptions& options;
  float scale;
  std::int64_t clamped_count = 0;
  std::int64_t invalid_count = 0;

  void Cut(const ExrPart& picture,
           const std::string& origin,
           std::pair<int, int> left_top,
           int core,
           RdSlice& slice) {
    std::size_t at = 0;
    for (std::size_t c = 0; c < picture.channels.size(); ++c) {
      for (int v = 0; v < core; ++v) {
        for (int u = 0; u < core; ++u, ++at) {
          const int x = left_top.first + u;
          const int y = left_top.second + v;
          const bool inside =
              x >= 0 && x < picture.width && y >= 0 && y < picture.height;
          slice.valid[at] = inside ? 1 : 0;
          slice.rd[at] = inside ? Checked(picture, origin, c, {x, y}) : 0.0F;
          invalid_count += inside ? 0 : 1;
        }
      }
    }
  }

  float Checked(const ExrPart& picture,
                const std::string& origin,
                std::size_t c,
                std::pair<int, int> pixel) {
    const auto [x, y] = pixel;
    const float value = picture.Channel(
        c)[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
           static_cast<std::size_t>(x)];
    const float scaled = scale == 1.0F ? value : value * scale;
    if (std::isfinite(scaled) && !(value < 0)) {
      return scaled;
    }
    if (std::isfinite(scaled) && options.clamp_negative) {
      ++clamped_count;
      return 0;
    }
    throw BadData(
        fmt::format("{}: value {} at pixel ({}, {}), channel {}; R_d is finite and not "
                    "negative{}",
                    origin,
                    value,
                    x,
                    y,
                    picture.channels[c],
                    std::isfinite(scaled) ? "; --clamp-negative reads it as 0" : ""));
  }
};

void CheckWindow(const ExrPart& picture, const std::string& origin) {
  if (picture.width != picture.height || picture.width % 2 == 0) {
    throw BadData(
        fmt::format("{}: {} x {} pixels aren't a window, which is square and odd; if "
                    "each picture is a whole frame, say --core",
                    origin,
                    picture.width,
                    picture.height));
  }
}

void CheckFrame(const ExrPart& picture,
                const RdHeader& header,
                const std::string& origin) {
  if ((picture.width - header.points_x) % 2 != 0 ||
      (picture.height - header.points_y) % 2 != 0) {
    throw BadData(fmt::format(
        "{}: a frame of {} x {} pixels can't be centred on {} x {} grid points with "
        "every point at a pixel's centre: both must be odd or both even",
        origin,
        picture.width,
        picture.height,
        header.points_x,
        header.points_y));
  }
}

RdHeader HeaderOf(const ImageMap& images,
                  const ImportOptions& options,
                  const ImageImportOptions& image_options) {
  const auto& [last, first_path] = *images.rbegin();  // a map is sorted
  const ExrPart picture = ReadPicture(first_path);
  RdHeader header;
  header.points_x = last.second + 1;
  header.points_y = last.first + 1;
  header.pitch_mm = options.pitch_mm;
  header.eta = options.eta;
  header.channels = picture.channels;
  header.core = image_options.core;
  if (header.core == 0) {
    CheckWindow(picture, first_path.string());
    header.core = picture.width;
  } else {
    CheckFrame(picture, header, first_path.string());
  }
  Provenance provenance{.command = "import", .options = OptionsToJson(options)};
  provenance.options["from"] = "images";
  provenance.options.update(OptionsToJson(image_options));
  std::string hashes;
  for (const auto& [point, path] : images) {
    hashes += HashFile(path);
  }
  provenance.inputs.push_back({{"file", first_path.parent_path().filename().string()},
                               {"pictures", images.size()},
                               {"xxh3", HashHex(hashes.data(), hashes.size())}});
  header.provenance = provenance.ToString();
  Validate(header, first_path.string());
  return header;
}

}  // namespace

ImageMap FindImages(const std::filesystem::path& folder,
                    const ImageImportOptions& options) {
  if (!std::filesystem::is_directory(folder)) {
    throw Error("cannot read " + folder.string() + ": there is no such folder");
  }
  const NamePattern pattern = Compile(options.pattern);
  ImageMap images;  // by (row, column)
  int columns = 0;
  int rows = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    std::smatch match;
    if (!entry.is_regular_file() ||
        !std::regex_match(name, match, pattern.expression)) {
      continue;
    }
    const int i = std::stoi(match[pattern.i_first ? 1 : 2].str()) - options.first;
    const int j = std::stoi(match[pattern.i_first ? 2 : 1].str()) - options.first;
    if (i < 0 || j < 0) {
      throw BadData(fmt::format("{}: numbered below the first, {} (see --first)",
                                entry.path().string(),
                                options.first));
    }
    const auto [place, fresh] = images.emplace(std::pair(j, i), entry.path());
    if (!fresh) {
      throw BadData(fmt::format("{} and {} are both for column {}, row {}",
                                place->second.string(),
                                entry.path().string(),
                                i + options.first,
                                j + options.first));
    }
    columns = std::max(columns, i + 1);
    rows = std::max(rows, j + 1);
  }
  if (images.empty()) {
    throw BadData(fmt::format(
        "{}: no file name fits the pattern '{}'", folder.string(), options.pattern));
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      if (!images.contains({j, i})) {
        throw BadData(fmt::format(
            "{}: {} pictures, but none for column {}, row {} of {} x {} (the "
            "first is {}; see --first)",
            folder.string(),
            images.size(),
            i + options.first,
            j + options.first,
            columns,
            rows,
            options.first));
      }
    }
  }
  return images;
}

ImportSummary ImportImages(const std::filesystem::path& folder,
                           const std::filesystem::path& to,
                           const ImportOptions& options,
                           const ImageImportOptions& image_options,
                           const ProgressFunction& progress) {
  nacre::Validate(options);
  nacre::Validate(image_options);
  const ImageMap images = FindImages(folder, image_options);
  const RdHeader header = HeaderOf(images, options, image_options);
  RdWriter writer(to, header);
  Cutter cutter{options, static_cast<float>(options.scale)};
  RdSlice slice = MakeSlice(header);
  int width = 0;
  int height = 0;
  std::int64_t done = 0;
  for (const auto& [point, path] : images) {
    Report(progress, {"import", done++, header.PointCount(), ""});
    const ExrPart picture = ReadPicture(path);
    width = width == 0 ? picture.width : width;
    height = height == 0 ? picture.height : height;
    if (picture.width != width || picture.height != height ||
        picture.channels != header.channels) {
      throw BadData(
          fmt::format("{}: {} x {} pixels of {} channels, unlike the other pictures' "
                      "{} x {} of {}",
                      path.string(),
                      picture.width,
                      picture.height,
                      picture.channels.size(),
                      width,
                      height,
                      header.channels.size()));
    }
    const auto [j, i] = point;
    const int left = image_options.core == 0
                         ? 0
                         : (width - header.points_x) / 2 + i - header.Radius();
    const int top = image_options.core == 0
                        ? 0
                        : (height - header.points_y) / 2 + j - header.Radius();
    cutter.Cut(picture, path.string(), {left, top}, header.core, slice);
    writer.WriteSlice(i, j, slice);
  }
  writer.Finish();
  Report(progress, {"import", header.PointCount(), header.PointCount(), ""});
  return {.points_x = header.points_x,
          .points_y = header.points_y,
          .core = header.core,
          .channel_count = static_cast<int>(header.channels.size()),
          .clamped_count = cutter.clamped_count,
          .invalid_count = cutter.invalid_count};
}

}  // namespace nacre::reconstruct
