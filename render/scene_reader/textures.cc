#include "core/exr.h"
#include "core/png.h"
#include "render/scene_reader/objects.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace nacre::render {
namespace {

// `toUV` first, then Mitsuba 0.6's scales and offsets.
UvMap ReadUvMap(Element& element) {
  const Transform to_uv = element.TransformOf("toUV");
  const auto scale_u = static_cast<float>(element.Float("uscale", 1));
  const auto scale_v = static_cast<float>(element.Float("vscale", 1));
  const Vec3 u = to_uv.Vector({1, 0, 0});
  const Vec3 v = to_uv.Vector({0, 1, 0});
  const Vec3 origin = to_uv.Point({0, 0, 0});
  UvMap map;
  map.along_u = {u.x * scale_u, u.y * scale_v};
  map.along_v = {v.x * scale_u, v.y * scale_v};
  map.offset = {origin.x * scale_u + static_cast<float>(element.Float("uoffset", 0)),
                origin.y * scale_v + static_cast<float>(element.Float("voffset", 0))};
  return map;
}

// −1 stands for sRGB, as in Mitsuba.
float Linearise(float value, double gamma) {
  if (gamma == -1) {
    return LinearFromSrgb(value);
  }
  return gamma == 1 ? value : std::pow(value, static_cast<float>(gamma));
}

Bitmap FromPng(const std::filesystem::path& path, double gamma) {
  const PngImage image = ReadPng(path);
  const float scale = 1.0F / static_cast<float>((1 << image.bit_depth) - 1);
  const auto channels = static_cast<std::size_t>(image.channel_count);
  Bitmap bitmap{image.width, image.height, {}};
  for (std::size_t i = 0; i < image.values.size(); i += channels) {
    const auto value = [&](std::size_t channel) {
      return Linearise(scale * static_cast<float>(image.values[i + channel]), gamma);
    };
    const bool grey = channels < 3;
    bitmap.pixels.push_back(
        {value(0), grey ? value(0) : value(1), grey ? value(0) : value(2)});
  }
  return bitmap;
}

Bitmap FromExr(const std::filesystem::path& path, double gamma) {
  const ExrPart part = ReadExr(path).front();
  int r = part.FindChannel("R");
  int g = part.FindChannel("G");
  int b = part.FindChannel("B");
  if (r < 0 || g < 0 || b < 0) {
    r = std::max(0, part.FindChannel("Y"));
    g = r;
    b = r;
  }
  Bitmap bitmap{part.width, part.height, {}};
  for (std::size_t i = 0; i < part.PixelCount(); ++i) {
    const auto value = [&](int channel) {
      return Linearise(part.Channel(static_cast<std::size_t>(channel))[i], gamma);
    };
    bitmap.pixels.push_back({value(r), value(g), value(b)});
  }
  return bitmap;
}

void CheckPixels(Element& element, const Bitmap& bitmap) {
  for (std::size_t i = 0; i < bitmap.pixels.size(); ++i) {
    const Color c = bitmap.pixels[i];
    if (!(c.x >= 0 && c.y >= 0 && c.z >= 0 && std::isfinite(c.x + c.y + c.z))) {
      const auto width = static_cast<std::size_t>(bitmap.width);
      element.FailAt(
          "filename",
          fmt::format(
              "pixel ({}, {}) is negative or not finite", i % width, i / width));
    }
  }
}

WrapMode ReadWrapMode(Element& element, const char* name, const std::string& mode) {
  const std::map<std::string, WrapMode> modes = {{"repeat", WrapMode::kRepeat},
                                                 {"mirror", WrapMode::kMirror},
                                                 {"clamp", WrapMode::kClamp},
                                                 {"zero", WrapMode::kZero},
                                                 {"one", WrapMode::kOne}};
  const auto found = modes.find(mode);
  if (found == modes.end()) {
    element.FailAt(
        name,
        fmt::format("no wrap mode '{}'{}",
                    mode,
                    Suggestion(mode, {"repeat", "mirror", "clamp", "zero", "one"})));
  }
  return found->second;
}

// Another texture times a number or a colour.
TexturePtr ReadScaled(Element& element) {
  const bool number = element.node().find_child_by_attribute("float", "name", "scale");
  const auto factor = static_cast<float>(number ? element.Float("scale", 1) : 1);
  const Color color =
      number ? Color{factor, factor, factor} : element.Spectrum("scale", {1, 1, 1});
  if (!(std::min({color.x, color.y, color.z}) >= 0)) {
    element.FailAt("scale", "a texture can't be scaled by less than 0");
  }
  std::vector<TexturePtr> found;
  for (const Element& child : element.Objects("texture")) {
    found.push_back(ReadTexture(child));
  }
  for (const Element& ref : element.Objects("ref")) {
    found.push_back(FindById(
        element.document(), ref.node(), element.document().textures, "texture"));
  }
  if (found.size() != 1) {
    element.Fail("a scale texture holds one texture");
  }
  return MakeProduct(found.front(), MakeConstant(color));
}

TexturePtr ReadBitmap(Element& element) {
  BitmapOptions options;
  options.map = ReadUvMap(element);
  const std::string both = element.String("wrapMode", "repeat");
  options.wrap_u =
      ReadWrapMode(element, "wrapModeU", element.String("wrapModeU", both));
  options.wrap_v =
      ReadWrapMode(element, "wrapModeV", element.String("wrapModeV", both));
  options.nearest = element.String("filterType", "bilinear") == "nearest";
  element.Ignore("maxAnisotropy", "pictures are interpolated bilinearly");
  element.Ignore("cache", "pictures are held in memory");

  return MakeBitmap(ReadPicture(element), options);
}

}  // namespace

Bitmap ReadPicture(Element& element) {
  const std::string name = element.String("filename", "");
  if (name.empty()) {
    element.Fail(fmt::format("{} needs a <string name=\"filename\">", element.type()));
  }
  const std::filesystem::path path = element.document().File(element.node(), name);
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  if (extension != ".png" && extension != ".exr") {
    element.FailAt("filename",
                   fmt::format("'{}' is neither .png nor .exr: convert it", name));
  }
  const bool png = extension == ".png";
  const double gamma = element.Float("gamma", png ? -1 : 1);
  if (gamma != -1 && !(gamma > 0)) {
    element.FailAt("gamma", "gamma must be above 0, or -1 for sRGB");
  }
  Bitmap bitmap = png ? FromPng(path, gamma) : FromExr(path, gamma);
  CheckPixels(element, bitmap);
  return bitmap;
}

TexturePtr ReadTexture(Element element) {
  const std::string type = element.type();
  TexturePtr texture;
  if (type == "checkerboard") {
    const UvMap map = ReadUvMap(element);
    texture = MakeCheckerboard(element.Spectrum("color0", {0.4F, 0.4F, 0.4F}),
                               element.Spectrum("color1", {0.2F, 0.2F, 0.2F}),
                               map);
  } else if (type == "bitmap") {
    texture = ReadBitmap(element);
  } else if (type == "scale") {
    texture = ReadScaled(element);
  } else {
    UnknownPlugin(element, {"bitmap", "checkerboard", "scale"});
    return MakeConstant({0.5F, 0.5F, 0.5F});
  }
  element.Finish();
  return texture;
}

}  // namespace nacre::render
