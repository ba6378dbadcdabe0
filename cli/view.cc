// nacre view: a file on a local web page, to click at.

#include "cli/view/view.h"

#include "cli/command_line.h"

#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <thread>

namespace nacre::cli {
namespace {

struct ViewArguments {
  std::filesystem::path path;
  std::filesystem::path against;
  int port = 0;
  double time_limit = 0;
};

int Run(const ViewArguments& arguments, const Common& common) {
  const web::LocalServer server(
      arguments.port,
      view::OpenView(arguments.path, arguments.against, ConsoleProgress(common)),
      "view: choose another --port");
  Print(common, {{"url", server.url()}}, server.url());
  common.out->flush();
  Say(common, "Open it in a browser of this machine; Ctrl-C ends it.");
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::duration<double>(arguments.time_limit);
  while (!InterruptRequested() &&
         (arguments.time_limit <= 0 || std::chrono::steady_clock::now() < end)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return 0;
}

}  // namespace

std::function<int()> MakeViewVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<ViewArguments>();
  app.add_option(
         "path",
         arguments->path,
         "a dataset, a material, a preset (folder or name) or a session's folder")
      ->required();
  app.add_option("--against",
                 arguments->against,
                 "a dataset or material of the same grid, to compare slices with");
  app.add_option("--port", arguments->port, "of the page; 0: any free one")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  app.add_option(
         "--time-limit", arguments->time_limit, "seconds that it serves; 0: no limit")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e7));
  return [arguments, &common] { return Run(*arguments, common); };
}

}  // namespace nacre::cli
