#pragma once

#include "cli/project.h"
#include "core/json.h"

#include <filesystem>
#include <map>
#include <string>

namespace nacre::cli {

/// What the last runs of a project made, in a file beside it: `.NAME.run.json`. A
/// stage is up to date if its command, the software's version and the hashes of what it
/// read and wrote are what they were when it last ended well.
class ProjectState {
 public:
  /// `project` is its TOML file. Nothing recorded yet is fine; a file that isn't ours
  /// is BadData.
  explicit ProjectState(const std::filesystem::path& project);

  /// Why the stage has to run, in a few words; empty if it is up to date. To be asked
  /// after the stages before it have run.
  std::string WhyToRun(const ProjectStage& stage);

  /// The stage begins: what it wrote before counts no longer. Written at once.
  void Begin(const ProjectStage& stage);
  /// True if it has begun with this very command and these inputs, and didn't end.
  bool WasInterrupted(const ProjectStage& stage);
  /// The stage has ended well. Written at once.
  void End(const ProjectStage& stage);

 private:
  Json InputsOf(const ProjectStage& stage);
  std::string HashOf(const std::string& path);

  std::filesystem::path file_;
  std::filesystem::path folder_;
  Json stages_ = Json::object();
  std::map<std::string, std::string> hashes_;  // of files that no stage has rewritten
};

/// Of a file its content; of a capture's session its description and journal, which
/// holds the hash of every picture; of any other folder all files in it.
std::string HashOfFileOrFolder(const std::filesystem::path& path);

}  // namespace nacre::cli
