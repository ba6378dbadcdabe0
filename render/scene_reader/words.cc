#include "render/scene_reader/words.h"

#include <algorithm>
#include <cctype>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace nacre::render {
namespace {

char Lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// Upper and lower case count as the same letter.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced =
          diagonal + (Lower(a[i - 1]) != Lower(b[j - 1]) ? 1 : 0);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

bool BeginsWith(std::string_view word, std::string_view start) {
  return start.size() >= 3 && word.size() > start.size() &&
         EditDistance(word.substr(0, start.size()), start) == 0;
}

}  // namespace

std::string NearestWord(std::string_view word, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t fewest = std::max<std::size_t>(2, word.size() / 2) + 1;
  for (const std::string& candidate : known) {
    // Half a word is as good as one letter wrong.
    const bool part = BeginsWith(candidate, word) || BeginsWith(word, candidate);
    const std::size_t edits = part ? 1 : EditDistance(word, candidate);
    if (edits < fewest) {
      fewest = edits;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string Suggestion(std::string_view word, const std::vector<std::string>& known) {
  const std::string nearest = NearestWord(word, known);
  if (!nearest.empty()) {
    return fmt::format("; did you mean '{}'?", nearest);
  }
  if (known.empty()) {
    return "; none is known here";
  }
  return fmt::format("; known are {}", fmt::join(known, ", "));
}

}  // namespace nacre::render
