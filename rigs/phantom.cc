#include "rigs/phantom.h"

#include "core/error.h"
#include "core/toml.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <set>
#include <span>

namespace nacre::rigs {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPerMmMax = 1e6;

// The enumerator whose Name() the file gives, or an error that lists them all.
template <class Enum>
Enum Choose(const TomlTable& table,
            const std::string& key,
            const std::string& text,
            std::span<const Enum> choices) {
  std::string known;
  for (const Enum choice : choices) {
    if (text == Name(choice)) {
      return choice;
    }
    known += (known.empty() ? "" : ", ") + std::string(Name(choice));
  }
  throw table.At(key, fmt::format("'{}' is not known; known are: {}", text, known));
}

Slab ReadSlab(const TomlTable& table) {
  constexpr std::array kBottoms = {
      Bottom::kAir, Bottom::kMatched, Bottom::kBlack, Bottom::kWhite};
  Slab slab;
  slab.thickness_mm = table.Number("thickness_mm", Range{1e-6, kInfinity});
  slab.eta = table.Number("eta", Range{1, 4});
  slab.bottom = Choose<Bottom>(table, "bottom", table.Text("bottom", "air"), kBottoms);
  table.RejectUnknownKeys();
  return slab;
}

// A list with a value a channel; one value stands for all channels.
std::vector<double> PerChannel(const TomlTable& table,
                               const std::string& key,
                               std::vector<double> values,
                               std::size_t channels) {
  if (values.size() == 1) {
    values.resize(channels, values.front());
  }
  if (values.size() != channels) {
    throw table.At(key,
                   fmt::format("{} values for {} channels", values.size(), channels));
  }
  return values;
}

Medium ReadMedium(const TomlTable& table, std::size_t channels) {
  constexpr double kMostForward = 0.999;
  Medium medium;
  medium.name = table.Text("name", "");
  const Range coefficient{0, kPerMmMax};
  const auto read = [&](const std::string& key, std::vector<double> values) {
    return PerChannel(table, key, std::move(values), channels);
  };
  medium.sigma_a_per_mm =
      read("sigma_a_per_mm", table.Numbers("sigma_a_per_mm", coefficient));
  medium.sigma_s_per_mm =
      read("sigma_s_per_mm", table.Numbers("sigma_s_per_mm", coefficient));
  medium.g = read("g", table.Numbers("g", {0.0}, Range{-kMostForward, kMostForward}));
  table.RejectUnknownKeys();
  return medium;
}

// As the file names them, else R, G, B for three and c1, c2, … for other counts, which
// is that of the first medium's longest list.
std::vector<std::string> ReadChannels(const TomlTable& root,
                                      const std::vector<TomlTable>& media) {
  std::vector<std::string> channels = root.Texts("channels", {});
  if (root.Has("channels")) {
    const std::set<std::string> distinct(channels.begin(), channels.end());
    if (channels.empty() || distinct.size() != channels.size() ||
        distinct.contains("")) {
      throw root.At("channels", "expected different, non-empty names");
    }
    return channels;
  }
  std::size_t count = 1;
  for (const TomlTable& medium : media) {
    count = std::max({count,
                      medium.Numbers("sigma_a_per_mm").size(),
                      medium.Numbers("sigma_s_per_mm").size()});
  }
  if (count == 3) {
    return {"R", "G", "B"};
  }
  for (std::size_t c = 0; c < count; ++c) {
    channels.push_back(fmt::format("c{}", c + 1));
  }
  return channels;
}

Pattern ReadPattern(const TomlTable& table) {
  constexpr std::array kTypes = {
      PatternType::kHomogeneous, PatternType::kChessboard, PatternType::kStripes};
  Pattern pattern;
  pattern.type = Choose<PatternType>(table, "type", table.Text("type"), kTypes);
  if (pattern.type != PatternType::kHomogeneous) {
    pattern.cell_mm = table.Number("cell_mm", Range{1e-3, 1e6});
  }
  table.RejectUnknownKeys();
  return pattern;
}

Beam ReadBeam(const TomlTable& table) {
  constexpr std::array kShapes = {
      BeamShape::kPencil, BeamShape::kSquare, BeamShape::kDisc, BeamShape::kGaussian};
  Beam beam;
  beam.shape =
      Choose<BeamShape>(table, "shape", table.Text("shape", "pencil"), kShapes);
  if (beam.shape != BeamShape::kPencil) {
    beam.width_mm = table.Number("width_mm", Range{1e-6, 1e4});
  }
  beam.angle_rad =
      table.Number("angle_deg", 0, Range{-89, 89}) * std::numbers::pi / 180;
  table.RejectUnknownKeys();
  return beam;
}

acquire::GridDescription ReadGrid(const TomlTable& table) {
  acquire::GridDescription grid;
  const std::vector<double> points = table.Numbers("points", Range{1, 4096});
  if (points.size() != 2 || points[0] != std::floor(points[0]) ||
      points[1] != std::floor(points[1])) {
    throw table.At("points", "expected two whole numbers, [along x, along y]");
  }
  grid.points_x = static_cast<int>(points[0]);
  grid.points_y = static_cast<int>(points[1]);
  grid.pitch_mm = table.Number("pitch_mm", Range{1e-3, 1e3});
  grid.core = table.Integer("core", Range{1, 1001});
  if (grid.core % 2 == 0) {
    throw table.At(
        "core",
        fmt::format("{} is even; the window has a cell in its middle, so it must be "
                    "odd",
                    grid.core));
  }
  table.RejectUnknownKeys();
  return grid;
}

Phantom FromTable(const TomlTable& root) {
  Phantom phantom;
  phantom.slab = ReadSlab(root.Table("slab"));
  const std::vector<TomlTable> media = root.Tables("medium");
  if (media.empty()) {
    throw root.At("medium", "missing: what the slab is made of, [[medium]]");
  }
  phantom.channels = ReadChannels(root, media);
  for (const TomlTable& medium : media) {
    phantom.media.push_back(ReadMedium(medium, phantom.channels.size()));
  }
  if (const auto pattern = root.FindTable("pattern")) {
    phantom.pattern = ReadPattern(*pattern);
  }
  if (static_cast<int>(phantom.media.size()) != phantom.pattern.MediumCount()) {
    throw root.At("medium",
                  fmt::format("{} given, but the pattern '{}' is made of {}",
                              phantom.media.size(),
                              Name(phantom.pattern.type),
                              phantom.pattern.MediumCount()));
  }
  if (const auto beam = root.FindTable("beam")) {
    phantom.beam = ReadBeam(*beam);
  }
  if (const auto grid = root.FindTable("grid")) {
    phantom.grid = ReadGrid(*grid);
  }
  root.RejectUnknownKeys();
  return phantom;
}

}  // namespace

const char* Name(Bottom bottom) {
  switch (bottom) {
    case Bottom::kAir:
      return "air";
    case Bottom::kMatched:
      return "matched";
    case Bottom::kBlack:
      return "black";
    case Bottom::kWhite:
      return "white";
  }
  throw LogicError("a bottom of no kind");
}

const char* Name(BeamShape shape) {
  switch (shape) {
    case BeamShape::kPencil:
      return "pencil";
    case BeamShape::kSquare:
      return "square";
    case BeamShape::kDisc:
      return "disc";
    case BeamShape::kGaussian:
      return "gaussian";
  }
  throw LogicError("a beam of no shape");
}

Phantom ReadPhantom(const std::filesystem::path& path) {
  return FromTable(TomlTable::FromFile(path));
}

Phantom ParsePhantom(const std::string& text, const std::string& origin) {
  return FromTable(TomlTable::FromText(text, origin));
}

}  // namespace nacre::rigs
