#include "core/exr.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr_guard.h"
#include "core/exr_reader.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <new>

namespace nacre {
namespace {

Imf::PixelType TypeOf(ExrPixels pixels) {
  switch (pixels) {
    case ExrPixels::kHalf:
      return Imf::HALF;
    case ExrPixels::kCodes:
      return Imf::UINT;
    case ExrPixels::kFloat:
      break;
  }
  return Imf::FLOAT;
}

Imf::Compression CompressionOf(ExrPixels pixels) {
  switch (pixels) {
    case ExrPixels::kHalf:
      return Imf::PIZ_COMPRESSION;
    case ExrPixels::kCodes:
      return Imf::PXR24_COMPRESSION;  // lossless for UINT: differences, bytes apart
    case ExrPixels::kFloat:
      break;
  }
  return Imf::ZIP_COMPRESSION;
}

// All parts of a file share one display window, so that of the first serves for all.
Imf::Header HeaderOf(const ExrPart& part, const ExrPart& first) {
  Imf::Header header(first.width, first.height);
  header.dataWindow() = Imath::Box2i({0, 0}, {part.width - 1, part.height - 1});
  header.compression() = CompressionOf(part.pixels);
  header.setType(Imf::SCANLINEIMAGE);
  if (!part.name.empty()) {
    header.setName(part.name);
  }
  for (const std::string& channel : part.channels) {
    header.channels().insert(channel, Imf::Channel(TypeOf(part.pixels)));
  }
  for (const auto& [key, value] : part.attributes) {
    header.insert(key, Imf::StringAttribute(value));
  }
  return header;
}

// OpenEXR's slices address pixel (0, 0) of the data window and don't know const.
template <class T>
Imf::FrameBuffer BufferOf(
    const ExrPart& part, Imf::PixelType type, T* values, int min_x, int min_y) {
  Imf::FrameBuffer buffer;
  const auto width = static_cast<std::ptrdiff_t>(part.width);
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    T* base = values + static_cast<std::ptrdiff_t>(c * part.PixelCount()) - min_x -
              width * min_y;
    buffer.insert(part.channels[c],
                  Imf::Slice(type,
                             static_cast<char*>(static_cast<void*>(base)),
                             sizeof(T),
                             sizeof(T) * static_cast<std::size_t>(part.width)));
  }
  return buffer;
}

template <class T>
void WritePixels(Imf::OutputPart& output, const ExrPart& part, std::vector<T> values) {
  output.setFrameBuffer(BufferOf(part, TypeOf(part.pixels), values.data(), 0, 0));
  output.writePixels(part.height);
}

void WritePart(Imf::OutputPart& output, const ExrPart& part) {
  switch (part.pixels) {
    case ExrPixels::kFloat:
      return WritePixels<float>(output, part, part.values);
    case ExrPixels::kHalf:
      return WritePixels<Imath::half>(
          output, part, {part.values.begin(), part.values.end()});
    case ExrPixels::kCodes: {
      std::vector<unsigned> codes;
      codes.reserve(part.values.size());
      for (const float value : part.values) {
        Expect(value >= 0 && value <= 0x1p24F && value == std::floor(value),
               "whole numbers from 0 to 2^24");
        codes.push_back(static_cast<unsigned>(value));
      }
      return WritePixels<unsigned>(output, part, std::move(codes));
    }
  }
}

std::vector<Imf::Header> HeadersOf(const std::vector<ExrPart>& parts) {
  Expect(!parts.empty(), "at least one part");
  std::vector<Imf::Header> headers;
  for (const ExrPart& part : parts) {
    Expect(part.width > 0 && part.height > 0, "a picture with pixels");
    Expect(part.values.size() == part.PixelCount() * part.channels.size(),
           "channels * height * width values");
    headers.push_back(HeaderOf(part, parts.front()));
  }
  return headers;
}

void WriteParts(Imf::MultiPartOutputFile& file, const std::vector<ExrPart>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Imf::OutputPart output(file, static_cast<int>(i));
    WritePart(output, parts[i]);
  }
}

// A file in memory: what OpenEXR writes to a disk when it closes a file, and that it
// couldn't, it tells nobody.
class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("memory") {}
  void write(const char bytes[], int n) override {
    const auto count = static_cast<std::size_t>(n);
    bytes_.resize(std::max(bytes_.size(), position_ + count));
    std::copy(
        bytes, bytes + n, bytes_.begin() + static_cast<std::ptrdiff_t>(position_));
    position_ += count;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  std::string Take() && { return std::move(bytes_); }

 private:
  std::size_t position_ = 0;
  std::string bytes_;
};

class MemoryReader : public Imf::IStream {
 public:
  explicit MemoryReader(const std::string& bytes)
      : Imf::IStream("memory"), bytes_(bytes) {}
  bool read(char to[], int n) override {
    const auto count = static_cast<std::size_t>(n);
    if (position_ + count > bytes_.size()) {
      throw BadData("ends too early");
    }
    std::copy_n(bytes_.data() + position_, count, to);
    position_ += count;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  const std::string& bytes_;
  std::size_t position_ = 0;
};

// OpenEXR leaves out what it couldn't pack for want of memory, and says nothing.
void RequireWhole(const std::string& bytes) {
  MemoryReader stream(bytes);
  Imf::MultiPartInputFile file(stream, 0, /*reconstructChunkOffsetTable=*/false);
  for (int part = 0; part < file.parts(); ++part) {
    if (!file.partComplete(part)) {
      throw std::bad_alloc();
    }
  }
}

std::string Encode(const std::vector<ExrPart>& parts) {
  const std::vector<Imf::Header> headers = HeadersOf(parts);
  MemoryStream stream;
  {
    Imf::MultiPartOutputFile output(
        stream, headers.data(), static_cast<int>(headers.size()));
    WriteParts(output, parts);
  }
  std::string bytes = std::move(stream).Take();
  RequireWhole(bytes);
  return bytes;
}

// Alphabetical, but R, G, B (and X, Y, Z as they are) in the order people think of
// them.
std::vector<std::string> ChannelNames(const Imf::Header& header) {
  std::vector<std::string> names;
  for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
    names.emplace_back(i.name());
  }
  const auto rank = [](const std::string& name) {
    return name == "R" ? 0 : name == "G" ? 1 : name == "B" ? 2 : 3;
  };
  std::stable_sort(names.begin(), names.end(), [&](const auto& a, const auto& b) {
    return rank(a) < rank(b);
  });
  return names;
}

// The part without its values.
ExrPart ReadHeader(const Imf::Header& header, std::size_t& bytes_left) {
  const Imath::Box2i& window = header.dataWindow();
  ExrPart part;
  part.name = header.hasName() ? header.name() : std::string();
  part.width = window.max.x - window.min.x + 1;
  part.height = window.max.y - window.min.y + 1;
  part.channels = ChannelNames(header);
  for (auto i = header.begin(); i != header.end(); ++i) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&i.attribute())) {
      part.attributes[i.name()] = text->value();
    }
  }
  const double bytes =
      4.0 * part.width * part.height * static_cast<double>(part.channels.size());
  if (bytes > static_cast<double>(bytes_left)) {
    throw BadData(fmt::format(
        "declares {} x {} pixels of {} channels: more than the memory allowed",
        part.width,
        part.height,
        part.channels.size()));
  }
  bytes_left -= static_cast<std::size_t>(bytes);
  return part;
}

Error NotReadable(const std::filesystem::path& path, const std::exception& e) {
  return BadData(path.string() + ": not a readable OpenEXR file: " + e.what());
}

}  // namespace

int ExrPart::FindChannel(const std::string& channel) const {
  const auto found = std::find(channels.begin(), channels.end(), channel);
  return found == channels.end() ? -1 : static_cast<int>(found - channels.begin());
}

void WriteExr(const std::filesystem::path& path, const std::vector<ExrPart>& parts) {
  std::string bytes;
  try {
    bytes = Encode(parts);
  } catch (const std::exception& e) {
    throw Error("cannot write " + path.string() + ": " + e.what());
  }
  WriteFile(path, bytes);
}

std::int64_t ExrFileBytes(const std::vector<ExrPart>& parts) {
  return static_cast<std::int64_t>(Encode(parts).size());
}

struct ExrReader::File {
  explicit File(const std::filesystem::path& path) : file(path.c_str()) {}
  Imf::MultiPartInputFile file;
};

ExrReader::ExrReader(std::filesystem::path path, std::size_t max_bytes)
    : path_(std::move(path)) {
  if (!std::filesystem::exists(path_)) {
    throw Error("cannot read " + path_.string() + ": there is no such file");
  }
  CheckExrSizes(path_);
  // More than what deflate can pack, and half floats become floats.
  constexpr std::size_t kMaxPacking = 2 * 1032;
  max_bytes = std::min(max_bytes, kMaxPacking * std::filesystem::file_size(path_));
  try {
    file_ = std::make_unique<File>(path_);
    for (int i = 0; i < file_->file.parts(); ++i) {
      parts_.push_back(ReadHeader(file_->file.header(i), max_bytes));
    }
  } catch (const std::exception& e) {
    throw NotReadable(path_, e);
  }
}

ExrReader::~ExrReader() = default;

ExrPart ExrReader::Read(std::size_t index) {
  ExrPart part = parts_[index];
  part.values.resize(part.PixelCount() * part.channels.size());
  try {
    Imf::InputPart input(file_->file, static_cast<int>(index));
    const Imath::Box2i window = input.header().dataWindow();
    input.setFrameBuffer(
        BufferOf(part, Imf::FLOAT, part.values.data(), window.min.x, window.min.y));
    input.readPixels(window.min.y, window.max.y);
  } catch (const std::exception& e) {
    throw NotReadable(path_, e);
  }
  return part;
}

std::vector<ExrPart> ReadExr(const std::filesystem::path& path, std::size_t max_bytes) {
  ExrReader reader(path, max_bytes);
  std::vector<ExrPart> parts;
  for (std::size_t i = 0; i < reader.parts().size(); ++i) {
    parts.push_back(reader.Read(i));
  }
  return parts;
}

const ExrPart& FindPart(const std::vector<ExrPart>& parts,
                        const std::string& name,
                        const std::filesystem::path& path) {
  for (const ExrPart& part : parts) {
    if (part.name == name) {
      return part;
    }
  }
  throw BadData(fmt::format("{}: has no part '{}'", path.string(), name));
}

}  // namespace nacre
