#include "cli/project_state.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/version.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOrigin = "the project's state";

std::vector<fs::path> FilesIn(const fs::path& folder) {
  if (fs::exists(folder / "session.json")) {
    return {folder / "session.json", folder / "journal"};
  }
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

std::string HashOfFileOrFolder(const fs::path& path) {
  if (!fs::is_directory(path)) {
    return HashFile(path);
  }
  std::string list;
  for (const fs::path& file : FilesIn(path)) {
    list += file.lexically_relative(path).string() + '\n' + HashFile(file) + '\n';
  }
  return HashHex(list.data(), list.size());
}

ProjectState::ProjectState(const fs::path& project) : folder_(project.parent_path()) {
  file_ = folder_ / ("." + project.stem().string() + ".run.json");
  if (fs::exists(file_)) {
    stages_ = Get<Json>(ReadJson(file_), "stages", file_.string());
  }
}

std::string ProjectState::HashOf(const std::string& path) {
  std::string& hash = hashes_[path];
  if (hash.empty()) {
    hash = HashOfFileOrFolder(folder_ / path);
  }
  return hash;
}

Json ProjectState::InputsOf(const ProjectStage& stage) {
  Json inputs = Json::object();
  for (const std::string& path : stage.reads) {
    if (!fs::exists(folder_ / path)) {
      throw Error(fmt::format("stage '{}' reads {}, which isn't there",
                              stage.name,
                              (folder_ / path).string()));
    }
    inputs[path] = HashOf(path);
  }
  return inputs;
}

std::string ProjectState::WhyToRun(const ProjectStage& stage) {
  const Json inputs = InputsOf(stage);
  if (!stages_.contains(stage.name)) {
    return "it never ran";
  }
  const Json& last = stages_.at(stage.name);
  if (Get<Json>(last, "command", kOrigin) != stage.command) {
    return "its command changed";
  }
  if (Get<std::string>(last, "version", kOrigin) != Version()) {
    return "the software's version changed";
  }
  const Json last_inputs = Get<Json>(last, "inputs", kOrigin);
  for (const auto& [path, hash] : inputs.items()) {
    if (last_inputs.value(path, "") != hash) {
      return path + " changed";
    }
  }
  if (last_inputs.size() != inputs.size()) {
    return "it reads other files";
  }
  const Json outputs = last.value("outputs", Json::object());
  for (const std::string& path : stage.writes) {
    if (!outputs.contains(path)) {
      return "it didn't end";
    }
    if (!fs::exists(folder_ / path)) {
      return path + " is gone";
    }
    if (outputs.at(path) != HashOf(path)) {
      return path + " isn't what it wrote";
    }
  }
  return "";
}

void ProjectState::Begin(const ProjectStage& stage) {
  stages_[stage.name] = {
      {"command", stage.command}, {"version", Version()}, {"inputs", InputsOf(stage)}};
  for (const std::string& path : stage.writes) {
    hashes_.erase(path);
  }
  WriteJson(file_, {{"stages", stages_}});
}

bool ProjectState::WasInterrupted(const ProjectStage& stage) {
  if (!stages_.contains(stage.name)) {
    return false;
  }
  const Json& last = stages_.at(stage.name);
  return !last.contains("outputs") &&
         Get<Json>(last, "command", kOrigin) == stage.command &&
         Get<Json>(last, "inputs", kOrigin) == InputsOf(stage);
}

void ProjectState::End(const ProjectStage& stage) {
  Json outputs = Json::object();
  for (const std::string& path : stage.writes) {
    if (!fs::exists(folder_ / path)) {
      throw Error(
          fmt::format("stage '{}' didn't write {}, which it was to", stage.name, path));
    }
    outputs[path] = HashOf(path);
  }
  stages_[stage.name]["outputs"] = outputs;
  WriteJson(file_, {{"stages", stages_}});
}

}  // namespace nacre::cli
