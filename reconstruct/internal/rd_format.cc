#include "reconstruct/internal/rd_format.h"

#include "core/error.h"
#include "core/hash.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfStringVectorAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfVecAttribute.h>

#include <bit>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace nacre::reconstruct::internal {
namespace {

// Noisy floats don't pack at any level, and the rest (validity, a sigma of zeros) packs
// at the lowest.
constexpr int kZipLevel = 1;

void SetAttributes(const RdHeader& header, Imf::Header& part) {
  part.insert("nacre.kind", Imf::StringAttribute("rd"));
  part.insert("nacre.version", Imf::StringAttribute(kFormatVersion));
  part.insert("nacre.points",
              Imf::V2iAttribute(Imath::V2i(header.points_x, header.points_y)));
  part.insert("nacre.core", Imf::IntAttribute(header.core));
  part.insert("nacre.pitch_mm", Imf::DoubleAttribute(header.pitch_mm));
  part.insert("nacre.eta", Imf::DoubleAttribute(header.eta));
  part.insert("nacre.units", Imf::StringAttribute(kUnits));
  part.insert("nacre.channels", Imf::StringVectorAttribute(header.channels));
  part.insert("nacre.row_order", Imf::StringAttribute(kRowOrder));
  part.insert("nacre.provenance", Imf::StringAttribute(header.provenance));
}

template <class Attribute>
auto Value(const Imf::Header& part, const char* name, const std::string& origin) {
  const auto* attribute = part.findTypedAttribute<Attribute>(name);
  if (attribute == nullptr) {
    throw BadData(fmt::format("{}: not a dataset of R_d: no attribute '{}' of type {}",
                              origin,
                              name,
                              Attribute::staticTypeName()));
  }
  return attribute->value();
}

void ExpectText(const Imf::Header& part,
                const char* name,
                const std::string& expected,
                const std::string& origin) {
  const auto found = Value<Imf::StringAttribute>(part, name, origin);
  if (found != expected) {
    throw BadData(fmt::format(
        "{}: attribute '{}' is '{}', expected '{}'", origin, name, found, expected));
  }
}

}  // namespace

std::vector<Imf::Header> PartHeaders(const RdHeader& header) {
  const int width = header.points_x * header.core;
  const int height = header.points_y * header.core;
  std::vector<Imf::Header> parts;
  for (int p = 0; p < kPartCount; ++p) {
    Imf::Header part(width, height);
    part.setName(kPartNames[static_cast<std::size_t>(p)]);
    part.compression() = Imf::ZIP_COMPRESSION;
    part.zipCompressionLevel() = kZipLevel;
    if (p == kChecksum) {
      part.dataWindow() =
          Imath::Box2i({0, 0}, {header.points_x - 1, header.points_y - 1});
      part.setType(Imf::SCANLINEIMAGE);
      part.channels().insert("high", Imf::Channel(Imf::UINT));
      part.channels().insert("low", Imf::Channel(Imf::UINT));
    } else {
      part.setType(Imf::TILEDIMAGE);
      const auto core = static_cast<unsigned>(header.core);
      part.setTileDescription(Imf::TileDescription(core, core, Imf::ONE_LEVEL));
      part.lineOrder() = Imf::RANDOM_Y;
      for (const std::string& channel : header.channels) {
        part.channels().insert(channel,
                               Imf::Channel(p == kValid ? Imf::HALF : Imf::FLOAT));
      }
      SetAttributes(header, part);
    }
    parts.push_back(part);
  }
  return parts;
}

RdHeader HeaderFromAttributes(const Imf::Header& part, const std::string& origin) {
  ExpectText(part, "nacre.kind", "rd", origin);
  ExpectText(part, "nacre.version", kFormatVersion, origin);
  ExpectText(part, "nacre.units", kUnits, origin);
  ExpectText(part, "nacre.row_order", kRowOrder, origin);
  RdHeader header;
  const auto points = Value<Imf::V2iAttribute>(part, "nacre.points", origin);
  header.points_x = points.x;
  header.points_y = points.y;
  header.core = Value<Imf::IntAttribute>(part, "nacre.core", origin);
  header.pitch_mm = Value<Imf::DoubleAttribute>(part, "nacre.pitch_mm", origin);
  header.eta = Value<Imf::DoubleAttribute>(part, "nacre.eta", origin);
  header.channels = Value<Imf::StringVectorAttribute>(part, "nacre.channels", origin);
  header.provenance = Value<Imf::StringAttribute>(part, "nacre.provenance", origin);
  Validate(header, origin);
  return header;
}

TileBuffer::TileBuffer(const RdHeader& header)
    : channels(header.channels),
      core(header.core),
      rd(static_cast<std::size_t>(header.SliceSize())),
      sigma(rd.size()),
      valid(rd.size()) {}

Imf::FrameBuffer TileBuffer::FrameBuffer(Part part) {
  Imf::FrameBuffer buffer;
  const auto window = static_cast<std::size_t>(core) * static_cast<std::size_t>(core);
  const std::size_t bytes = ValueBytes(part);
  void* base = part == kRd      ? static_cast<void*>(rd.data())
               : part == kSigma ? static_cast<void*>(sigma.data())
                                : static_cast<void*>(valid.data());
  for (std::size_t c = 0; c < channels.size(); ++c) {
    // Tile coordinates: every tile is read from and written to the same place.
    buffer.insert(channels[c],
                  Imf::Slice(part == kValid ? Imf::HALF : Imf::FLOAT,
                             static_cast<char*>(base) + c * window * bytes,
                             bytes,
                             bytes * static_cast<std::size_t>(core),
                             1,
                             1,
                             0.0,
                             true,
                             true));
  }
  return buffer;
}

Checksum::Checksum(const RdHeader& header) {
  const std::string text = fmt::format("{} {} {} {:016x} {:016x} {} {}",
                                       header.points_x,
                                       header.points_y,
                                       header.core,
                                       std::bit_cast<std::uint64_t>(header.pitch_mm),
                                       std::bit_cast<std::uint64_t>(header.eta),
                                       fmt::join(header.channels, "\n"),
                                       header.provenance);
  header_hash_ = Hash64(text.data(), text.size());
}

std::uint64_t Checksum::Of(std::int64_t s, const RdSlice& slice) const {
  const std::array<std::uint64_t, 5> parts = {
      header_hash_,
      static_cast<std::uint64_t>(s),
      Hash64(slice.rd.data(), slice.rd.size() * sizeof(float)),
      Hash64(slice.sigma.data(), slice.sigma.size() * sizeof(float)),
      Hash64(slice.valid.data(), slice.valid.size())};
  return Hash64(parts.data(), sizeof(parts));
}

std::string SliceName(const RdHeader& header, std::int64_t s) {
  return fmt::format("slice ({}, {})", s % header.points_x, s / header.points_x);
}

}  // namespace nacre::reconstruct::internal
