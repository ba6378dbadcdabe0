#include "core/png.h"

#include "core/atomic_file.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <png.h>

namespace nacre {
namespace {

constexpr int kMaxSide = 1 << 16;

// libpng reports errors through callbacks that must not return: throw from there.
[[noreturn]] void Fail(png_structp png, png_const_charp message) {
  const auto* origin = static_cast<const std::string*>(png_get_error_ptr(png));
  throw BadData(*origin + ": not a readable PNG: " + message);
}

void Ignore(png_structp, png_const_charp) {
}  // warnings concern chunks that we don't use

struct Source {
  std::span<const char> rest;
};

void ReadBytes(png_structp png, png_bytep out, png_size_t size) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (source->rest.size() < size) {
    png_error(png, "the file is truncated");
  }
  std::memcpy(out, source->rest.data(), size);
  source->rest = source->rest.subspan(size);
}

void WriteBytes(png_structp png, png_bytep data, png_size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))
      ->append(static_cast<const char*>(static_cast<const void*>(data)), size);
}

void Flush(png_structp) {}

struct Reader {
  explicit Reader(std::string* origin)
      : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, origin, Fail, Ignore)),
        info(png_create_info_struct(png)) {}
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  png_structp png;
  png_infop info;
};

struct Writer {
  explicit Writer(std::string* origin)
      : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, origin, Fail, Ignore)),
        info(png_create_info_struct(png)) {}
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  png_structp png;
  png_infop info;
};

int ColorType(int channel_count) {
  switch (channel_count) {
    case 1:
      return PNG_COLOR_TYPE_GRAY;
    case 2:
      return PNG_COLOR_TYPE_GRAY_ALPHA;
    case 3:
      return PNG_COLOR_TYPE_RGB;
    case 4:
      return PNG_COLOR_TYPE_RGB_ALPHA;
    default:
      throw LogicError("a PNG has 1 to 4 channels");
  }
}

}  // namespace

std::string EncodePng(const PngImage& image, int compression) {
  Expect(image.bit_depth == 8 || image.bit_depth == 16, "8 or 16 bits");
  const auto row_values = static_cast<std::size_t>(image.width) *
                          static_cast<std::size_t>(image.channel_count);
  Expect(image.values.size() == row_values * static_cast<std::size_t>(image.height),
         "width * height * channel_count values");
  std::string origin = "PNG in memory";
  std::string bytes;
  const Writer writer(&origin);
  png_set_write_fn(writer.png, &bytes, WriteBytes, Flush);
  png_set_compression_level(writer.png, compression);
  png_set_IHDR(writer.png,
               writer.info,
               static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height),
               image.bit_depth,
               ColorType(image.channel_count),
               PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  const std::size_t bytes_a_value = image.bit_depth == 16 ? 2 : 1;
  std::vector<png_byte> row(row_values * bytes_a_value);
  for (int y = 0; y < image.height; ++y) {
    const std::uint16_t* values =
        &image.values[static_cast<std::size_t>(y) * row_values];
    for (std::size_t i = 0; i < row_values; ++i) {
      if (bytes_a_value == 2) {  // PNG is big endian
        row[2 * i] = static_cast<png_byte>(values[i] >> 8);
        row[2 * i + 1] = static_cast<png_byte>(values[i] & 0xFF);
      } else {
        row[i] = static_cast<png_byte>(values[i]);
      }
    }
    png_write_row(writer.png, row.data());
  }
  png_write_end(writer.png, writer.info);
  return bytes;
}

void WritePng(const std::filesystem::path& path,
              const PngImage& image,
              int compression) {
  WriteFile(path, EncodePng(image, compression));
}

PngImage DecodePng(std::span<const char> bytes, const std::string& origin) {
  std::string name = origin;
  const Reader reader(&name);
  Source source{bytes};
  png_set_read_fn(reader.png, &source, ReadBytes);
  png_set_user_limits(reader.png, kMaxSide, kMaxSide);
  png_read_info(reader.png, reader.info);
  png_set_palette_to_rgb(reader.png);
  png_set_expand_gray_1_2_4_to_8(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  PngImage image{
      .width = static_cast<int>(png_get_image_width(reader.png, reader.info)),
      .height = static_cast<int>(png_get_image_height(reader.png, reader.info)),
      .channel_count = png_get_channels(reader.png, reader.info),
      .bit_depth = png_get_bit_depth(reader.png, reader.info),
      .values = {}};
  // A pixel takes at least a 1000th of a byte when packed by zlib: refuse bombs.
  const auto row_bytes = png_get_rowbytes(reader.png, reader.info);
  const auto all_bytes = row_bytes * static_cast<std::size_t>(image.height);
  if (all_bytes / 1100 > bytes.size()) {
    throw BadData(
        fmt::format("{}: declares {} x {} pixels, but the file is too short for them",
                    origin,
                    image.width,
                    image.height));
  }
  std::vector<png_byte> packed(all_bytes);
  std::vector<png_bytep> rows(static_cast<std::size_t>(image.height));
  for (std::size_t y = 0; y < rows.size(); ++y) {
    rows[y] = &packed[y * row_bytes];
  }
  png_read_image(reader.png, rows.data());
  const std::size_t value_count = static_cast<std::size_t>(image.width) *
                                  static_cast<std::size_t>(image.height) *
                                  static_cast<std::size_t>(image.channel_count);
  image.values.resize(value_count);
  for (std::size_t i = 0; i < value_count; ++i) {
    image.values[i] =
        image.bit_depth == 16
            ? static_cast<std::uint16_t>(packed[2 * i] << 8 | packed[2 * i + 1])
            : packed[i];
  }
  return image;
}

PngImage ReadPng(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path);
  return DecodePng(bytes, path.string());
}

std::uint8_t SrgbFromLinear(float linear) {
  const float x = linear > 0 ? std::min(linear, 1.0F) : 0.0F;  // NaN compares false
  const float srgb =
      x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(srgb * 255 + 0.5F);
}

float LinearFromSrgb(float srgb) {
  return srgb <= 0.04045F ? srgb / 12.92F : std::pow((srgb + 0.055F) / 1.055F, 2.4F);
}

}  // namespace nacre
