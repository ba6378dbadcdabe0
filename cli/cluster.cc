// nacre cluster: which points of a dataset look alike.

#include "cli/command_line.h"
#include "core/options_json.h"
#include "core/provenance.h"
#include "reconstruct/cluster_map.h"

#include <algorithm>
#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct ClusterArguments {
  std::filesystem::path file;
  std::filesystem::path out;
  reconstruct::ClusterOptions options{.clusters = 0};
};

int Run(const ClusterArguments& args, const Common& common) {
  reconstruct::ClusterOptions options = args.options;
  options.seed = common.seed;
  options.thread_count = common.thread_count;
  options.ranks = common.ranks;
  reconstruct::RdReader reader(args.file);
  const reconstruct::RdHeader header = reader.header();
  const reconstruct::Clustering found =
      reconstruct::ClusterSlices(reader, options, ConsoleProgress(common));

  if (!common.IsRoot()) {
    return 0;
  }
  Provenance provenance{.command = "cluster", .options = OptionsToJson(options)};
  provenance.options["seed"] = options.seed;
  provenance.AddInput(args.file);
  reconstruct::WriteClusterMap(args.out, header, found, provenance.ToString());
  std::filesystem::path picture = args.out;
  picture.replace_extension(".png");
  constexpr int kPictureSide = 512;
  const int scale =
      std::max(1, kPictureSide / std::max(header.points_x, header.points_y));
  WritePng(picture, reconstruct::PictureOfClusters(header, found, scale));

  std::vector<std::int64_t> sizes(static_cast<std::size_t>(found.cluster_count), 0);
  for (const std::uint8_t label : found.labels) {
    ++sizes[label];
  }
  Say(common, "a picture of it: " + picture.string());
  Print(common,
        Json{{"file", args.out.string()},
             {"picture", picture.string()},
             {"clusters", found.cluster_count},
             {"points", sizes},
             {"inertia", found.inertia},
             {"iterations", found.iterations_used},
             {"dimensions", found.dimensions_used}},
        fmt::format("{} clusters of {} points: {}",
                    found.cluster_count,
                    header.PointCount(),
                    args.out.string()));
  return 0;
}

}  // namespace

std::function<int()> MakeClusterVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<ClusterArguments>();
  app.add_option("file", args->file, "dataset, *.rd.exr")->required();
  app.add_option(
         "-o,--out", args->out, "map to write, *.exr; its picture lies beside it")
      ->required();
  AddOptions(app, args->options);
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
