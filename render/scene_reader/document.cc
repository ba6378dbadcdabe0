#include "render/scene_reader/document.h"

#include "render/scene_reader/words.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

namespace nacre::render {
namespace {

bool IsWithin(const std::filesystem::path& path, const std::filesystem::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
         folder.end();
}

}  // namespace

std::string Document::Where(const pugi::xml_node& node) const {
  const std::ptrdiff_t offset =
      std::clamp<std::ptrdiff_t>(node.offset_debug(), 0, std::ssize(text));
  const auto line = 1 + std::count(text.begin(), text.begin() + offset, '\n');
  return fmt::format("{}:{}", origin, line);
}

Error Document::ErrorAt(const pugi::xml_node& node, const std::string& message) const {
  return BadData(Where(node) + ": " + message);
}

void Document::Unknown(const pugi::xml_node& node, const std::string& message) {
  if (!lenient) {
    throw ErrorAt(node, message);
  }
  Note(node, message + " (left out)");
}

void Document::Note(const pugi::xml_node& node, const std::string& message) {
  scene.notes.push_back(Where(node) + ": " + message);
}

std::string Document::Attribute(const pugi::xml_node& node, const char* name) const {
  const std::string raw = node.attribute(name).as_string();
  std::string value;
  for (std::size_t i = 0; i < raw.size();) {
    if (raw[i] != '$') {
      value += raw[i++];
      continue;
    }
    std::size_t end = i + 1;
    while (
        end < raw.size() &&
        (std::isalnum(static_cast<unsigned char>(raw[end])) != 0 || raw[end] == '_')) {
      ++end;
    }
    const std::string key = raw.substr(i + 1, end - i - 1);
    const auto found = defines.find(key);
    if (found == defines.end()) {
      std::vector<std::string> known;
      for (const auto& define : defines) {
        known.push_back(define.first);
      }
      throw ErrorAt(node,
                    fmt::format("${} has no value: give -D {}=… or a <default> "
                                "above{}",
                                key,
                                key,
                                Suggestion(key, known)));
    }
    value += found->second;
    i = end;
  }
  return value;
}

std::string Document::RequiredAttribute(const pugi::xml_node& node,
                                        const char* name) const {
  if (!node.attribute(name)) {
    throw ErrorAt(node,
                  fmt::format("<{}> needs the attribute '{}'", node.name(), name));
  }
  return Attribute(node, name);
}

std::filesystem::path Document::File(const pugi::xml_node& node,
                                     const std::string& name) {
  std::filesystem::path path = folder / name;
  CheckAllowed(node, path);
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) {
    throw ErrorAt(
        node,
        fmt::format("no file '{}'; paths start at the scene's folder", path.string()));
  }
  scene.files.push_back(path);
  return path;
}

void Document::CheckAllowed(const pugi::xml_node& node,
                            const std::filesystem::path& path) const {
  const std::filesystem::path real = std::filesystem::weakly_canonical(path);
  const auto holds = [&](const std::filesystem::path& place) {
    return IsWithin(real, place);
  };
  if (allowed && std::none_of(allowed->begin(), allowed->end(), holds)) {
    throw ErrorAt(node,
                  fmt::format("'{}' isn't in the scene's folder; if the scene may read "
                              "files elsewhere: --allow-outside",
                              path.string()));
  }
}

std::vector<double> ParseNumbers(const Document& document,
                                 const pugi::xml_node& node,
                                 const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto separator = [](char c) {
    return c == ',' || std::isspace(static_cast<unsigned char>(c)) != 0;
  };
  for (;;) {
    while (at != end && separator(*at)) {
      ++at;
    }
    if (at == end) {
      return numbers;
    }
    const char* const word = at;
    if (*at == '+' && at + 1 != end && at[1] != '-') {
      ++at;
    }
    double value = 0;
    const auto [stop, failure] = std::from_chars(at, end, value);
    if (failure != std::errc() || (stop != end && !separator(*stop)) ||
        !std::isfinite(value) ||
        std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) {
      const char* const word_end = std::find_if(word, end, separator);
      throw document.ErrorAt(
          node, fmt::format("'{}' isn't a finite number", std::string(word, word_end)));
    }
    numbers.push_back(value);
    at = stop;
  }
}

double ParseNumber(const Document& document,
                   const pugi::xml_node& node,
                   const std::string& text) {
  const std::vector<double> numbers = ParseNumbers(document, node, text);
  if (numbers.size() != 1) {
    throw document.ErrorAt(node, fmt::format("'{}' isn't one number", text));
  }
  return numbers.front();
}

}  // namespace nacre::render
