// nacre compare: error figures between two files of the same kind.

#include "cli/artefact.h"
#include "cli/command_line.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/png.h"
#include "factor/material.h"
#include "reconstruct/error_figures.h"

#include <memory>

namespace nacre::cli {
namespace {

using reconstruct::ErrorFigures;
using reconstruct::RdHeader;
using reconstruct::RdSlice;
using reconstruct::SliceSource;

struct CompareArguments {
  std::filesystem::path a;
  std::filesystem::path b;
};

SliceSource MaterialSource(const std::filesystem::path& path) {
  const auto material = std::make_shared<factor::Material>(factor::ReadMaterial(path));
  SliceSource source;
  source.header = RdHeader{.points_x = material->points_x,
                           .points_y = material->points_y,
                           .core = material->core,
                           .pitch_mm = material->pitch_mm,
                           .eta = material->eta,
                           .channels = material->channels,
                           .provenance = material->provenance};
  const RdHeader header = source.header;
  source.slice = [material, header](int i, int j) {
    RdSlice slice = reconstruct::MakeSlice(header);
    for (int c = 0; c < static_cast<int>(header.channels.size()); ++c) {
      material->EvaluateWindow(
          c, i, j, &slice.rd[static_cast<std::size_t>(c * header.WindowSize())]);
    }
    return slice;
  };
  return source;
}

// A picture compares as a dataset of one window-less grid: each pixel is a slice of
// one cell. What is said about worst slices is then about pixels.
SliceSource PictureSource(ExrPart part) {
  SliceSource source;
  source.header = RdHeader{.points_x = part.width,
                           .points_y = part.height,
                           .core = 1,
                           .pitch_mm = 1,
                           .eta = 1,
                           .channels = part.channels,
                           .provenance = {}};
  const auto shared = std::make_shared<const ExrPart>(std::move(part));
  source.slice = [shared](int i, int j) {
    RdSlice slice;
    const auto pixel =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(shared->width) +
        static_cast<std::size_t>(i);
    for (std::size_t c = 0; c < shared->channels.size(); ++c) {
      const float value = shared->Channel(c)[pixel];
      slice.valid.push_back(std::isfinite(value) ? 1 : 0);
      slice.rd.push_back(std::isfinite(value) ? value : 0.0F);
    }
    slice.sigma.assign(slice.rd.size(), 0.0F);
    return slice;
  };
  return source;
}

// PNG values are linearised from sRGB, so that figures mean the same for both kinds.
ExrPart ReadPngLinear(const std::filesystem::path& path) {
  const PngImage image = ReadPng(path);
  ExrPart part;
  part.width = image.width;
  part.height = image.height;
  part.channels = image.channel_count >= 3 ? std::vector<std::string>{"R", "G", "B"}
                                           : std::vector<std::string>{"Y"};
  const float full = image.bit_depth == 16 ? 65535.0F : 255.0F;
  const auto stride = static_cast<std::size_t>(image.channel_count);
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    for (std::size_t p = 0; p < part.PixelCount(); ++p) {
      part.values.push_back(
          LinearFromSrgb(static_cast<float>(image.values[p * stride + c]) / full));
    }
  }
  return part;
}

// Colour without opacity: renders come with and without an A channel.
ExrPart ReadExrColour(const std::filesystem::path& path) {
  ExrPart part = std::move(ReadExr(path).at(0));
  if (part.channels.size() > 1 && part.channels.back() == "A") {
    part.channels.pop_back();
    part.values.resize(part.channels.size() * part.PixelCount());
  }
  return part;
}

bool IsPicture(ArtefactKind kind) {
  return kind == ArtefactKind::kExrPicture || kind == ArtefactKind::kPngPicture;
}

SliceSource Open(const std::filesystem::path& path, ArtefactKind kind) {
  switch (kind) {
    case ArtefactKind::kDataset:
      return reconstruct::DatasetSource(path);
    case ArtefactKind::kMaterial:
      return MaterialSource(path);
    case ArtefactKind::kExrPicture:
      return PictureSource(ReadExrColour(path));
    case ArtefactKind::kPngPicture:
      return PictureSource(ReadPngLinear(path));
    default:
      throw UsageError(fmt::format(
          "{}: is of kind '{}'; datasets, materials and pictures (.exr, .png) can be "
          "compared",
          path.string(),
          Name(kind)));
  }
}

int Run(const CompareArguments& args, const Common& common) {
  const ArtefactKind a = DetectKind(args.a);
  const ArtefactKind b = DetectKind(args.b);
  const SliceSource source_a = Open(args.a, a);
  const SliceSource source_b = Open(args.b, b);
  if (IsPicture(a) != IsPicture(b)) {
    throw UsageError(fmt::format("cannot compare {} ({}) with {} ({})",
                                 args.a.string(),
                                 Name(a),
                                 args.b.string(),
                                 Name(b)));
  }
  const ErrorFigures figures =
      reconstruct::CompareSlices(source_a, source_b, ConsoleProgress(common));
  Json json{{"a", args.a.string()}, {"b", args.b.string()}, {"kind", Name(a)}};
  json.update(figures.ToJson());
  Print(common, json, figures.ToString(IsPicture(a) ? "" : "mm^-2"));
  return 0;
}

}  // namespace

std::function<int()> MakeCompareVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<CompareArguments>();
  app.add_option("a", args->a, "the reference: dataset, material or picture")
      ->required();
  app.add_option("b", args->b, "what is compared with it")->required();
  app.footer(
      "Figures are over values valid in both. The peak is the reference's largest "
      "value.");
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
