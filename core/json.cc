#include "core/json.h"

#include "core/atomic_file.h"
#include "core/error.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre {

Json ParseJson(const std::string& text, const std::string& origin) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& e) {
    const auto end =
        text.begin() + static_cast<std::ptrdiff_t>(std::min(e.byte, text.size()));
    throw BadData(fmt::format("{}:{}: not valid JSON: {}",
                              origin,
                              1 + std::count(text.begin(), end, '\n'),
                              e.what()));
  } catch (const Json::out_of_range& e) {  // a number that no double can hold
    throw BadData(fmt::format("{}: not valid JSON: {}", origin, e.what()));
  }
}

Json ReadJson(const std::filesystem::path& path) {
  return ParseJson(ReadFile(path), path.string());
}

void WriteJson(const std::filesystem::path& path, const Json& json) {
  WriteFile(path, json.dump(2) + "\n");
}

}  // namespace nacre
