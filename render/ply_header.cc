#include "render/ply_header.h"

#include "core/error.h"

#include <charconv>
#include <fmt/format.h>
#include <map>
#include <sstream>

namespace nacre::render {
namespace {

class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, const std::string& origin)
      : bytes_(bytes), origin_(origin) {}

  PlyHeader Parse() {
    if (NextLine() != "ply") {
      throw BadData(origin_ + ":1: not a PLY file: its first line isn't 'ply'");
    }
    for (;;) {
      const std::string line = NextLine();
      if (line == "end_header") {
        break;
      }
      ParseLine(line);
    }
    if (!format_seen_) {
      Fail("no 'format' line");
    }
    header_.size = at_;
    header_.line_count = line_number_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void Fail(const std::string& message) const {
    throw BadData(fmt::format("{}:{}: {}", origin_, line_number_, message));
  }

  std::string NextLine() {
    constexpr std::size_t kMaxLine = 4096;
    ++line_number_;
    const std::size_t end = bytes_.substr(at_, kMaxLine).find('\n');
    if (end == std::string_view::npos) {
      Fail("the header has no end; the file is cut off or not a PLY file");
    }
    std::string line(bytes_.substr(at_, end));
    at_ += end + 1;
    if (!line.empty() && line.back() == '\r') {
      line.pop_back();
    }
    return line;
  }

  void ParseLine(const std::string& line) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "format") {
      ParseFormat(words);
    } else if (keyword == "element") {
      ParseElement(words);
    } else if (keyword == "property") {
      ParseProperty(words);
    } else if (keyword != "comment" && keyword != "obj_info") {
      Fail(fmt::format("'{}' isn't a line of a PLY header", line));
    }
  }

  void ParseFormat(std::istringstream& words) {
    std::string name;
    words >> name;
    if (name == "ascii") {
      header_.encoding = PlyEncoding::kAscii;
    } else if (name == "binary_little_endian") {
      header_.encoding = PlyEncoding::kLittleEndian;
    } else if (name == "binary_big_endian") {
      header_.encoding = PlyEncoding::kBigEndian;
    } else {
      Fail(fmt::format("no format '{}'", name));
    }
    format_seen_ = true;
  }

  void ParseElement(std::istringstream& words) {
    PlyElement element;
    std::string count;
    words >> element.name >> count;
    const char* const end = count.data() + count.size();
    const auto [stop, failure] = std::from_chars(count.data(), end, element.count);
    if (failure != std::errc() || stop != end || element.count < 0) {
      Fail(fmt::format("'{}' isn't a count of elements", count));
    }
    header_.elements.push_back(element);
  }

  void ParseProperty(std::istringstream& words) {
    if (header_.elements.empty()) {
      Fail("a property before any element");
    }
    PlyProperty property;
    std::string type;
    words >> type;
    if (type == "list") {
      property.is_list = true;
      std::string count_type;
      words >> count_type >> type;
      property.count_type = ParseType(count_type);
      if (property.count_type == PlyType::kFloat ||
          property.count_type == PlyType::kDouble) {
        Fail("a list can't have a fractional count");
      }
    }
    property.type = ParseType(type);
    words >> property.name;
    if (property.name.empty()) {
      Fail("a property without a name");
    }
    header_.elements.back().properties.push_back(property);
  }

  PlyType ParseType(const std::string& name) const {
    static const std::map<std::string, PlyType> types = {{"char", PlyType::kInt8},
                                                         {"int8", PlyType::kInt8},
                                                         {"uchar", PlyType::kUint8},
                                                         {"uint8", PlyType::kUint8},
                                                         {"short", PlyType::kInt16},
                                                         {"int16", PlyType::kInt16},
                                                         {"ushort", PlyType::kUint16},
                                                         {"uint16", PlyType::kUint16},
                                                         {"int", PlyType::kInt32},
                                                         {"int32", PlyType::kInt32},
                                                         {"uint", PlyType::kUint32},
                                                         {"uint32", PlyType::kUint32},
                                                         {"float", PlyType::kFloat},
                                                         {"float32", PlyType::kFloat},
                                                         {"double", PlyType::kDouble},
                                                         {"float64", PlyType::kDouble}};
    const auto found = types.find(name);
    if (found == types.end()) {
      Fail(fmt::format("no type '{}'", name));
    }
    return found->second;
  }

  std::string_view bytes_;
  std::string origin_;
  std::size_t at_ = 0;
  std::int64_t line_number_ = 0;
  bool format_seen_ = false;
  PlyHeader header_;
};

}  // namespace

std::size_t SizeOf(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat:
      return 4;
    case PlyType::kDouble:
      return 8;
  }
  throw LogicError("unknown type of a PLY property");
}

PlyHeader ParsePlyHeader(std::string_view bytes, const std::string& origin) {
  return HeaderParser(bytes, origin).Parse();
}

}  // namespace nacre::render
