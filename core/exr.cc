#include "core/exr.h"

#include "core/atomic_file.h"
#include "core/error.h"

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

// All parts of a file share one display window, so that of the first serves for all.
Imf::Header HeaderOf(const ExrPart& part, const ExrPart& first) {
  Imf::Header header(first.width, first.height);
  header.dataWindow() = Imath::Box2i({0, 0}, {part.width - 1, part.height - 1});
  header.compression() =
      part.pixels == ExrPixels::kFloat ? Imf::ZIP_COMPRESSION : Imf::PIZ_COMPRESSION;
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

// Counts what is written to it, and keeps nothing.
class CountingStream : public Imf::OStream {
 public:
  CountingStream() : Imf::OStream("memory") {}
  void write(const char[], int n) override {
    position_ += static_cast<std::uint64_t>(n);
    size_ = std::max(size_, position_);
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  std::uint64_t size() const { return size_; }

 private:
  std::uint64_t position_ = 0;
  std::uint64_t size_ = 0;
};

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

ExrPart ReadPart(Imf::MultiPartInputFile& file, int index, std::size_t& bytes_left) {
  const Imf::Header& header = file.header(index);
  const Imath::Box2i window = header.dataWindow();
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
  part.values.resize(part.PixelCount() * part.channels.size());
  Imf::InputPart input(file, index);
  input.setFrameBuffer(
      BufferOf(part, Imf::FLOAT, part.values.data(), window.min.x, window.min.y));
  input.readPixels(window.min.y, window.max.y);
  return part;
}

}  // namespace

int ExrPart::FindChannel(const std::string& channel) const {
  const auto found = std::find(channels.begin(), channels.end(), channel);
  return found == channels.end() ? -1 : static_cast<int>(found - channels.begin());
}

void WriteExr(const std::filesystem::path& path, const std::vector<ExrPart>& parts) {
  const std::vector<Imf::Header> headers = HeadersOf(parts);
  AtomicFile file(path);
  try {
    Imf::MultiPartOutputFile output(file.temporary_path().c_str(),
                                    headers.data(),
                                    static_cast<int>(headers.size()));
    WriteParts(output, parts);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw Error("cannot write " + path.string() + ": " + e.what());
  }
  file.Commit();
}

std::int64_t ExrFileBytes(const std::vector<ExrPart>& parts) {
  const std::vector<Imf::Header> headers = HeadersOf(parts);
  CountingStream stream;
  {
    Imf::MultiPartOutputFile output(
        stream, headers.data(), static_cast<int>(headers.size()));
    WriteParts(output, parts);
  }
  return static_cast<std::int64_t>(stream.size());
}

std::vector<ExrPart> ReadExr(const std::filesystem::path& path, std::size_t max_bytes) {
  if (!std::filesystem::exists(path)) {
    throw Error("cannot read " + path.string() + ": there is no such file");
  }
  try {
    Imf::MultiPartInputFile file(path.c_str());
    std::vector<ExrPart> parts;
    std::size_t bytes_left = max_bytes;
    for (int i = 0; i < file.parts(); ++i) {
      parts.push_back(ReadPart(file, i, bytes_left));
    }
    return parts;
  } catch (const std::exception& e) {
    throw BadData(path.string() + ": not a readable OpenEXR file: " + e.what());
  }
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
