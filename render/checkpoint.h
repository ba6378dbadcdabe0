#pragma once

#include "render/accumulator.h"

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::render {

/// Where unfinished work is kept, and a text that names what it is part of: everything
/// that a sample depends on. Work on something else is refused.
struct Checkpoint {
  std::filesystem::path path;
  std::string identity;
};

/// Writes all sums, atomically, and of a pass that isn't at its end how many samples
/// each tile's pixels are to have after it (nothing between passes). The file is of
/// this kind of machine alone (byte order, layout): "nacre checkpoint 2\n", the
/// identity's hash, the number of tiles, theirs, the sums, a hash of all.
void WriteCheckpoint(const Checkpoint& checkpoint,
                     const Accumulator& film,
                     const std::vector<int>& pass = {});

/// False if there is no such file. `pass`: as written. Throws BadData for a file that
/// is damaged, of another size, or has another identity.
bool ReadCheckpoint(const Checkpoint& checkpoint,
                    Accumulator& film,
                    std::vector<int>& pass);

}  // namespace nacre::render
