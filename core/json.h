#pragma once

#include "core/error.h"
#include "core/json_fwd.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace nacre {

/// Reads a whole JSON file. Throws BadData with `path:line:` where it isn't JSON.
Json ReadJson(const std::filesystem::path& path);

/// Writes atomically, indented, with a final newline.
void WriteJson(const std::filesystem::path& path, const Json& json);

/// Parses text that came from `origin`. Throws BadData with `origin:line:`.
Json ParseJson(const std::string& text, const std::string& origin);

/// The value at `key`, or BadData naming `origin`, key and the expected type.
template <class T>
T Get(const Json& json, const char* key, const std::string& origin);

template <class T>
T Get(const Json& json, const char* key, const std::string& origin) {
  if (!json.is_object() || !json.contains(key)) {
    throw BadData(origin + ": no field '" + key + "'");
  }
  try {
    return json.at(key).get<T>();
  } catch (const nlohmann::json::exception& e) {
    throw BadData(origin + ": field '" + key + "': " + e.what());
  }
}

}  // namespace nacre
