// Writes *.nacre.exr (internal/material_layout.h).

#include "core/error.h"
#include "core/exr.h"
#include "core/json.h"
#include "factor/internal/material_codes.h"
#include "factor/internal/material_layout.h"
#include "factor/material.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::factor {
namespace {

template <class T>
ExrPart ToPart(const internal::PartPlan& plan, const T* values) {
  const internal::Sheet& sheet = plan.sheet;
  ExrPart part{plan.name,
               sheet.width * sheet.columns,
               sheet.height * sheet.rows,
               plan.channels,
               std::vector<float>(sheet.Size()),
               {}};
  sheet.ForEach([&](std::size_t in_sheet, std::size_t in_material) {
    part.values[in_sheet] = static_cast<float>(values[in_material]);
  });
  return part;
}

bool FitsHalf(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) {
    return value <= 65504 && internal::RoundToHalf(value) == value;
  });
}

std::string Exact(double value) {
  return fmt::format("{}", value);  // the shortest text that reads back the same
}

std::string Join(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) {
    list.push_back(Exact(value));
  }
  return list.dump();
}

ExrAttributes AttributesOf(const Material& m) {
  Json error = Json::object();
  for (const auto& [key, value] : m.error) {
    error[key] = Exact(value);
  }
  Json curve = Json::array();
  for (const TermsError& point : m.error_curve) {
    curve.push_back({point.terms, Exact(point.relative_l2), Exact(point.log_rms)});
  }
  return {{"nacre.format", internal::kFormat},
          {"nacre.version", internal::kVersion},
          {"nacre.method", m.method},
          {"nacre.form", Name(m.form)},
          {"nacre.margin", std::to_string(m.margin)},
          {"nacre.taps", std::to_string(m.taps)},
          {"nacre.order", std::to_string(m.order)},
          {"nacre.rest", std::to_string(m.rest)},
          {"nacre.sides", std::to_string(m.sides)},
          {"nacre.grey", m.is_grey ? "1" : "0"},
          {"nacre.transform", Name(m.transform)},
          {"nacre.points", fmt::format("{} {}", m.points_x, m.points_y)},
          {"nacre.core", std::to_string(m.core)},
          {"nacre.terms", std::to_string(m.terms)},
          {"nacre.clusters", std::to_string(m.cluster_count)},
          {"nacre.pitch_mm", Exact(m.pitch_mm)},
          {"nacre.eta", Exact(m.eta)},
          {"nacre.units", "mm^-2"},
          {"nacre.channels", Json(m.channels).dump()},
          {"nacre.a", Join(m.a)},
          {"nacre.b", Join(m.b)},
          {"nacre.error", error.dump()},
          {"nacre.error_curve", curve.dump()},
          {"nacre.provenance", m.provenance}};
}

// OpenEXR sorts channels by name and core/exr.h puts R, G, B first again; the checksum
// is over the order that a reader will find.
std::vector<std::string> FileOrder(std::vector<std::string> channels) {
  const auto rank = [](const std::string& name) {
    return name == "R" ? 0 : name == "G" ? 1 : name == "B" ? 2 : 3;
  };
  std::sort(channels.begin(), channels.end(), [&](const auto& a, const auto& b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : a < b;
  });
  return channels;
}

void OrderChannels(ExrPart& part) {
  const std::vector<std::string> order = FileOrder(part.channels);
  ExrPart sorted = part;
  for (std::size_t c = 0; c < order.size(); ++c) {
    const auto from = static_cast<std::size_t>(part.FindChannel(order[c]));
    std::copy_n(part.Channel(from), part.PixelCount(), sorted.Channel(c));
  }
  sorted.channels = order;
  part = std::move(sorted);
}

// Numbers as the shortest texts that read back the same.
Json StepsToJson(const Steps& steps, const internal::MaterialCodes& codes) {
  const auto list = [](const std::vector<float>& values) {
    Json texts = Json::array();
    for (const float value : values) {
      texts.push_back(fmt::format("{}", value));
    }
    return texts;
  };
  return {{"f", list(steps.f)},
          {"f_least", Exact(codes.f_least)},
          {"h", list(steps.h)},
          {"h_least", Exact(codes.h_least)},
          {"row_scale", fmt::format("{}", steps.row_scale)}};
}

bool IsNeeded(const internal::PartPlan& plan, const Material& m) {
  switch (plan.kind) {
    case internal::PartKind::kRowScale:
      return std::any_of(m.row_scale.begin(), m.row_scale.end(), [](float scale) {
        return scale != 1;
      });
    case internal::PartKind::kCluster:
      return m.cluster_count > 1;
    case internal::PartKind::kAlbedo:
    case internal::PartKind::kFactors:
    case internal::PartKind::kKernels:
      break;
  }
  return true;
}

// The part of a plan; `codes` are empty without steps.
ExrPart PartOf(const internal::PartPlan& plan,
               const Material& m,
               const internal::MaterialCodes& codes) {
  const bool is_coded = !m.steps.empty();
  const auto values = [&](const std::vector<float>& floats,
                          const std::vector<float>& coded) {
    const std::size_t set =
        plan.channel < 0 ? 0 : static_cast<std::size_t>(plan.channel);
    return (is_coded ? coded : floats).data() + set * plan.sheet.Size();
  };
  ExrPart part;
  switch (plan.kind) {
    case internal::PartKind::kAlbedo:
      part = ToPart(plan, m.albedo.data());
      part.pixels =
          is_coded && FitsHalf(m.albedo) ? ExrPixels::kHalf : ExrPixels::kFloat;
      OrderChannels(part);
      return part;
    case internal::PartKind::kRowScale:
      part = ToPart(plan, values(m.row_scale, codes.row_scale));
      break;
    case internal::PartKind::kFactors:
      part = ToPart(plan, values(m.f, codes.f));
      break;
    case internal::PartKind::kKernels:
      part = ToPart(plan, values(m.h, codes.h));
      break;
    case internal::PartKind::kCluster:
      part = ToPart(plan, m.cluster.data());
      part.pixels = is_coded ? ExrPixels::kCodes : ExrPixels::kFloat;
      return part;
  }
  if (is_coded) {
    part.pixels = ExrPixels::kCodes;
    internal::Fold(plan.sheet, part);
  }
  OrderChannels(part);
  return part;
}

std::vector<ExrPart> ToParts(const Material& m) {
  ExrAttributes attributes = AttributesOf(m);
  internal::MaterialCodes codes;
  if (!m.steps.empty()) {
    codes = internal::Encode(m);
    attributes["nacre.steps"] = StepsToJson(m.steps, codes).dump();
  }
  std::vector<ExrPart> parts;
  Json checksums = Json::object();
  for (const internal::PartPlan& plan : internal::PlanParts(m, false)) {
    if (IsNeeded(plan, m)) {
      parts.push_back(PartOf(plan, m, codes));
      checksums[plan.name] = internal::PartChecksum(parts.back());
    }
  }
  attributes["nacre.parts"] = checksums.dump();
  attributes["nacre.checksum"] = internal::AttributesChecksum(attributes);
  parts[0].attributes = std::move(attributes);
  return parts;
}

}  // namespace

void WriteMaterial(const std::filesystem::path& path, const Material& material) {
  Validate(material, path.string());
  WriteExr(path, ToParts(material));
}

std::int64_t FileBytes(const Material& material) {
  return ExrFileBytes(ToParts(material));
}

}  // namespace nacre::factor
