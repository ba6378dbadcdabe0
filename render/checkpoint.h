#pragma once

#include "render/accumulator.h"

#include <filesystem>
#include <string>

namespace nacre::render {

/// Where unfinished work is kept, and a text that names what it is part of: everything
/// that a sample depends on. Work on something else is refused.
struct Checkpoint {
  std::filesystem::path path;
  std::string identity;
};

/// Writes all sums, atomically. The file is of this kind of machine alone (byte order,
/// layout): "nacre checkpoint 1\n", the identity's hash, the sums, a hash of all.
void WriteCheckpoint(const Checkpoint& checkpoint, const Accumulator& film);

/// False if there is no such file. Throws BadData for a file that is damaged, of
/// another size, or has another identity.
bool ReadCheckpoint(const Checkpoint& checkpoint, Accumulator& film);

}  // namespace nacre::render
