// nacre mesh: a scan to a mesh that a material fits on.

#include "cli/command_line.h"
#include "core/options_json.h"
#include "core/provenance.h"
#include "render/mesh_file.h"
#include "render/mesh_prepare.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct MeshArguments {
  std::filesystem::path in;
  std::filesystem::path out;
  render::MeshPrepareOptions options;
};

int Run(const MeshArguments& arguments, const Common& common) {
  render::TriangleMesh mesh = render::ReadMeshFile(arguments.in);
  const render::MeshPrepareSummary summary =
      render::PrepareMesh(mesh, arguments.options);
  Provenance provenance{"mesh", OptionsToJson(arguments.options), {}};
  provenance.AddInput(arguments.in);
  render::WritePly(
      arguments.out, mesh, ParseJson(provenance.ToString(), "provenance").dump());
  Json json = summary.ToJson();
  json["out"] = arguments.out.string();
  Print(common, json, arguments.out.string() + ": " + summary.Brief());
  return 0;
}

}  // namespace

std::function<int()> MakeMeshVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<MeshArguments>();
  app.add_option("in", arguments->in, "a mesh: .ply, .obj or .off, or one as .gz")
      ->required();
  app.add_option("out", arguments->out, "binary PLY")->required();
  AddOptions(app, arguments->options);
  return [arguments, &common] { return Run(*arguments, common); };
}

}  // namespace nacre::cli
