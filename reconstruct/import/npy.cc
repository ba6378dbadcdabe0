#include "reconstruct/import/npy.h"

#include "core/error.h"
#include "reconstruct/internal/mapped_file.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <regex>

namespace nacre::reconstruct {
namespace {

constexpr std::size_t kMostHeaderBytes = 65536;
constexpr std::size_t kMostAxes = 8;

// Where the numbers begin and what the header's dictionary says, a Python literal:
// {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }
struct Header {
  std::size_t data_begin = 0;
  std::string dictionary;
};

Header ReadHeader(const internal::MappedFile& file, const std::string& origin) {
  constexpr std::string_view kMagic = "\x93NUMPY";
  const auto bytes = file.bytes();
  const auto byte = [&](std::size_t at) { return std::size_t{bytes[at]}; };
  if (bytes.size() < 12 ||
      !std::equal(
          kMagic.begin(), kMagic.end(), bytes.begin(), [](char a, unsigned char b) {
            return static_cast<unsigned char>(a) == b;
          })) {
    throw BadData(origin + ": isn't a NumPy file (.npy)");
  }
  const std::size_t version = byte(6);
  if (version < 1 || version > 3) {
    throw BadData(
        fmt::format("{}: NumPy file of version {}, known are 1 to 3", origin, version));
  }
  const std::size_t begin = version == 1 ? 10 : 12;
  const std::size_t length =
      version == 1 ? byte(8) | byte(9) << 8
                   : byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24;
  if (length > kMostHeaderBytes || begin + length > bytes.size()) {
    throw BadData(fmt::format("{}: truncated: its header of {} bytes doesn't fit in {}",
                              origin,
                              length,
                              bytes.size()));
  }
  Header header{begin + length, {}};
  header.dictionary.assign(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                           bytes.begin() + static_cast<std::ptrdiff_t>(begin + length));
  return header;
}

std::string Entry(const std::string& dictionary,
                  const char* key,
                  const char* value,
                  const std::string& origin) {
  std::smatch match;
  const std::regex pattern(fmt::format(R"(['"]{}['"]\s*:\s*{})", key, value));
  if (!std::regex_search(dictionary, match, pattern)) {
    throw BadData(fmt::format("{}: its NumPy header has no '{}' that can be read: {}",
                              origin,
                              key,
                              dictionary.substr(0, 200)));
  }
  return match[1];
}

void ReadType(const std::string& descr, const std::string& origin, ArrayView& array) {
  array.big_endian = descr[0] == '>';
  const std::string kind = descr.substr(1);
  if (kind == "u1" || kind == "b1") {
    array.type = NumberType::kUint8;
  } else if (kind == "u2") {
    array.type = NumberType::kUint16;
  } else if (kind == "f4") {
    array.type = NumberType::kFloat32;
  } else if (kind == "f8") {
    array.type = NumberType::kFloat64;
  } else {
    throw BadData(fmt::format(
        "{}: numbers of NumPy type '{}'; read are u1, u2, f4 and f8: convert with "
        "astype('f4')",
        origin,
        descr));
  }
}

std::int64_t SizeOf(NumberType type) {
  constexpr std::array<std::int64_t, 4> kSizes = {1, 2, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

std::vector<std::int64_t> ReadShape(const std::string& text,
                                    const std::string& origin) {
  std::vector<std::int64_t> shape;
  const std::regex number("[0-9]+");
  for (std::sregex_iterator at(text.begin(), text.end(), number), end; at != end;
       ++at) {
    // More digits than any size that fits a disk would overflow.
    if (at->length() > 15 || shape.size() == kMostAxes) {
      throw BadData(fmt::format("{}: shape ({}) is not one of an R_d", origin, text));
    }
    shape.push_back(std::stoll(at->str()));
  }
  return shape;
}

}  // namespace

ImportSummary ImportNpy(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ImportOptions& options,
                        const ArrayImportOptions& array_options,
                        const ProgressFunction& progress) {
  const std::string origin = from.string();
  const internal::MappedFile file(from);
  const Header header = ReadHeader(file, origin);
  ArrayView array;
  ReadType(Entry(header.dictionary, "descr", R"(['"]([<>|=][a-z][0-9]+)['"])", origin),
           origin,
           array);
  const bool fortran =
      Entry(header.dictionary, "fortran_order", "(True|False)", origin) == "True";
  array.extent = ReadShape(
      Entry(header.dictionary, "shape", R"(\(([0-9,\sL]*)\))", origin), origin);
  const double declared = [&] {
    double product = static_cast<double>(SizeOf(array.type));
    for (const std::int64_t extent : array.extent) {
      product *= static_cast<double>(extent);
    }
    return product;
  }();
  const auto held = static_cast<double>(file.bytes().size() - header.data_begin);
  if (declared != held || declared == 0) {
    throw BadData(
        fmt::format("{}: {}: shape {} declares {:.0f} bytes of numbers, found {:.0f}",
                    origin,
                    held < declared ? "truncated" : "wrong length",
                    array.extent,
                    declared,
                    held));
  }
  array.data = file.bytes().data() + header.data_begin;
  array.stride_bytes.resize(array.extent.size());
  std::int64_t stride = SizeOf(array.type);
  for (std::size_t n = 0; n < array.extent.size(); ++n) {
    const std::size_t axis = fortran ? n : array.extent.size() - 1 - n;
    array.stride_bytes[axis] = stride;
    stride *= array.extent[axis];
  }
  return ImportArray(array, from, to, options, array_options, progress);
}

}  // namespace nacre::reconstruct
