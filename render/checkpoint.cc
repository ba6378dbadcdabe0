#include "render/checkpoint.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"

namespace nacre::render {
namespace {

constexpr std::string_view kMagic = "nacre checkpoint 1\n";

std::string HashOf(std::string_view bytes) {
  return HashHex(bytes.data(), bytes.size());
}

}  // namespace

void WriteCheckpoint(const Checkpoint& checkpoint, const Accumulator& film) {
  std::string bytes(kMagic);
  bytes += HashOf(checkpoint.identity);
  bytes += film.Bytes();
  bytes += HashOf(bytes);
  WriteFile(checkpoint.path, bytes);
}

bool ReadCheckpoint(const Checkpoint& checkpoint, Accumulator& film) {
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
  const std::size_t header = kMagic.size() + identity.size();
  if (!film.Restore(bytes.substr(header, bytes.size() - around))) {
    refuse("it is of a picture of another size");
  }
  return true;
}

}  // namespace nacre::render
