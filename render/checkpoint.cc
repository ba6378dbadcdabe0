#include "render/checkpoint.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"

#include <cstdint>
#include <cstring>

namespace nacre::render {
namespace {

constexpr std::string_view kMagic = "nacre checkpoint 2\n";

std::string HashOf(std::string_view bytes) {
  return HashHex(bytes.data(), bytes.size());
}

std::string BytesOf(const std::vector<int>& pass) {
  const std::uint64_t count = pass.size();
  std::string bytes(reinterpret_cast<const char*>(&count), sizeof(count));
  bytes.append(reinterpret_cast<const char*>(pass.data()), count * sizeof(int));
  return bytes;
}

// False if the bytes don't begin with what BytesOf() makes.
bool TakePass(std::string_view& bytes, std::vector<int>& pass) {
  std::uint64_t count = 0;
  if (bytes.size() < sizeof(count)) {
    return false;
  }
  std::memcpy(&count, bytes.data(), sizeof(count));
  bytes.remove_prefix(sizeof(count));
  if (count > bytes.size() / sizeof(int)) {
    return false;
  }
  pass.resize(count);
  if (count > 0) {  // memcpy doesn't take the null of an empty vector
    std::memcpy(pass.data(), bytes.data(), count * sizeof(int));
  }
  bytes.remove_prefix(count * sizeof(int));
  return true;
}

}  // namespace

void WriteCheckpoint(const Checkpoint& checkpoint,
                     const Accumulator& film,
                     const std::vector<int>& pass) {
  std::string bytes(kMagic);
  bytes += HashOf(checkpoint.identity);
  bytes += BytesOf(pass);
  bytes += film.Bytes();
  bytes += HashOf(bytes);
  WriteFile(checkpoint.path, bytes);
}

bool ReadCheckpoint(const Checkpoint& checkpoint,
                    Accumulator& film,
                    std::vector<int>& pass) {
  if (!std::filesystem::exists(checkpoint.path)) {
    return false;
  }
  const std::string file = ReadFile(checkpoint.path);
  std::string_view bytes = file;
  const std::string identity = HashOf(checkpoint.identity);
  const std::size_t around = kMagic.size() + 2 * identity.size();
  const auto refuse = [&](const char* found) {
    throw BadData("can't go on from " + checkpoint.path.string() + ": " + found +
                  "; remove it to begin anew");
  };
  if (bytes.size() < around || bytes.substr(0, kMagic.size()) != kMagic) {
    refuse("it isn't a checkpoint of a picture");
  }
  const std::size_t size = bytes.size() - identity.size();
  if (HashOf(bytes.substr(0, size)) != bytes.substr(size)) {
    refuse("it is damaged");
  }
  if (bytes.substr(kMagic.size(), identity.size()) != identity) {
    refuse("it is of another scene, seed, integrator or options");
  }
  bytes = bytes.substr(kMagic.size() + identity.size(), bytes.size() - around);
  if (!TakePass(bytes, pass) || !film.Restore(bytes)) {
    refuse("it is of a picture of another size");
  }
  return true;
}

}  // namespace nacre::render
