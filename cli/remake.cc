#include "cli/remake.h"

#include "core/json.h"

#include <algorithm>
#include <fmt/format.h>
#include <map>

namespace nacre::cli {
namespace {

using Lines = std::vector<std::string>;

// Verbs whose result is their second word, not an option's value.
constexpr const char* kMesh = "mesh";
constexpr const char* kPresetMake = "preset make";

std::string Text(const Json& value) {
  if (value.is_number_float()) {
    return fmt::format("{}", value.get<double>());  // "3", where JSON says "3.0"
  }
  return value.is_string() ? value.get<std::string>() : value.dump();
}

// Values that stand for "not said", which the option itself wouldn't take, and what no
// command can choose.
bool IsUnset(const std::string& key, const Json& value) {
  if (key == "near_field") {
    return true;
  }
  const bool nothing =
      value.is_null() || (value.is_array() && value.empty()) ||
      (value.is_string() && value.get_ref<const std::string&>().empty());
  const bool zero = value.is_number() && value.get<double>() == 0;
  return nothing || (zero && (key == "photons" || key == "error"));
}

std::string Flag(const std::string& key) {
  static const std::map<std::string, std::string> others{{"define", "-D"},
                                                         {"beam_mm", "--beam"}};
  const auto other = others.find(key);
  if (other != others.end()) {
    return other->second;
  }
  std::string flag = "--" + key;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

// One option as words of the command line.
std::string Words(const std::string& verb, const std::string& key, const Json& value) {
  const std::string flag = Flag(key);
  if (value.is_boolean()) {
    const bool plain = (verb == "simulate" || key == "denoise");  // there is no --no-…
    return value.get<bool>() ? " " + flag : (plain ? "" : " --no-" + flag.substr(2));
  }
  if (key == "define") {
    std::string words;
    for (const Json& define : value) {
      words += " -D " + Quoted(Text(define));
    }
    return words;
  }
  if (value.is_array()) {
    std::string list;
    for (const Json& element : value) {
      list += (list.empty() ? "" : ",") + Text(element);
    }
    return " " + flag + " " + Quoted(list);
  }
  return " " + flag + " " + Quoted(Text(value));
}

class Remaker {
 public:
  // Adds the commands for `name`.
  void Add(const Json& provenance, const std::string& name) {
    const std::string verb =
        provenance.is_object() ? provenance.value("command", "") : "";
    if (verb.empty()) {
      lines_.push_back("# " + name + ": nothing is known of how it was made");
      return;
    }
    const std::vector<std::string> inputs = Inputs(provenance);
    std::string line = "nacre " + verb;
    if (!inputs.empty()) {
      line += " " + Quoted(inputs.front());
    }
    if (verb == kMesh) {
      line += " " + Quoted(name);
    }
    const Json options = provenance.value("options", Json::object());
    for (const auto& [key, value] : options.items()) {
      if (!IsUnset(key, value)) {
        line += Words(verb, key, value);
      }
    }
    for (std::size_t k = 1; k < inputs.size(); ++k) {
      if (verb == "report") {
        break;  // the folder holds them
      }
      if (inputs[k] == kCalibration) {
        line += " --calibration " + inputs[k];
      } else if (verb == "simulate") {
        line += " --photo " + Quoted(inputs[k]);
      } else if (verb == "factor") {
        line += " --reuse " + Quoted(inputs[k]);
      }
    }
    if (verb == kPresetMake) {
      line += " --out .";  // the library, in which the preset is a folder
    } else if (verb != kMesh) {
      line += " --out " + Quoted(name);
    }
    AddOnce(line);
  }

  Lines Take() && { return std::move(lines_); }

 private:
  static constexpr const char* kCalibration = "calibration.json";

  void Need(const std::string& what, const Json& input) {
    AddOnce(
        fmt::format("# needs {} (xxh3 {})", what, input.value("xxh3", "not recorded")));
  }

  // A dataset is an input of a material and of the one that this begins with.
  void AddOnce(const std::string& line) {
    if (std::find(lines_.begin(), lines_.end(), line) == lines_.end()) {
      lines_.push_back(line);
    }
  }

  // Their names, the first word of the command first; commands for those that carry
  // their own provenance.
  std::vector<std::string> Inputs(const Json& provenance) {
    std::vector<std::string> names;
    const Json inputs = provenance.value("inputs", Json::array());
    for (const Json& input : inputs) {
      if (input.contains("dataset")) {
        names.emplace_back("dataset.rd.exr");
        Add(input.at("dataset"), names.back());
      } else if (input.contains("material")) {
        const std::string made = fmt::format("made-{}.nacre.exr", ++made_count_);
        names.push_back(made);
        Add(input.at("material"), made);
      } else if (input.contains("calibration")) {
        names.emplace_back(kCalibration);
        Add(input.at("calibration"), names.back());
      } else if (input.contains("folder")) {
        names.push_back(input.value("folder", ""));
      } else if (input.contains("rig_xxh3")) {
        names.emplace_back("session");  // which reconstruction names by its two files
      } else if (input.value("file", "") == "session.json") {
        names.emplace_back("session");
        Need("session/session.json", input);
      } else if (input.value("file", "") == "journal") {
        Need("session/journal", input);
      } else {
        names.push_back(input.value("file", ""));
        Need(names.back(), input);
      }
    }
    return names;
  }

  Lines lines_;
  int made_count_ = 0;  // materials that others begin with
};

}  // namespace

std::string Quoted(const std::string& word) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=,:+@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
    return word;
  }
  std::string quoted = "'";
  for (const char c : word) {
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return quoted + "'";
}

std::vector<std::string> CommandsThatRemake(const Json& provenance,
                                            const std::string& name) {
  Remaker remaker;
  remaker.Add(provenance, name);
  return std::move(remaker).Take();
}

}  // namespace nacre::cli
