#pragma once

#include "reconstruct/internal/rd_format.h"

#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfTiledInputPart.h>

#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// Reads the tiles of one part of `*.rd.exr`, each to the same place.
///
/// OpenEXR stores a tile that doesn't pack, as noisy floats don't, as it is, and reads
/// it number by number and byte by byte. Such a tile is copied in lines here; one whose
/// packed bytes are those of the tile before (all valid, no sigma) is there already.
class TileReader {
 public:
  /// `input` and `buffer` have to outlive it; nobody else may write to what `part` has
  /// of `buffer`.
  TileReader(Imf::MultiPartInputFile& input, TileBuffer& buffer, Part part);

  /// Throws what OpenEXR throws.
  void Read(int i, int j);

 private:
  void CopyLines(std::span<const char> lines);

  Imf::TiledInputPart part_;
  std::vector<char*> planes_;  ///< of the channels, as the file has them in a line
  std::size_t line_bytes_;     ///< of one channel
  std::size_t tile_bytes_;
  std::vector<char> packed_;  ///< what the buffer was unpacked from; none: nothing
  std::vector<char> candidate_;
};

}  // namespace nacre::reconstruct::internal
