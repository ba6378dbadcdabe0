#include "render/invariants.h"

#include "core/json.h"
#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace nacre::render {
namespace {

constexpr std::int64_t kMostPlaces = 1024;
constexpr std::int64_t kPlacesOfAnObject = 64;
// Gathering patches as clusters is good to about a per cent.
constexpr double kGatherError = 0.02;

// What leaves beyond what entered, the estimate's error and the models' left aside.
bool GivesTooMuch(const ObjectEnergy& object, std::size_t channel) {
  return object.left[channel] - 3 * object.error[channel] >
         object.entered[channel] * (1 + kGatherError);
}

double Ratio(double left, double entered) {
  return entered > 0 ? left / entered : 0;
}

void AddColor(Color color, double* sums) {
  sums[0] += static_cast<double>(color.x);
  sums[1] += static_cast<double>(color.y);
  sums[2] += static_cast<double>(color.z);
}

bool HasNegativeLobes(FilterKind kind) {
  return kind == FilterKind::kMitchell || kind == FilterKind::kCatmullRom ||
         kind == FilterKind::kLanczos;
}

}  // namespace

void CheckPixels(const ExrPart& image, const Film& film, Invariants& found) {
  const bool may_be_negative = HasNegativeLobes(film.filter);
  const std::size_t pixels = image.values.size() / image.channels.size();
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    bool finite = true;
    bool negative = false;
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
      const float value = image.values[c * pixels + pixel];
      finite = finite && std::isfinite(value);
      negative = negative || value < 0;
    }
    found.not_finite += finite ? 0 : 1;
    found.negative += negative && !may_be_negative ? 1 : 0;
  }
}

void EnergyCheck::Enter(const std::string& name,
                        std::span<const LitPoint> lit,
                        std::int64_t object_count) {
  Object& object = objects_.emplace_back();
  object.energy.name = name;
  for (const LitPoint& point : lit) {
    const auto area = static_cast<double>(point.area_mm2);
    object.area_mm2 += area;
    double density[3] = {};
    AddColor(point.flux_density, density);
    for (std::size_t c = 0; c < 3; ++c) {
      object.energy.entered[c] += density[c] * area;
    }
  }
  // Evenly over the area: a point is taken where the sum of areas passes a step.
  const std::int64_t wanted =
      std::clamp(kMostPlaces / object_count, std::int64_t{1}, kPlacesOfAnObject);
  const double step = object.area_mm2 / static_cast<double>(wanted);
  double next = 0.5 * step;
  double sum = 0;
  for (const LitPoint& point : lit) {
    sum += static_cast<double>(point.area_mm2);
    for (; step > 0 && next < sum; next += step) {
      object.places.push_back(point.point);
    }
  }
}

std::vector<ObjectEnergy> EnergyCheck::Measure(int thread_count) const {
  std::vector<ObjectEnergy> energies;
  for (const Object& object : objects_) {
    std::vector<Color> exitances(object.places.size());
    ParallelFor(std::ssize(exitances), thread_count, [&](std::int64_t n) {
      const auto i = static_cast<std::size_t>(n);
      exitances[i] = object.model->Exitance(object.places[i]);
    });
    ObjectEnergy energy = object.energy;
    const double count = std::max(1.0, static_cast<double>(exitances.size()));
    double mean[3] = {};
    for (const Color& exitance : exitances) {
      AddColor(exitance / static_cast<float>(count), mean);
    }
    double squares[3] = {};
    for (const Color& exitance : exitances) {
      double value[3] = {};
      AddColor(exitance, value);
      for (std::size_t c = 0; c < 3; ++c) {
        squares[c] += (value[c] - mean[c]) * (value[c] - mean[c]);
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      energy.left[c] = mean[c] * object.area_mm2;
      energy.error[c] =
          std::sqrt(squares[c] / std::max(1.0, count - 1) / count) * object.area_mm2;
    }
    energies.push_back(std::move(energy));
  }
  return energies;
}

double Invariants::EnergyRatio() const {
  double most = 0;
  for (const ObjectEnergy& object : objects) {
    for (std::size_t c = 0; c < 3; ++c) {
      most = std::max(most, Ratio(object.left[c], object.entered[c]));
    }
  }
  return most;
}

std::string Invariants::Brief() const {
  const std::size_t warnings = Warnings().size();
  std::string line =
      fmt::format("pixels: {} not finite, {} negative", not_finite, negative);
  if (!objects.empty()) {
    line +=
        fmt::format("; light out of translucent objects: {:.2g} of what enters at most",
                    EnergyRatio());
  }
  return line + (warnings > 0 ? "; NOT AS IT SHOULD BE" : "");
}

std::vector<std::string> Invariants::Warnings() const {
  std::vector<std::string> warnings;
  if (not_finite > 0) {
    warnings.push_back(fmt::format(
        "{} pixels aren't finite: more light than a float holds (3e38); make lights "
        "darker, or scale the picture's unit",
        not_finite));
  }
  if (negative > 0) {
    warnings.push_back(fmt::format(
        "{} pixels are negative, which no light is: look for negative values in the "
        "scene's textures and materials",
        negative));
  }
  for (const ObjectEnergy& object : objects) {
    for (std::size_t c = 0; c < 3; ++c) {
      if (GivesTooMuch(object, c)) {
        warnings.push_back(fmt::format(
            "energy: '{}' gives {:.3g} ± {:.2g} times the light that enters it in "
            "channel {}: its material's totals are above 1 (see nacre factor), or the "
            "surface is folded more closely than light spreads in it",
            object.name,
            Ratio(object.left[c], object.entered[c]),
            Ratio(object.error[c], object.entered[c]),
            "RGB"[c]));
      }
    }
  }
  return warnings;
}

Json Invariants::ToJson() const {
  Json list = Json::array();
  for (const ObjectEnergy& object : objects) {
    list.push_back({{"name", object.name},
                    {"entered", object.entered},
                    {"left", object.left},
                    {"error", object.error}});
  }
  return {{"not_finite", not_finite},
          {"negative", negative},
          {"energy_ratio", EnergyRatio()},
          {"objects", list},
          {"warnings", Warnings()}};
}

}  // namespace nacre::render
