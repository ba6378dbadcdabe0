#pragma once

#include "reconstruct/rd_dataset.h"

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace nacre::reconstruct::internal {

/// The layout of `*.rd.exr`, shared by reader and writer; reconstruct/README.md
/// documents it.
constexpr const char* kFormatVersion = "1";
constexpr const char* kUnits = "mm^-2";
constexpr const char* kRowOrder = "top row first (+y up)";

enum Part { kRd, kSigma, kValid, kChecksum, kPartCount };
constexpr std::array<const char*, kPartCount> kPartNames = {
    "rd", "sigma", "valid", "checksum"};

/// The OpenEXR headers of the four parts.
std::vector<Imf::Header> PartHeaders(const RdHeader& header);

/// What the attributes of part "rd" say. Throws BadData naming `origin` and the
/// attribute that is missing or wrong; the result is validated.
RdHeader HeaderFromAttributes(const Imf::Header& part, const std::string& origin);

/// One slice as OpenEXR holds it, and the frame buffers that address it tile by tile.
struct TileBuffer {
  explicit TileBuffer(const RdHeader& header);
  Imf::FrameBuffer FrameBuffer(Part part);
  static std::size_t ValueBytes(Part part) {
    return part == kValid ? sizeof(std::uint16_t) : sizeof(float);
  }

  std::vector<std::string> channels;
  int core;
  std::vector<float> rd;
  std::vector<float> sigma;
  std::vector<std::uint16_t> valid;  ///< bits of a half: 0 or 1
};

constexpr std::uint16_t kHalfOne = 0x3C00;

/// What ties the values of a slice to its place and to the header it is read under.
class Checksum {
 public:
  explicit Checksum(const RdHeader& header);
  std::uint64_t Of(std::int64_t s, const RdSlice& slice) const;

 private:
  std::uint64_t header_hash_;
};

/// "slice (i, j)".
std::string SliceName(const RdHeader& header, std::int64_t s);

}  // namespace nacre::reconstruct::internal
