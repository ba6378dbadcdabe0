// libFuzzer's entry: the bytes become a file, since that is what our readers read.

#include "tests/fuzz/fuzz.h"

#include "core/error.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <new>
#include <string>

namespace nacre::fuzz {
namespace {

// In memory where that can be had; one folder a process, so that several can run.
std::filesystem::path MakeFolder() {
  const bool memory = std::filesystem::is_directory("/dev/shm");
  std::string pattern =
      std::string(memory ? "/dev/shm" : "/tmp") + "/nacre-fuzz-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) {
    std::abort();
  }
  static std::string folder;
  folder = pattern;
  std::atexit([] {
    std::error_code ignored;  // a left-over folder harms nobody
    std::filesystem::remove_all(folder, ignored);
  });
  return pattern;
}

}  // namespace
}  // namespace nacre::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = nacre::fuzz::MakeFolder();
  const std::filesystem::path path = folder / nacre::fuzz::kFileName;
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    nacre::fuzz::Read(path);
  } catch (const nacre::Error&) {
    return 0;
  } catch (const std::bad_alloc&) {  // the command says so and ends in good order
    return 0;
  }
  return 0;
}
