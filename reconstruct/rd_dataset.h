#pragma once

#include "core/point_mm.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace nacre::reconstruct {

/// What a dataset R_d(x_i, d) is sampled on. Grid indices and window indices run as in
/// a picture: i (and u) to the right, j (and v) downwards, so that (0, 0) is the upper
/// left.
struct RdHeader {
  int points_x = 0;  ///< grid points x_i
  int points_y = 0;
  int core = 0;  ///< odd; the window of a point is core × core cells of pitch²
  double pitch_mm = 0;
  double eta = 1;  ///< refractive index of the sample, for Fresnel at both ends
  std::vector<std::string> channels;
  std::string provenance;  ///< JSON text, see core/provenance.h

  int Radius() const { return (core - 1) / 2; }
  std::int64_t PointCount() const { return std::int64_t{points_x} * points_y; }
  std::int64_t WindowSize() const { return std::int64_t{core} * core; }
  /// Values of one slice: all channels of one x_i.
  std::int64_t SliceSize() const {
    return WindowSize() * static_cast<std::int64_t>(channels.size());
  }
  double CellAreaMm2() const { return pitch_mm * pitch_mm; }

  /// Where grid point (i, j) lies; the grid is centred on the origin.
  PointMm GridPoint(int i, int j) const {
    return {(i - 0.5 * (points_x - 1)) * pitch_mm,
            (0.5 * (points_y - 1) - j) * pitch_mm};
  }
  /// d = x_o − x_i of window cell (u, v).
  PointMm Offset(int u, int v) const {
    return {(u - Radius()) * pitch_mm, (Radius() - v) * pitch_mm};
  }
};

/// Throws BadData naming `origin` and the field if the header makes no sense.
void Validate(const RdHeader& header, const std::string& origin);

/// One slice R_d(x_i, ·): channel after channel, each core × core, row by row from the
/// top. rd is the mean over the cell around x_i + d, in mm⁻²; sigma its standard
/// deviation from noise (0 where unknown or exact); valid is 1 where rd is measured, 0
/// where it isn't.
struct RdSlice {
  std::vector<float> rd;
  std::vector<float> sigma;
  std::vector<std::uint8_t> valid;
};

/// An empty slice of the right size, all valid, all zero.
RdSlice MakeSlice(const RdHeader& header);

/// A whole dataset in memory; slice s = j · points_x + i starts at s · SliceSize().
struct RdDataset {
  RdHeader header;
  std::vector<float> rd;
  std::vector<float> sigma;
  std::vector<std::uint8_t> valid;

  std::span<const float> Window(std::int64_t slice, int channel) const {
    return {&rd[static_cast<std::size_t>(slice * header.SliceSize() +
                                         channel * header.WindowSize())],
            static_cast<std::size_t>(header.WindowSize())};
  }
};

/// Reads `*.rd.exr`: parts "rd", "sigma" and "valid", each tiled, tile (i, j) = slice
/// (i, j). Slices are read on demand: one slice is one tile of each part. Not
/// thread-safe.
class RdReader {
 public:
  explicit RdReader(const std::filesystem::path& path);
  ~RdReader();
  RdReader(RdReader&&) noexcept;

  const RdHeader& header() const;
  /// Throws BadData if the tile is missing, corrupt, or holds a NaN, an infinity or a
  /// checksum that doesn't match; the message names the slice.
  RdSlice ReadSlice(int i, int j);

 private:
  struct File;
  std::unique_ptr<File> file_;
};

/// Writes a dataset slice by slice, in any order, with bounded memory. Nothing appears
/// under `path` before Finish(), which requires that every slice was written.
class RdWriter {
 public:
  RdWriter(const std::filesystem::path& path, const RdHeader& header);
  ~RdWriter();
  RdWriter(const RdWriter&) = delete;
  RdWriter& operator=(const RdWriter&) = delete;

  void WriteSlice(int i, int j, const RdSlice& slice);
  void Finish();

 private:
  struct File;
  std::unique_ptr<File> file_;
};

RdDataset ReadDataset(const std::filesystem::path& path);
void WriteDataset(const std::filesystem::path& path, const RdDataset& dataset);

}  // namespace nacre::reconstruct
