#include "reconstruct/edit/edited_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace nacre::reconstruct {
namespace {

double Total(const Profile& profile) {
  return std::accumulate(profile.begin(), profile.end(), 0.0);
}

void ScaleTo(double total, Profile& profile) {
  const double now = Total(profile);
  if (now <= 0) {
    return;
  }
  for (float& value : profile) {
    value = static_cast<float>(static_cast<double>(value) * (total / now));
  }
}

std::size_t RingOf(const RdHeader& header, int u, int v) {
  return static_cast<std::size_t>(
      std::lround(std::hypot(u - header.Radius(), v - header.Radius())));
}

// ln R between cells, and beyond the window along the slope of its outermost rings.
class LogProfile {
 public:
  LogProfile(const RdHeader& header, const Profile& profile)
      : core_(header.core), radius_(header.Radius()) {
    // Zeros are 30 decades below the peak, whatever the unit.
    const auto peak =
        static_cast<double>(*std::max_element(profile.begin(), profile.end()));
    const double least = std::max(1e-30 * peak, std::numeric_limits<double>::min());
    for (const float value : profile) {
      log_.push_back(std::log(std::max(static_cast<double>(value), least)));
    }
    const auto mean_at = [&](int r) {
      return 0.25 * (At(radius_ - r, radius_) + At(radius_ + r, radius_) +
                     At(radius_, radius_ - r) + At(radius_, radius_ + r));
    };
    slope_ = radius_ > 1 ? std::min(0.0, mean_at(radius_) - mean_at(radius_ - 1)) : -1;
  }

  // At (x, y) cells from the centre.
  double operator()(double x, double y) const {
    const double limit = radius_;
    const double far = std::max(std::abs(x), std::abs(y));
    const double pull = far > limit ? limit / far : 1;
    const double px = x * pull + limit;
    const double py = y * pull + limit;
    const int u = std::min(static_cast<int>(px), core_ - 2);
    const int v = std::min(static_cast<int>(py), core_ - 2);
    const double fx = px - u;
    const double fy = py - v;
    const double inside = (1 - fy) * ((1 - fx) * At(u, v) + fx * At(u + 1, v)) +
                          fy * ((1 - fx) * At(u, v + 1) + fx * At(u + 1, v + 1));
    return inside + slope_ * (1 - pull) * std::hypot(x, y);
  }

 private:
  double At(int u, int v) const {
    return log_[static_cast<std::size_t>(std::int64_t{v} * core_ + u)];
  }
  int core_;
  int radius_;
  std::vector<double> log_;
  double slope_ = 0;  // of ln R a cell, outwards
};

}  // namespace

Profile FilledProfile(const RdHeader& header, const RdSlice& slice, int channel) {
  const auto size = static_cast<std::size_t>(header.WindowSize());
  const std::size_t begin = static_cast<std::size_t>(channel) * size;
  const auto first = slice.rd.begin() + static_cast<std::ptrdiff_t>(begin);
  Profile profile(first, first + static_cast<std::ptrdiff_t>(size));
  const float peak = std::max(0.0f, *std::max_element(profile.begin(), profile.end()));
  const float floor = 1e-7f * peak;
  const auto good = [&](std::size_t k) {
    return slice.valid[begin + k] != 0 && profile[k] > floor;
  };
  std::vector<double> sum(static_cast<std::size_t>(header.core));
  std::vector<int> count(sum.size());
  for (int v = 0; v < header.core; ++v) {
    for (int u = 0; u < header.core; ++u) {
      const auto k = static_cast<std::size_t>(std::int64_t{v} * header.core + u);
      if (good(k)) {
        const std::size_t ring = RingOf(header, u, v);
        sum[ring] += static_cast<double>(profile[k]);
        ++count[ring];
      }
    }
  }
  std::vector<float> mean(sum.size(), floor);
  for (std::size_t r = 0; r < sum.size(); ++r) {
    mean[r] = count[r] > 0 ? static_cast<float>(sum[r] / count[r])
                           : (r > 0 ? mean[r - 1] : floor);
  }
  for (int v = 0; v < header.core; ++v) {
    for (int u = 0; u < header.core; ++u) {
      const auto k = static_cast<std::size_t>(std::int64_t{v} * header.core + u);
      if (!good(k)) {
        profile[k] = mean[RingOf(header, u, v)];
      }
    }
  }
  return profile;
}

Profile Stretched(const RdHeader& header, const Profile& profile, double range) {
  constexpr int kPlaces = 4;
  const LogProfile log(header, profile);
  const int radius = header.Radius();
  Profile stretched(profile.size());
  for (int v = 0; v < header.core; ++v) {
    for (int u = 0; u < header.core; ++u) {
      double sum = 0;
      for (int k = 0; k < kPlaces * kPlaces; ++k) {
        const int across = k % kPlaces;
        const int down = k / kPlaces;
        const double x = u - radius + (across + 0.5) / kPlaces - 0.5;
        const double y = v - radius + (down + 0.5) / kPlaces - 0.5;
        sum += std::exp(log(x / range, y / range));
      }
      stretched[static_cast<std::size_t>(std::int64_t{v} * header.core + u)] =
          static_cast<float>(sum / (kPlaces * kPlaces));
    }
  }
  ScaleTo(Total(profile), stretched);
  return stretched;
}

Profile Reshaped(const Profile& profile, double shape) {
  Profile reshaped = profile;
  const float peak = *std::max_element(profile.begin(), profile.end());
  if (!(peak > 0)) {
    return reshaped;
  }
  for (float& value : reshaped) {
    value = std::pow(value / peak, static_cast<float>(shape));
  }
  ScaleTo(Total(profile), reshaped);
  return reshaped;
}

}  // namespace nacre::reconstruct
