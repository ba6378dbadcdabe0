#pragma once

#include "render/scene.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

namespace nacre::render {

/// A scene with definitions "name=value" as from -D.
inline Scene ReadDefined(const std::string& path,
                         const std::vector<std::string>& defines) {
  SceneOptions options;
  for (const std::string& define : defines) {
    const std::size_t equals = define.find('=');
    options.defines[define.substr(0, equals)] = define.substr(equals + 1);
  }
  return ReadScene(path, options);
}

/// Parses a tool's command line and runs it; returns what main() returns.
template <class Run>
int RunTool(CLI::App& app, int argc, char** argv, const Run& run) {
  try {
    app.parse(argc, argv);
    run();
  } catch (const CLI::ParseError& e) {
    return app.exit(e);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", argv[0], e.what());
    return 1;
  }
  return 0;
}

}  // namespace nacre::render
