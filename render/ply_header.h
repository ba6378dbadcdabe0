#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nacre::render {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::size_t SizeOf(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::size_t size = 0;         ///< bytes of the header
  std::int64_t line_count = 0;  ///< lines of the header
};

/// Throws BadData with file:line.
PlyHeader ParsePlyHeader(std::string_view bytes, const std::string& origin);

}  // namespace nacre::render
