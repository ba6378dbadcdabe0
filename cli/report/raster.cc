#include "cli/report/raster.h"

#include "cli/report/color_map.h"
#include "cli/report/html.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::cli::report {
namespace {

template <class Color>
PngImage Paint(const Plane& plane, Color&& color) {
  PngImage image{plane.width, plane.height, 3, 8, {}};
  image.values.reserve(plane.values.size() * 3);
  for (const float value : plane.values) {
    for (const std::uint8_t part : color(static_cast<double>(value))) {
      image.values.push_back(part);
    }
  }
  return image;
}

}  // namespace

PngImage LogImage(const Plane& plane, double low, double high) {
  const double range = std::log(high / low);
  return Paint(plane, [&](double value) {
    return SequentialColor(std::log(std::max(value, low) / low) / range);
  });
}

PngImage LinearImage(const Plane& plane, double low, double high) {
  const double range = high > low ? high - low : 1;
  return Paint(plane,
               [&](double value) { return SequentialColor((value - low) / range); });
}

PngImage DivergingImage(const Plane& plane, double limit) {
  if (limit == 0) {
    for (const float value : plane.values) {
      limit = std::max(limit, static_cast<double>(std::abs(value)));
    }
  }
  return Paint(plane, [&](double value) {
    return DivergingColor(limit > 0 ? value / limit : 0);
  });
}

PngImage ColorImage(const std::vector<Plane>& channels, double gain) {
  PngImage image{channels[0].width, channels[0].height, 3, 8, {}};
  for (std::size_t n = 0; n < channels[0].values.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Plane& plane = channels[std::min(c, channels.size() - 1)];
      image.values.push_back(
          SrgbFromLinear(plane.values[n] * static_cast<float>(gain)));
    }
  }
  return image;
}

OwnedPlane Shrink(const Plane& plane, int max_side) {
  const int n = (std::max(plane.width, plane.height) + max_side - 1) / max_side;
  OwnedPlane small{std::max(1, plane.width / n), std::max(1, plane.height / n), {}};
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      double sum = 0;
      int count = 0;
      for (int v = y * n; v < std::min((y + 1) * n, plane.height); ++v) {
        for (int u = x * n; u < std::min((x + 1) * n, plane.width); ++u) {
          sum += static_cast<double>(
              plane.values[static_cast<std::size_t>(v) *
                               static_cast<std::size_t>(plane.width) +
                           static_cast<std::size_t>(u)]);
          ++count;
        }
      }
      small.values.push_back(static_cast<float>(sum / count));
    }
  }
  return small;
}

std::string ColorScale(const std::string& low,
                       const std::string& high,
                       bool diverging) {
  std::vector<float> ramp(128);
  for (std::size_t n = 0; n < ramp.size(); ++n) {
    ramp[n] = static_cast<float>(n) / 127.0F;
  }
  const Plane plane{128, 1, ramp};
  const PngImage image =
      diverging ? Paint(plane, [](double t) { return DivergingColor(2 * t - 1); })
                : LinearImage(plane, 0, 1);
  return fmt::format("<div class=\"scale\"><span>{}</span>{}<span>{}</span></div>",
                     low,
                     ImageTag(image, "colour scale"),
                     high);
}

}  // namespace nacre::cli::report
