#include "calibrate/internal/corrections_json.h"

#include "calibrate/internal/json_numbers.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>

namespace nacre::calibrate::internal {
namespace {

Json ToJson(const SmoothField& field) {
  return Json{{"degree", field.degree},
              {"coefficients", field.coefficients},
              {"sigma", field.sigma}};
}

SmoothField FieldFromJson(const Json& json,
                          const std::string& origin,
                          double value_if_empty) {
  SmoothField field{.value_if_empty = value_if_empty};
  constexpr int kMaxDegree = 16;
  field.degree = static_cast<int>(Number(json, "degree", origin, {0, kMaxDegree}));
  field.coefficients = List(json, "coefficients", origin);
  field.sigma = Number(json, "sigma", origin, kNotNegative);
  const auto terms =
      static_cast<std::size_t>((field.degree + 1) * (field.degree + 2) / 2);
  if (!field.empty() && field.coefficients.size() != terms) {
    throw BadData(
        fmt::format("{}: field 'coefficients' holds {} of the {} of degree {}",
                    origin,
                    field.coefficients.size(),
                    terms,
                    field.degree));
  }
  return field;
}

Json ToJson(const Glare& glare) {
  return Json{{"radius_px", glare.radius_px},
              {"density_per_px2", glare.density_per_px2},
              {"sigma_per_px2", glare.sigma_per_px2},
              {"fraction", glare.fraction},
              {"fraction_sigma", glare.fraction_sigma}};
}

Glare GlareFromJson(const Json& json, const std::string& origin) {
  Glare glare;
  glare.radius_px = List(json, "radius_px", origin);
  glare.density_per_px2 = List(json, "density_per_px2", origin);
  glare.sigma_per_px2 = List(json, "sigma_per_px2", origin);
  glare.fraction = Number(json, "fraction", origin, {0, 1});
  glare.fraction_sigma = Number(json, "fraction_sigma", origin, kNotNegative);
  double least_px = 0;
  for (const double radius_px : glare.radius_px) {
    if (!(radius_px > least_px)) {
      throw BadData(origin + ": field 'radius_px' must ascend from above zero");
    }
    least_px = radius_px;
  }
  for (const double density : glare.density_per_px2) {
    if (!(density >= 0)) {
      throw BadData(origin + ": field 'density_per_px2' must not be negative");
    }
  }
  if (glare.density_per_px2.size() != glare.radius_px.size() ||
      glare.sigma_per_px2.size() != glare.radius_px.size()) {
    throw BadData(origin + ": 'radius_px' and what belongs to it differ in length");
  }
  return glare;
}

Json HotPixelsToJson(const std::vector<HotPixel>& pixels) {
  Json list = Json::array();
  for (const HotPixel& pixel : pixels) {
    list.push_back({pixel.index, pixel.rate_counts_per_us});
  }
  return list;
}

std::vector<HotPixel> HotPixelsFromJson(const Json& json,
                                        const std::string& origin,
                                        std::int64_t pixel_count) {
  std::vector<HotPixel> pixels;
  std::int64_t last = -1;
  for (const auto& [index, rate] :
       Get<std::vector<std::pair<std::int64_t, double>>>(json, "hot_pixels", origin)) {
    if (index <= last || index >= pixel_count || !std::isfinite(rate)) {
      throw BadData(origin +
                    ": field 'hot_pixels' must ascend and stay within the picture");
    }
    pixels.push_back({static_cast<std::int32_t>(index), rate});
    last = index;
  }
  return pixels;
}

Json SpotsToJson(const std::vector<SpotProfile>& spots) {
  Json list = Json::array();
  for (const SpotProfile& spot : spots) {
    list.push_back({{"xx_mm2", spot.xx_mm2},
                    {"xy_mm2", spot.xy_mm2},
                    {"yy_mm2", spot.yy_mm2},
                    {"sigma_mm2", spot.sigma_mm2}});
  }
  return list;
}

std::vector<SpotProfile> SpotsFromJson(const Json& json, const std::string& origin) {
  std::vector<SpotProfile> spots;
  for (const Json& spot : json) {
    spots.push_back({.xx_mm2 = Number(spot, "xx_mm2", origin),
                     .xy_mm2 = Number(spot, "xy_mm2", origin),
                     .yy_mm2 = Number(spot, "yy_mm2", origin),
                     .sigma_mm2 = Number(spot, "sigma_mm2", origin, kNotNegative)});
  }
  return spots;
}

Json ToJson(const ColourFilters& filters) {
  return Json{{"mosaic", filters.mosaic},
              {"white", filters.white},
              {"ambient", filters.ambient},
              {"lasers", filters.lasers}};
}

std::array<double, 3> SharesFromJson(const Json& json,
                                     const char* key,
                                     const std::string& origin) {
  const std::vector<double> values = List(json, key, origin);
  std::array<double, 3> shares{};
  if (values.size() != shares.size() ||
      !std::all_of(
          values.begin(), values.end(), [](double x) { return x >= 0 && x <= 1; }) ||
      *std::max_element(values.begin(), values.end()) <= 0) {
    throw BadData(fmt::format(
        "{}: field '{}' must hold what red, green and blue pixels see, 0 to 1",
        origin,
        key));
  }
  std::copy(values.begin(), values.end(), shares.begin());
  return shares;
}

// Files before there were mosaics have none of it.
ColourFilters FiltersFromJson(const Json& json,
                              const std::string& origin,
                              std::size_t channel_count) {
  ColourFilters filters;
  filters.mosaic = Get<std::string>(json, "mosaic", origin);
  if (filters.mosaic.empty()) {
    return filters;
  }
  constexpr std::array<const char*, 4> kMosaics = {"RGGB", "GRBG", "GBRG", "BGGR"};
  if (std::find(kMosaics.begin(), kMosaics.end(), filters.mosaic) == kMosaics.end()) {
    throw BadData(fmt::format(
        "{}: field 'mosaic': '{}' is no mosaic of colours", origin, filters.mosaic));
  }
  filters.white = SharesFromJson(json, "white", origin);
  filters.ambient = SharesFromJson(json, "ambient", origin);
  for (const Json& laser : Get<Json>(json, "lasers", origin)) {
    filters.lasers.push_back(SharesFromJson(Json{{"lasers", laser}}, "lasers", origin));
  }
  if (filters.lasers.size() != channel_count) {
    throw BadData(fmt::format("{}: field 'lasers' holds {} of {} channels",
                              origin,
                              filters.lasers.size(),
                              channel_count));
  }
  return filters;
}

Json WarningsToJson(const std::vector<Warning>& warnings) {
  Json list = Json::array();
  for (const Warning& warning : warnings) {
    list.push_back({{"name", warning.name}, {"text", warning.text}});
  }
  return list;
}

std::vector<Warning> WarningsFromJson(const Json& json, const std::string& origin) {
  std::vector<Warning> warnings;
  for (const Json& warning : json) {
    warnings.push_back({.name = Get<std::string>(warning, "name", origin),
                        .text = Get<std::string>(warning, "text", origin)});
  }
  return warnings;
}

}  // namespace

Json ToJson(const Corrections& c) {
  return Json{{"filters", ToJson(c.filters)},
              {"linearity",
               {{"b1_per_count", c.linearity.b1_per_count},
                {"b2_per_count2", c.linearity.b2_per_count2},
                {"sigma_at_saturation", c.linearity.sigma_at_saturation}}},
              {"flat_field", ToJson(c.flat_field)},
              {"ambient", ToJson(c.ambient)},
              {"hot_pixels", HotPixelsToJson(c.hot_pixels)},
              {"dark_spread_counts_per_us", c.dark_spread_counts_per_us},
              {"row_noise_counts", c.row_noise_counts},
              {"glare", ToJson(c.glare)},
              {"blooming_reach_px", c.blooming.reach_px},
              {"blooming_side_reach_px", c.blooming.side_reach_px},
              {"spots", SpotsToJson(c.spots)},
              {"ripple", c.light_noise.ripple},
              {"ripple_sigma", c.light_noise.ripple_sigma},
              {"speckle_contrast", c.light_noise.speckle_contrast},
              {"hysteresis",
               {{"x_rad", c.hysteresis.x_rad},
                {"y_rad", c.hysteresis.y_rad},
                {"sigma_rad", c.hysteresis.sigma_rad}}},
              {"warnings", WarningsToJson(c.warnings)}};
}

Corrections CorrectionsFromJson(const Json& json,
                                const std::string& origin,
                                std::int64_t pixel_count,
                                std::size_t channel_count) {
  const auto part = [&](const char* key) { return Get<Json>(json, key, origin); };
  const auto number = [&](const char* key) {
    return Number(json, key, origin, kNotNegative);
  };
  constexpr Range kReachPx{0, 1 << 16};
  Corrections c;
  if (json.contains("filters")) {
    c.filters = FiltersFromJson(part("filters"), origin + ": filters", channel_count);
  }
  const Json linearity = part("linearity");
  c.linearity = {.b1_per_count = Number(linearity, "b1_per_count", origin),
                 .b2_per_count2 = Number(linearity, "b2_per_count2", origin),
                 .sigma_at_saturation =
                     Number(linearity, "sigma_at_saturation", origin, kNotNegative)};
  c.flat_field = FieldFromJson(part("flat_field"), origin + ": flat_field", 1);
  c.ambient = FieldFromJson(part("ambient"), origin + ": ambient", 0);
  c.hot_pixels = HotPixelsFromJson(json, origin, pixel_count);
  c.dark_spread_counts_per_us = number("dark_spread_counts_per_us");
  c.row_noise_counts = number("row_noise_counts");
  c.glare = GlareFromJson(part("glare"), origin + ": glare");
  c.blooming = {
      .reach_px = static_cast<int>(Number(json, "blooming_reach_px", origin, kReachPx)),
      .side_reach_px =
          static_cast<int>(Number(json, "blooming_side_reach_px", origin, kReachPx))};
  c.spots = SpotsFromJson(part("spots"), origin + ": spots");
  c.light_noise = {.ripple = number("ripple"),
                   .ripple_sigma = number("ripple_sigma"),
                   .speckle_contrast = number("speckle_contrast")};
  const Json hysteresis = part("hysteresis");
  c.hysteresis = {.x_rad = Number(hysteresis, "x_rad", origin),
                  .y_rad = Number(hysteresis, "y_rad", origin),
                  .sigma_rad = Number(hysteresis, "sigma_rad", origin, kNotNegative)};
  c.warnings = WarningsFromJson(part("warnings"), origin + ": warnings");
  return c;
}

}  // namespace nacre::calibrate::internal
