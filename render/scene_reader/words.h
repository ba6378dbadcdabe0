#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nacre::render {

/// The word of `known` with the fewest edits from `word` [Levenshtein66], or "" if none
/// is close enough to be what was meant.
std::string NearestWord(std::string_view word, const std::vector<std::string>& known);

/// "; did you mean 'x'?" or, with nothing close, "; known are a, b, c".
std::string Suggestion(std::string_view word, const std::vector<std::string>& known);

}  // namespace nacre::render
