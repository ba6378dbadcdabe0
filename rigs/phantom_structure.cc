#include "rigs/phantom_structure.h"

#include "rigs/phantom_files.h"
#include "rigs/phantom_inclusions.h"
#include "rigs/phantom_stone.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <type_traits>

namespace nacre::rigs {
namespace {

constexpr Range kLengthMm{1e-4, 1e6};
constexpr Range kPlaceMm{-1e6, 1e6};

void RequireMedia(const TomlTable& table,
                  const Phantom& phantom,
                  std::size_t fewest,
                  std::size_t most) {
  const std::size_t count = phantom.media.size();
  if (count < fewest || count > most) {
    throw table.At("type",
                   fmt::format("{} media given, but the pattern '{}' is made of {}",
                               count,
                               table.Text("type"),
                               most == fewest ? std::to_string(most)
                                              : fmt::format("{} to {}", fewest, most)));
  }
}

std::array<double, 2> ReadPair(const TomlTable& table,
                               const std::string& key,
                               const std::vector<double>& values) {
  if (values.size() != 2) {
    throw table.At(key, "expected two numbers, [along x, along y]");
  }
  return {values[0], values[1]};
}

// The box that windows of the grid's outermost points reach to.
std::array<double, 2> ReadExtent(const TomlTable& table, const Phantom& phantom) {
  const acquire::GridDescription& grid = phantom.grid;
  if (!table.Has("extent_mm") && grid.points_x == 0) {
    throw table.At(
        "extent_mm",
        "missing: width and height of what is made up, [x, y]; it is that of "
        "the grid's windows if there is a [grid]");
  }
  return ReadPair(table,
                  "extent_mm",
                  table.Numbers("extent_mm",
                                {(grid.points_x + grid.core) * grid.pitch_mm,
                                 (grid.points_y + grid.core) * grid.pitch_mm},
                                kLengthMm));
}

double ReadDepth(const TomlTable& table, const Phantom& phantom) {
  if (std::isfinite(phantom.slab.thickness_mm)) {
    return phantom.slab.thickness_mm;
  }
  if (!table.Has("depth_mm")) {
    throw table.At(
        "depth_mm",
        "missing: the slab is infinitely thick; down to where is it made up? "
        "Below, what is lowest goes on");
  }
  return table.Number("depth_mm", kLengthMm);
}

void CheckSize(const TomlTable& table,
               const std::string& key,
               const VoxelLayout& layout) {
  double voxels = 1;
  for (const int along : layout.count) {
    voxels *= along;
  }
  if (voxels > static_cast<double>(kMostVoxels)) {
    throw table.At(key,
                   fmt::format("{} × {} × {} voxels are more than {}: use larger ones, "
                               "or a smaller extent",
                               layout.count[0],
                               layout.count[1],
                               layout.count[2],
                               kMostVoxels));
  }
}

// Cubes of about voxel_mm, fitted to the depth; one high if `flat`.
VoxelLayout ReadLayout(const TomlTable& table, const Phantom& phantom, bool flat) {
  constexpr double kVoxelsAcross = 256;
  constexpr double kMostAlong = 1e6;
  const auto [width, height] = ReadExtent(table, phantom);
  const double size =
      table.Number("voxel_mm", std::max(width, height) / kVoxelsAcross, kLengthMm);
  const double depth = flat ? size : ReadDepth(table, phantom);
  const auto along = [&](double length) {
    const double count = std::max(1.0, std::round(length / size));
    if (!(count <= kMostAlong)) {
      throw table.At(
          "voxel_mm",
          fmt::format("{} mm make {:.3g} voxels along {} mm; use larger ones",
                      size,
                      count,
                      length));
    }
    return static_cast<int>(count);
  };
  VoxelLayout layout{.count = {along(width), along(height), along(depth)},
                     .size_mm = {size, size, size}};
  layout.size_mm[2] = depth / layout.count[2];
  layout.left_mm = -0.5 * layout.count[0] * size;
  layout.lower_mm = -0.5 * layout.count[1] * size;
  CheckSize(table, "voxel_mm", layout);
  return layout;
}

template <class Options>
Options ReadOptions(const TomlTable& table) {
  Options options;
  Options::Visit(options, [&](const char* name, auto& value, Range range, const char*) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, int>) {
      value = table.Integer(name, value, range);
    } else {
      value = table.Number(name, value, range);
    }
  });
  return options;
}

// `flat`: the same at every depth. Two media are a plane pattern then, which the fast
// solver can do as well.
Structure Mixed(const VoxelLayout& layout,
                const Phantom& phantom,
                bool flat,
                const VoxelFunction& mixture) {
  if (flat && phantom.media.size() == 2) {
    return {.pattern = MixPlane(layout, mixture)};
  }
  return {.pattern = {},
          .voxels = std::make_shared<Voxels>(
              MixVoxels(layout, phantom.media.size(), mixture))};
}

Structure ReadStone(const TomlTable& table, const Phantom& phantom, bool onyx) {
  constexpr std::size_t kMostInChain = 16;
  RequireMedia(table, phantom, 2, kMostInChain);
  const bool flat = !table.Boolean("solid", true);
  const VoxelLayout layout = ReadLayout(table, phantom, flat);
  const VoxelFunction mixture = onyx ? OnyxMixture(ReadOptions<OnyxOptions>(table))
                                     : MarbleMixture(ReadOptions<VeinOptions>(table));
  table.RejectUnknownKeys();
  return Mixed(layout, phantom, flat, mixture);
}

std::size_t ReadMediumIndex(const TomlTable& table, const Phantom& phantom) {
  const std::string name = table.Text("medium");
  std::string known;
  for (std::size_t k = 0; k < phantom.media.size(); ++k) {
    if (phantom.media[k].name == name) {
      return k;
    }
    known += (known.empty() ? "" : ", ") + phantom.media[k].name;
  }
  throw table.At(
      "medium", fmt::format("'{}' is not one of the phantom's media: {}", name, known));
}

std::array<double, 3> ReadTriple(const TomlTable& table,
                                 const std::string& key,
                                 Range range) {
  const std::vector<double> values = table.Numbers(key, range);
  if (values.size() != 3) {
    throw table.At(key, "expected three numbers, [x, y, depth]");
  }
  return {values[0], values[1], values[2]};
}

Inclusion ReadInclusion(const TomlTable& table, const Phantom& phantom) {
  Inclusion inclusion{.medium = ReadMediumIndex(table, phantom),
                      .centre_mm = ReadTriple(table, "centre_mm", kPlaceMm)};
  if (table.Has("radii_mm")) {
    inclusion.radii_mm = ReadTriple(table, "radii_mm", kLengthMm);
  } else {
    inclusion.radii_mm.fill(table.Number("radius_mm", kLengthMm));
  }
  inclusion.turn_rad =
      table.Number("turn_deg", 0, Range{-360, 360}) * std::numbers::pi / 180;
  table.RejectUnknownKeys();
  return inclusion;
}

std::vector<Inclusion> ReadStrewn(const TomlTable& table,
                                  const Phantom& phantom,
                                  const VoxelLayout& layout) {
  constexpr double kMostSpheres = 1e6;
  Strewn strewn{.medium = ReadMediumIndex(table, phantom)};
  strewn.count = table.Integer("count", Range{1, kMostSpheres});
  strewn.seed = static_cast<std::uint64_t>(table.Integer("seed", 1, Range{0, 2e9}));
  const std::vector<double> radius = table.Numbers("radius_mm", kLengthMm);
  if (radius.size() > 2 || radius.empty() || radius.back() < radius.front()) {
    throw table.At("radius_mm", "expected one number, or [smallest, largest]");
  }
  strewn.smallest_mm = radius.front();
  strewn.largest_mm = radius.back();
  strewn.low_mm = {layout.left_mm, layout.lower_mm, 0};
  strewn.high_mm = {
      -layout.left_mm, -layout.lower_mm, layout.count[2] * layout.size_mm[2]};
  table.RejectUnknownKeys();
  return Strew(strewn);
}

Structure ReadInclusions(const TomlTable& table, const Phantom& phantom) {
  RequireMedia(table, phantom, 2, UINT16_MAX);
  const VoxelLayout layout = ReadLayout(table, phantom, false);
  std::vector<Inclusion> inclusions;
  for (const TomlTable& each : table.Tables("inclusion")) {
    inclusions.push_back(ReadInclusion(each, phantom));
  }
  for (const TomlTable& each : table.Tables("strewn")) {
    const std::vector<Inclusion> spheres = ReadStrewn(each, phantom, layout);
    inclusions.insert(inclusions.end(), spheres.begin(), spheres.end());
  }
  if (inclusions.empty()) {
    throw table.At("inclusion",
                   "missing: what is in the slab, [[pattern.inclusion]] or "
                   "[[pattern.strewn]]");
  }
  table.RejectUnknownKeys();
  return {.pattern = {},
          .voxels = std::make_shared<Voxels>(
              PlaceInclusions(layout, phantom.media.size(), inclusions))};
}

// What numbers of a file mean: labels of media, or a place in their chain.
Structure FromNumbers(const TomlTable& table,
                      const Phantom& phantom,
                      const VoxelLayout& layout,
                      const VoxelNumbers& numbers) {
  const std::string meaning = table.Text("meaning", "labels");
  const std::string file_key = table.Has("file") ? "file" : "files";
  if (meaning == "labels") {
    Voxels voxels{layout, {}, PurePalette(phantom.media.size())};
    for (const double value : numbers.value) {
      if (!(value >= 0) || value != std::floor(value) ||
          value >= static_cast<double>(phantom.media.size())) {
        throw table.At(
            file_key,
            fmt::format("holds the label {}, but there are {} media, labelled "
                        "from 0; add [[medium]] or mend the file",
                        value,
                        phantom.media.size()));
      }
      voxels.label.push_back(static_cast<std::uint16_t>(value));
    }
    return {.pattern = {}, .voxels = std::make_shared<Voxels>(std::move(voxels))};
  }
  if (meaning != "mixture") {
    throw table.At(
        "meaning",
        fmt::format("'{}' is not known; known are: labels, mixture", meaning));
  }
  RequireMedia(table, phantom, 2, UINT16_MAX);
  for (const double value : numbers.value) {
    if (value < 0 || value > numbers.full_scale) {
      throw table.At(file_key,
                     fmt::format("holds {}, but mixtures go from 0 (the first medium) "
                                 "to {} (the last)",
                                 value,
                                 numbers.full_scale));
    }
  }
  const bool flat = layout.count[2] == 1 && layout.size_mm[0] == layout.size_mm[1];
  return Mixed(layout, phantom, flat, [&](double x, double y, double depth) {
    const auto index = [&](double from_corner, std::size_t axis) {
      return static_cast<int>(std::clamp(std::floor(from_corner / layout.size_mm[axis]),
                                         0.0,
                                         layout.count[axis] - 1.0));
    };
    const std::size_t at = layout.Index(
        index(x - layout.left_mm, 0), index(y - layout.lower_mm, 1), index(depth, 2));
    return numbers.value[at] / numbers.full_scale;
  });
}

VoxelLayout Centred(const std::array<int, 3>& count,
                    const std::array<double, 3>& size) {
  return {.count = count,
          .size_mm = size,
          .left_mm = -0.5 * count[0] * size[0],
          .lower_mm = -0.5 * count[1] * size[1]};
}

std::array<double, 3> ReadVoxelSize(const TomlTable& table) {
  const std::vector<double> size = table.Numbers("voxel_mm", kLengthMm);
  if (size.size() != 1 && size.size() != 3) {
    throw table.At("voxel_mm", "expected one number, or three, [x, y, depth]");
  }
  return {size.front(), size[size.size() / 2], size.back()};
}

Structure ReadVoxelFile(const TomlTable& table, const Phantom& phantom) {
  constexpr std::array kTypes = {RawType::kUint8, RawType::kUint16, RawType::kFloat32};
  const std::filesystem::path path = table.Folder() / table.Text("file");
  const std::array<double, 3> size = ReadVoxelSize(table);
  VoxelNumbers numbers;
  if (path.extension() == ".npy") {
    numbers = ReadNpyVoxels(path);
  } else {
    RawLayout raw;
    const std::array<double, 3> count = ReadTriple(table, "count", Range{1, 1e6});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (count[axis] != std::floor(count[axis])) {
        throw table.At("count", "expected three whole numbers, [x, y, depth]");
      }
      raw.count[axis] = static_cast<int>(count[axis]);
    }
    CheckSize(table, "count", {.count = raw.count});
    const std::string type = table.Text("data", "uint8");
    const auto* const at = std::find_if(
        kTypes.begin(), kTypes.end(), [&](RawType t) { return type == Name(t); });
    if (at == kTypes.end()) {
      throw table.At(
          "data",
          fmt::format("'{}' is not known; known are: uint8, uint16, float32", type));
    }
    raw.type = *at;
    raw.skip_bytes =
        static_cast<std::uint64_t>(table.Integer("skip_bytes", 0, Range{0, 1e9}));
    numbers = ReadRawVoxels(path, raw);
  }
  Structure structure =
      FromNumbers(table, phantom, Centred(numbers.count, size), numbers);
  table.RejectUnknownKeys();
  return structure;
}

Structure ReadImages(const TomlTable& table, const Phantom& phantom) {
  std::vector<std::string> names = table.Texts("files", {});
  if (names.empty()) {
    names = {table.Text("file")};
  }
  std::vector<std::filesystem::path> paths;
  paths.reserve(names.size());
  for (const std::string& name : names) {
    paths.push_back(table.Folder() / name);
  }
  const double pixel_mm = table.Number("pixel_mm", kLengthMm);
  // One picture holds at every depth.
  const double slice_mm =
      names.size() > 1 ? table.Number("slice_mm", kLengthMm) : pixel_mm;
  const VoxelNumbers numbers = ReadPictures(paths, table.Text("channel", ""));
  Structure structure = FromNumbers(
      table, phantom, Centred(numbers.count, {pixel_mm, pixel_mm, slice_mm}), numbers);
  table.RejectUnknownKeys();
  return structure;
}

Pattern ReadCells(const TomlTable& table, PatternType type) {
  Pattern pattern{.type = type, .cell_mm = table.Number("cell_mm", Range{1e-3, 1e6})};
  table.RejectUnknownKeys();
  return pattern;
}

}  // namespace

Structure ReadStructure(const TomlTable& table, const Phantom& phantom) {
  const std::string type = table.Text("type");
  if (type == "layers" || type == "homogeneous") {
    table.RejectUnknownKeys();
    return {};
  }
  if (type == "chessboard") {
    return {.pattern = ReadCells(table, PatternType::kChessboard)};
  }
  if (type == "stripes") {
    return {.pattern = ReadCells(table, PatternType::kStripes)};
  }
  if (type == "veins" || type == "onyx") {
    return ReadStone(table, phantom, type == "onyx");
  }
  if (type == "inclusions") {
    return ReadInclusions(table, phantom);
  }
  if (type == "voxels") {
    return ReadVoxelFile(table, phantom);
  }
  if (type == "images") {
    return ReadImages(table, phantom);
  }
  throw table.At("type",
                 fmt::format("'{}' is not known; known are: homogeneous, chessboard, "
                             "stripes, layers, veins, onyx, inclusions, voxels, images",
                             type));
}

}  // namespace nacre::rigs
