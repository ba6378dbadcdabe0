#include "acquire/session.h"
#include "core/atomic_file.h"
#include "tests/fuzz/fuzz.h"

#include <fstream>
#include <string>

namespace nacre::fuzz {

const char* const kFileName = "input";

void Read(const std::filesystem::path& path) {
  // One input for two files: the description, a zero, the journal.
  const std::string bytes = ReadFile(path);
  const std::size_t zero = bytes.find(char{0});
  const std::filesystem::path folder = path.parent_path() / "session";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "session.json", std::ios::binary) << bytes.substr(0, zero);
  std::ofstream(folder / "journal", std::ios::binary)
      << (zero == std::string::npos ? "" : bytes.substr(zero + 1));
  const acquire::SessionReader session(folder);
  session.IsComplete();
}

}  // namespace nacre::fuzz
