#include "core/hash.h"

#include "core/error.h"

#include <fmt/format.h>
#include <fstream>
#include <memory>
#include <vector>
#include <xxhash.h>

namespace nacre {
namespace {

std::string Hex(XXH128_hash_t hash) {
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace

std::uint64_t Hash64(const void* data, std::size_t size) {
  return XXH3_64bits(data, size);
}

std::string HashHex(const void* data, std::size_t size) {
  return Hex(XXH3_128bits(data, size));
}

std::string HashFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw SystemError("cannot read " + path.string());
  }
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(
      XXH3_createState(), &XXH3_freeState);
  Expect(state != nullptr && XXH3_128bits_reset(state.get()) == XXH_OK, "a hash state");
  std::vector<char> buffer(1 << 20);
  while (file) {
    file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    XXH3_128bits_update(
        state.get(), buffer.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) {
    throw SystemError("cannot read " + path.string());
  }
  return Hex(XXH3_128bits_digest(state.get()));
}

}  // namespace nacre
