#include "rigs/phantom.h"

#include "core/error.h"
#include "core/toml.h"
#include "rigs/phantom_media.h"
#include "rigs/phantom_structure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <optional>
#include <span>

namespace nacre::rigs {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Range kThicknessMm{1e-6, kInfinity};
constexpr Range kEta{1, 4};

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

// What [slab] says; layers may know their thickness and η themselves.
struct SlabText {
  std::optional<double> thickness_mm;
  std::optional<double> eta;
  Bottom bottom = Bottom::kAir;
};

SlabText ReadSlab(const TomlTable& table, bool is_layered, bool is_skin) {
  constexpr std::array kBottoms = {
      Bottom::kAir, Bottom::kMatched, Bottom::kBlack, Bottom::kWhite};
  SlabText slab;
  if (!is_layered || table.Has("thickness_mm")) {
    slab.thickness_mm = table.Number("thickness_mm", kThicknessMm);
  }
  if (!is_skin && table.Has("eta")) {
    slab.eta = table.Number("eta", kEta);
  }
  slab.bottom = Choose<Bottom>(table, "bottom", table.Text("bottom", "air"), kBottoms);
  table.RejectUnknownKeys();
  return slab;
}

std::size_t MediumOf(const TomlTable& layer, const std::vector<Medium>& media) {
  const std::string name = layer.Text("medium");
  const auto at = std::find_if(
      media.begin(), media.end(), [&](const Medium& m) { return m.name == name; });
  if (at == media.end()) {
    throw layer.At("medium",
                   fmt::format("'{}' is not the name of one of the media", name));
  }
  return static_cast<std::size_t>(at - media.begin());
}

// [[layer]], from the top. The last one's thickness may be what is left of the slab.
std::vector<SlabLayer> ReadLayers(const TomlTable& root,
                                  const SlabText& slab,
                                  const PhantomMedia& substances) {
  constexpr std::size_t kMostLayers = 1000;
  const std::vector<TomlTable> tables = root.Tables("layer");
  if (tables.empty() || tables.size() > kMostLayers) {
    throw root.At("layer",
                  fmt::format("{} given; 1 to {} can be", tables.size(), kMostLayers));
  }
  std::vector<SlabLayer> layers;
  double depth_mm = 0;
  for (const TomlTable& table : tables) {
    SlabLayer layer{.medium = MediumOf(table, substances.media)};
    layer.eta = slab.eta && !table.Has("eta") ? *slab.eta : table.Number("eta", kEta);
    const bool is_last = layers.size() + 1 == tables.size();
    if (is_last && slab.thickness_mm && !table.Has("thickness_mm")) {
      layer.thickness_mm = *slab.thickness_mm - depth_mm;
    } else {
      layer.thickness_mm = table.Number("thickness_mm", kThicknessMm);
    }
    if (!(layer.thickness_mm > 0) || (std::isinf(layer.thickness_mm) && !is_last)) {
      throw table.At(
          "thickness_mm",
          fmt::format(
              "{} mm for the layer below {} mm; it must be above 0, and only the "
              "last one's may be infinite",
              layer.thickness_mm,
              depth_mm));
    }
    table.RejectUnknownKeys();
    depth_mm += layer.thickness_mm;
    layers.push_back(layer);
  }
  if (slab.thickness_mm && depth_mm != *slab.thickness_mm &&
      !(std::abs(depth_mm - *slab.thickness_mm) <= 1e-9 * depth_mm)) {
    throw root.At("layer",
                  fmt::format("the layers are {} mm thick together, but "
                              "slab.thickness_mm is {}; leave one of them out",
                              depth_mm,
                              *slab.thickness_mm));
  }
  return layers;
}

std::vector<SlabLayer> SkinLayers(const TomlTable& root,
                                  const SlabText& slab,
                                  std::vector<SlabLayer> layers) {
  if (slab.thickness_mm) {
    layers.back().thickness_mm = *slab.thickness_mm - layers.front().thickness_mm;
  }
  if (!(layers.back().thickness_mm > 0)) {
    throw root.At(
        "skin",
        fmt::format("slab.thickness_mm is {}, which leaves no dermis under {} "
                    "mm of epidermis",
                    *slab.thickness_mm,
                    layers.front().thickness_mm));
  }
  return layers;
}

void SetSlab(const TomlTable& root, const PhantomMedia& substances, Phantom& phantom) {
  const bool is_skin = !substances.layers.empty();
  if (is_skin && root.Has("layer")) {
    throw root.At("layer", "given beside [skin], which has layers of its own");
  }
  const bool is_layered = is_skin || root.Has("layer");
  const TomlTable table = root.Table("slab");
  SlabText slab = ReadSlab(table, is_layered, is_skin);
  if (!slab.eta) {
    slab.eta = substances.eta;
  }
  if (is_skin) {
    phantom.layers = SkinLayers(root, slab, substances.layers);
  } else if (is_layered) {
    phantom.layers = ReadLayers(root, slab, substances);
  }
  phantom.slab.bottom = slab.bottom;
  if (!is_layered) {
    phantom.slab.thickness_mm = *slab.thickness_mm;
    phantom.slab.eta = slab.eta ? *slab.eta : table.Number("eta", kEta);
    return;
  }
  phantom.slab.eta = phantom.layers.front().eta;
  for (const SlabLayer& layer : phantom.layers) {
    phantom.slab.thickness_mm += layer.thickness_mm;
  }
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

// That the media are as many as their arrangement is made of, and in one arrangement.
void CheckArrangement(const TomlTable& root, const Phantom& phantom) {
  const bool patterned =
      phantom.voxels != nullptr || phantom.pattern.type != PatternType::kHomogeneous;
  if (!phantom.layers.empty()) {
    if (patterned) {
      throw root.At("pattern",
                    "given for a slab of layers, each of which is of one medium; write "
                    "such a slab as voxels");
    }
    return;
  }
  const auto pattern = root.FindTable("pattern");
  if (pattern && pattern->Text("type") == "layers") {
    throw pattern->At("type", "'layers' given, but there is no [[layer]]");
  }
  if (phantom.voxels == nullptr &&
      static_cast<int>(phantom.media.size()) != phantom.pattern.MediumCount()) {
    throw root.At("medium",
                  fmt::format("{} given, but the pattern '{}' is made of {}",
                              phantom.media.size(),
                              Name(phantom.pattern.type),
                              phantom.pattern.MediumCount()));
  }
}

Phantom FromTable(const TomlTable& root) {
  const PhantomMedia substances = ReadPhantomMedia(root);
  Phantom phantom;
  phantom.channels = substances.channels;
  phantom.media = substances.media;
  SetSlab(root, substances, phantom);
  if (const auto beam = root.FindTable("beam")) {
    phantom.beam = ReadBeam(*beam);
  }
  if (const auto grid = root.FindTable("grid")) {
    phantom.grid = ReadGrid(*grid);
  }
  if (const auto pattern = root.FindTable("pattern")) {
    Structure structure = ReadStructure(*pattern, phantom);
    phantom.pattern = std::move(structure.pattern);
    phantom.voxels = std::move(structure.voxels);
  }
  CheckArrangement(root, phantom);
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

void RequirePlanePattern(const Phantom& phantom, const std::string& solver) {
  const char* const what = !phantom.layers.empty()     ? "a slab of layers"
                           : phantom.voxels != nullptr ? "media that change with depth "
                                                         "or are more than two (voxels)"
                                                       : nullptr;
  if (what != nullptr) {
    throw BadData(solver + " can't do " + what +
                  ": use Monte Carlo, --solver mc, which can");
  }
}

Phantom ReadPhantom(const std::filesystem::path& path) {
  return FromTable(TomlTable::FromFile(path));
}

Phantom ParsePhantom(const std::string& text, const std::string& origin) {
  return FromTable(TomlTable::FromText(text, origin));
}

}  // namespace nacre::rigs
