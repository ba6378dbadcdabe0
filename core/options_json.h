#pragma once

#include "core/json.h"
#include "core/options.h"

namespace nacre {

/// The options as a JSON object, for provenance.
template <class Options>
Json OptionsToJson(const Options& options) {
  Json json = Json::object();
  Options::Visit(options, [&](const char* name, const auto& value, Range, const char*) {
    json[name] = value;
  });
  return json;
}

}  // namespace nacre
