// nacre edit: a dataset or a material changed by an artist's numbers.

#include "reconstruct/edit/edit.h"

#include "cli/command_line.h"
#include "cli/view/sample.h"
#include "core/error.h"
#include "core/png.h"
#include "core/provenance.h"
#ifdef NACRE_HAS_PRESETS
#include "cli/preset/preset.h"
#endif

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

using reconstruct::RdHeader;

struct EditArguments {
  std::filesystem::path file;
  std::filesystem::path out;
  std::vector<double> albedo;
  double range = 1;
  double shape = 1;
  std::filesystem::path mask;
  std::filesystem::path mix;
  double share = 0.5;
  int tile = 0;
};

// A picture's grey in [0, 1] at every grid point; all 1 without a picture. PNG values
// count as they are, without gamma.
std::vector<float> ReadMask(const std::filesystem::path& path, const RdHeader& header) {
  std::vector<float> mask(static_cast<std::size_t>(header.PointCount()), 1.0f);
  if (path.empty()) {
    return mask;
  }
  const PngImage image = ReadPng(path);
  const double full = std::exp2(image.bit_depth) - 1;
  for (int j = 0; j < header.points_y; ++j) {
    for (int i = 0; i < header.points_x; ++i) {
      // The mean of the pixels that a grid cell covers, at least one.
      const auto range = [](int k, int points, int pixels) {
        const int begin = static_cast<int>(std::int64_t{k} * pixels / points);
        const int end = static_cast<int>((std::int64_t{k} + 1) * pixels / points);
        return std::pair(begin, std::max(begin + 1, end));
      };
      const auto [left, right] = range(i, header.points_x, image.width);
      const auto [top, bottom] = range(j, header.points_y, image.height);
      double sum = 0;
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) {
          sum += image.values[static_cast<std::size_t>(
              (std::int64_t{y} * image.width + x) * image.channel_count)];
        }
      }
      mask[static_cast<std::size_t>(std::int64_t{j} * header.points_x + i)] =
          static_cast<float>(sum / full / ((right - left) * (bottom - top)));
    }
  }
  return mask;
}

// factor^mask: the factor where the mask is 1, nothing where it is 0.
std::vector<float> Powers(double factor, const std::vector<float>& mask) {
  std::vector<float> powers;
  powers.reserve(mask.size());
  for (const float m : mask) {
    powers.push_back(static_cast<float>(std::pow(factor, static_cast<double>(m))));
  }
  return powers;
}

reconstruct::SliceSource SourceOf(const view::Sample& sample) {
  return {sample.header(), [&sample](int i, int j) { return sample.Slice(i, j, 0); }};
}

reconstruct::Edit MakeEdit(const EditArguments& arguments,
                           const RdHeader& header,
                           const reconstruct::SliceSource* other) {
  const std::vector<float> mask = ReadMask(arguments.mask, header);
  reconstruct::Edit edit{.tile_overlap = arguments.tile};
  if (!arguments.albedo.empty()) {
    if (arguments.albedo.size() != 1 &&
        arguments.albedo.size() != header.channels.size()) {
      throw UsageError(
          fmt::format("--albedo: {} numbers for {} channels; one, or one a channel",
                      arguments.albedo.size(),
                      header.channels.size()));
    }
    for (std::size_t c = 0; c < header.channels.size(); ++c) {
      edit.albedo.push_back(
          Powers(arguments.albedo[arguments.albedo.size() == 1 ? 0 : c], mask));
    }
  }
  if (arguments.range != 1) {
    edit.range = Powers(arguments.range, mask);
  }
  if (arguments.shape != 1) {
    edit.shape = Powers(arguments.shape, mask);
  }
  if (other != nullptr) {
    edit.other = other;
    for (const float m : mask) {
      edit.mix.push_back(static_cast<float>(arguments.share) * m);
    }
  }
  return edit;
}

std::string EditProvenance(const EditArguments& arguments) {
  Provenance provenance{.command = "edit",
                        .options = {{"albedo", arguments.albedo},
                                    {"range", arguments.range},
                                    {"shape", arguments.shape},
                                    {"share", arguments.share},
                                    {"tile", arguments.tile},
                                    {"mix", arguments.mix.filename().string()},
                                    {"mask", arguments.mask.filename().string()}}};
  for (const std::filesystem::path& input :
       {arguments.file, arguments.mix, arguments.mask}) {
    if (!input.empty()) {
      provenance.AddInput(input);
    }
  }
  return provenance.ToString();
}

int Run(EditArguments& arguments, const Common& common) {
#ifdef NACRE_HAS_PRESETS
  arguments.file = preset::MaterialPath(arguments.file);
  if (!arguments.mix.empty()) {
    arguments.mix = preset::MaterialPath(arguments.mix);
  }
#endif
  const ProgressFunction progress = ConsoleProgress(common);
  const auto sample = view::OpenSample(arguments.file, progress);
  const reconstruct::SliceSource source = SourceOf(*sample);
  std::unique_ptr<view::Sample> second;
  reconstruct::SliceSource other;
  if (!arguments.mix.empty()) {
    second = view::OpenSample(arguments.mix, progress);
    other = SourceOf(*second);
  }
  const reconstruct::EditSummary summary = reconstruct::WriteEdited(
      source,
      MakeEdit(arguments, source.header, second ? &other : nullptr),
      EditProvenance(arguments),
      arguments.out,
      progress);
  std::string text = fmt::format(
      "{}: {} x {} points", arguments.out.string(), summary.points_x, summary.points_y);
  if (summary.bounded > 0) {
    text += fmt::format(
        "\n  {} slices and channels would have given more light than came in (up to "
        "{:.3g} "
        "times); they and what they share with others were scaled down",
        summary.bounded,
        summary.largest_total);
  }
  Print(common,
        {{"out", arguments.out.string()},
         {"points", {summary.points_x, summary.points_y}},
         {"largest_total", summary.largest_total},
         {"bounded", summary.bounded}},
        text);
  return 0;
}

}  // namespace

std::function<int()> MakeEditVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<EditArguments>();
  app.add_option("file", arguments->file, "a dataset, a material or a preset")
      ->required();
  app.add_option("-o,--out", arguments->out, "dataset to write, *.rd.exr")->required();
  app.add_option("--albedo",
                 arguments->albedo,
                 "factor on the light that comes out, one or one a channel")
      ->delimiter(',')
      ->check(CLI::Range(1e-3, 1e3));
  app.add_option("--range", arguments->range, "factor on how far light goes")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 10.0));
  app.add_option("--shape",
                 arguments->shape,
                 "power of the profile at the same albedo: above 1 sharper")
      ->capture_default_str()
      ->check(CLI::Range(0.2, 5.0));
  app.add_option("--mask",
                 arguments->mask,
                 "PNG over the sample, linear: black is left as it is, white edited in "
                 "full");
  app.add_option("--mix", arguments->mix, "a second sample on the same grid, mixed in");
  app.add_option("--share", arguments->share, "of the second sample")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--tile",
                 arguments->tile,
                 "points over which opposite borders are blended, so that the sample "
                 "repeats without a seam; 0: not at all")
      ->capture_default_str()
      ->check(CLI::Range(0, 10000));
  return [arguments, &common] { return Run(*arguments, common); };
}

}  // namespace nacre::cli
