#include "cli/project.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/toml.h"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace nacre::cli {
namespace {

namespace fs = std::filesystem;

// One and the same file may be written in several ways: a/../b, ./b.
std::string Normal(const std::string& path) {
  std::string normal = fs::path(path).lexically_normal().string();
  while (normal.size() > 1 && normal.back() == '/') {
    normal.pop_back();
  }
  return normal;
}

std::vector<std::string> Normal(std::vector<std::string> paths) {
  for (std::string& path : paths) {
    path = Normal(path);
  }
  return paths;
}

void AddOnce(std::vector<std::string>& list, const std::string& word) {
  if (std::find(list.begin(), list.end(), word) == list.end()) {
    list.push_back(word);
  }
}

bool IsOutOption(const std::string& word) {
  return word == "--out" || word == "-o" || word == "--png";
}

// What the command says that it writes.
void FindOutputs(ProjectStage& stage) {
  for (std::size_t k = 1; k < stage.command.size(); ++k) {
    const std::string& word = stage.command[k];
    const std::size_t equals = word.find('=');
    if (IsOutOption(word) && k + 1 < stage.command.size()) {
      AddOnce(stage.writes, Normal(stage.command[k + 1]));
    } else if (equals != std::string::npos && IsOutOption(word.substr(0, equals))) {
      AddOnce(stage.writes, Normal(word.substr(equals + 1)));
    }
  }
}

using Writers = std::map<std::string, std::size_t>;  // a file: its stage

// The word, and what stands behind its '='.
std::vector<std::string> PathsIn(const std::string& word) {
  std::vector<std::string> paths{word};
  const std::size_t equals = word.find('=');
  if (equals != std::string::npos) {
    paths.push_back(word.substr(equals + 1));
  }
  return paths;
}

bool IsText(const fs::path& path) {
  return path.extension() == ".xml" || path.extension() == ".toml";
}

// What stands between quotes in a scene or a description: a file's name, perhaps.
std::vector<std::string> QuotedStrings(const fs::path& path) {
  constexpr std::uint64_t kMaxBytes = 64'000'000;  // as the reader of scenes
  const std::string text = ReadFile(path, kMaxBytes);
  std::vector<std::string> strings;
  std::size_t begin = text.find('"');
  while (begin != std::string::npos) {
    const std::size_t end = text.find('"', begin + 1);
    if (end == std::string::npos) {
      break;
    }
    strings.push_back(text.substr(begin + 1, end - begin - 1));
    begin = text.find('"', end + 1);
  }
  return strings;
}

// Files that a scene or a description among `stage.reads` names; their own folder is
// where such names start.
void FollowTexts(ProjectStage& stage, const Writers& writers, const fs::path& folder) {
  for (std::size_t k = 0; k < stage.reads.size(); ++k) {  // grows meanwhile
    const fs::path text = stage.reads[k];
    std::error_code none;
    if (!IsText(text) || !fs::is_regular_file(folder / text, none)) {
      continue;
    }
    for (const std::string& name : QuotedStrings(folder / text)) {
      const std::string path = Normal((text.parent_path() / name).string());
      if (writers.contains(path) || fs::is_regular_file(folder / path, none)) {
        AddOnce(stage.reads, path);
      }
    }
  }
}

// What it reads as far as its command names it.
void FindInputs(ProjectStage& stage, const Writers& writers, const fs::path& folder) {
  const std::set<std::string> own(stage.writes.begin(), stage.writes.end());
  for (std::size_t k = 1; k < stage.command.size(); ++k) {
    for (const std::string& word : PathsIn(stage.command[k])) {
      const std::string path = Normal(word);
      if (path.empty() || path.front() == '-' || own.contains(path)) {
        continue;
      }
      std::error_code none;
      if (writers.contains(path) || fs::exists(folder / path, none)) {
        AddOnce(stage.reads, path);
      }
    }
  }
}

Writers FindWriters(const std::vector<ProjectStage>& stages,
                    const std::vector<TomlTable>& tables) {
  Writers writers;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    for (const std::string& path : stages[k].writes) {
      const auto [other, is_new] = writers.emplace(path, k);
      if (!is_new) {
        throw tables[k].At("run",
                           fmt::format("'{}' is written by stage '{}' already",
                                       path,
                                       stages[other->second].name));
      }
    }
  }
  return writers;
}

// Depth first, in the order of the file, so that independent stages keep it.
class Sorter {
 public:
  Sorter(const std::vector<ProjectStage>& stages,
         const Writers& writers,
         const std::vector<TomlTable>& tables)
      : stages_(stages), writers_(writers), tables_(tables), states_(stages.size()) {}

  std::vector<ProjectStage> Sorted() {
    for (std::size_t k = 0; k < stages_.size(); ++k) {
      Visit(k);
    }
    return std::move(sorted_);
  }

 private:
  enum class State { kNew, kOpen, kDone };

  void Visit(std::size_t k) {
    if (states_[k] == State::kDone) {
      return;
    }
    if (states_[k] == State::kOpen) {
      throw tables_[k].At("run",
                          fmt::format("stage '{}' reads what is made from what it "
                                      "writes: a circle",
                                      stages_[k].name));
    }
    states_[k] = State::kOpen;
    for (const std::string& path : stages_[k].reads) {
      const auto writer = writers_.find(path);
      if (writer != writers_.end()) {
        Visit(writer->second);
      }
    }
    states_[k] = State::kDone;
    sorted_.push_back(stages_[k]);
  }

  const std::vector<ProjectStage>& stages_;
  const Writers& writers_;
  const std::vector<TomlTable>& tables_;
  std::vector<State> states_;
  std::vector<ProjectStage> sorted_;
};

ProjectStage ReadStage(const TomlTable& table) {
  ProjectStage stage;
  try {
    stage.command = SplitWords(table.Text("run"));
  } catch (const Error& e) {
    throw table.At("run", e.what());
  }
  if (!stage.command.empty() && stage.command.front() == "nacre") {
    stage.command.erase(stage.command.begin());
  }
  if (stage.command.empty()) {
    throw table.At("run", "no command");
  }
  stage.reads = Normal(table.Texts("reads", {}));
  stage.writes = Normal(table.Texts("writes", {}));
  FindOutputs(stage);
  if (stage.writes.empty()) {
    throw table.At("run",
                   "it writes nothing that is known: name a file by --out, or in "
                   "writes = [\"…\"]");
  }
  stage.name = table.Text("name", stage.writes.front());
  table.RejectUnknownKeys();
  return stage;
}

}  // namespace

std::vector<std::string> SplitWords(const std::string& line) {
  std::vector<std::string> words;
  std::optional<std::string> word;
  char quote = 0;
  for (const char c : line) {
    if (quote == c) {
      quote = 0;
    } else if (quote != 0) {
      word->push_back(c);
    } else if (c == '\'' || c == '"') {
      quote = c;
      word = word.value_or("");
    } else if (c == ' ' || c == '\t' || c == '\n') {
      if (word) {
        words.push_back(*std::exchange(word, std::nullopt));
      }
    } else {
      word = word.value_or("") + c;
    }
  }
  if (quote != 0) {
    throw UsageError(fmt::format("the quote {} isn't closed", quote));
  }
  if (word) {
    words.push_back(*word);
  }
  return words;
}

std::vector<ProjectStage> ReadProject(const fs::path& path) {
  const TomlTable file = TomlTable::FromFile(path);
  const std::vector<TomlTable> tables = file.Tables("stage");
  file.RejectUnknownKeys();
  if (tables.empty()) {
    throw BadData(path.string() + ": no [[stage]], of which a project is made");
  }
  std::vector<ProjectStage> stages;
  stages.reserve(tables.size());
  for (const TomlTable& table : tables) {
    stages.push_back(ReadStage(table));
  }
  const Writers writers = FindWriters(stages, tables);
  for (ProjectStage& stage : stages) {
    FindInputs(stage, writers, file.Folder());
    FollowTexts(stage, writers, file.Folder());
  }
  return Sorter(stages, writers, tables).Sorted();
}

}  // namespace nacre::cli
