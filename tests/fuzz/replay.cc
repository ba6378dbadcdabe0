// The same entry as libFuzzer's, for builds by any compiler: every file of a folder as
// it is, then cut short and with bytes changed, the same ones each time.
//   <reader>_replay FOLDER

#include "core/atomic_file.h"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <random>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr int kChangedPerFile = 60;
constexpr int kMostChangedBytes = 4;

void Replay(const std::string& bytes) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                         bytes.size());
}

void ReplayChanged(const std::string& good) {
  std::minstd_rand random(1);
  for (int n = 0; n < kChangedPerFile && !good.empty(); ++n) {
    std::string bad = good;
    for (int k = 0; k <= n % kMostChangedBytes; ++k) {
      bad[random() % bad.size()] = static_cast<char>(random() >> 8);
    }
    if (n % 3 == 0) {
      bad.resize(random() % bad.size());
    }
    Replay(bad);
  }
}

}  // namespace

int main(int count, char** arguments) {
  int files = 0;
  for (int n = 1; n < count; ++n) {
    for (const auto& entry : std::filesystem::directory_iterator(arguments[n])) {
      const std::string bytes = nacre::ReadFile(entry.path());
      Replay(bytes);
      ReplayChanged(bytes);
      ++files;
    }
  }
  std::printf("%d files\n", files);
  return files > 0 ? 0 : 1;
}
