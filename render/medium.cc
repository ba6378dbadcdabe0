#include "render/medium.h"

#include "render/warp.h"

#include <cmath>

namespace nacre::render {
namespace {

Color Exp(Color x) {
  return {std::exp(x.x), std::exp(x.y), std::exp(x.z)};
}

float Sum(Color c) {
  return c.x + c.y + c.z;
}

// 1 − u is in (0, 1].
float Exponential(float u) {
  return -std::log(std::max(1 - u, 1e-30F));
}

class HomogeneousMedium : public ParticipatingMedium {
 public:
  HomogeneousMedium(Color sigma_a, Color sigma_s, float g)
      : ParticipatingMedium(g), sigma_s_(sigma_s), sigma_t_(sigma_a + sigma_s) {}

  // A channel is chosen by throughput, its free path drawn; the balance heuristic over
  // the channels is the density [Veach97, section 9.2.2].
  Step SampleStep(const Ray&,
                  float distance,
                  Color throughput,
                  Sampler& sampler) const override {
    const Color shares = throughput / Sum(throughput);
    const float u = sampler.Next1D();
    const int channel = u < shares.x ? 0 : u < shares.x + shares.y ? 1 : 2;
    const float drawn = sigma_t_[channel] > 0
                            ? Exponential(sampler.Next1D()) / sigma_t_[channel]
                            : std::numeric_limits<float>::infinity();
    Step step{drawn < distance, std::min(drawn, distance)};
    if (std::isinf(step.distance)) {
      // Only what isn't dimmed at all comes from infinitely far.
      step.weight = {sigma_t_.x > 0 ? 0.0F : 1.0F,
                     sigma_t_.y > 0 ? 0.0F : 1.0F,
                     sigma_t_.z > 0 ? 0.0F : 1.0F};
      step.weight *= 1 / Dot(shares, step.weight);
      return step;
    }
    const Color transmitted = Exp(sigma_t_ * -step.distance);
    const Color densities = step.scattered ? sigma_t_ * transmitted : transmitted;
    const float density = Dot(shares, densities);
    step.weight = (step.scattered ? sigma_s_ * transmitted : transmitted) / density;
    return step;
  }

  Color Transmittance(const Ray&, float distance, Sampler&) const override {
    Color dimmed;
    dimmed.x = sigma_t_.x > 0 ? std::exp(-sigma_t_.x * distance) : 1;
    dimmed.y = sigma_t_.y > 0 ? std::exp(-sigma_t_.y * distance) : 1;
    dimmed.z = sigma_t_.z > 0 ? std::exp(-sigma_t_.z * distance) : 1;
    return dimmed;
  }

 private:
  Color sigma_s_;
  Color sigma_t_;
};

// Trilinear; the first and last nodes lie on the box.
class GridField {
 public:
  explicit GridField(VolumeGrid grid) : grid_(std::move(grid)) {}

  const VolumeGrid& grid() const { return grid_; }

  Color At(Vec3 p) const {
    std::array<std::size_t, 3> low{};
    std::array<std::size_t, 3> high{};
    std::array<float, 3> t{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const int last = grid_.nodes[a] - 1;
      const float size = grid_.high[axis] - grid_.low[axis];
      const float x = std::clamp((p[axis] - grid_.low[axis]) / size, 0.0F, 1.0F) *
                      static_cast<float>(last);
      const int cell = std::clamp(static_cast<int>(x), 0, std::max(0, last - 1));
      low[a] = static_cast<std::size_t>(cell);
      high[a] = static_cast<std::size_t>(std::min(cell + 1, last));
      t[a] = x - static_cast<float>(cell);
    }
    Color sum;
    for (unsigned corner = 0; corner < 8; ++corner) {
      float weight = 1;
      std::array<std::size_t, 3> at{};
      for (unsigned a = 0; a < 3; ++a) {
        const bool upper = (corner >> a & 1U) != 0;
        at[a] = upper ? high[a] : low[a];
        weight *= upper ? t[a] : 1 - t[a];
      }
      sum += Node(at) * weight;
    }
    return sum;
  }

 private:
  Color Node(std::array<std::size_t, 3> at) const {
    const auto nx = static_cast<std::size_t>(grid_.nodes[0]);
    const auto ny = static_cast<std::size_t>(grid_.nodes[1]);
    const auto channels = static_cast<std::size_t>(grid_.channels);
    const float* const v =
        &grid_.values[((at[2] * ny + at[1]) * nx + at[0]) * channels];
    return channels == 1 ? Color{v[0], v[0], v[0]} : Color{v[0], v[1], v[2]};
  }

  VolumeGrid grid_;
};

class GridMedium : public ParticipatingMedium {
 public:
  explicit GridMedium(const GridMediumParameters& p)
      : ParticipatingMedium(p.g),
        density_(p.density),
        albedo_(p.albedo),
        sigma_t_(p.sigma_t),
        grid_from_world_(p.world_from_grid.Inverse()) {
    const std::vector<float>& values = density_.grid().values;
    majorant_ =
        *std::max_element(values.begin(), values.end()) * MaxComponent(sigma_t_);
  }

  Step SampleStep(const Ray& ray,
                  float distance,
                  Color throughput,
                  Sampler& sampler) const override {
    Step step{false, distance};
    float t = 0;
    float end = distance;
    if (!Clip(ray, t, end)) {
      return step;
    }
    for (;;) {
      t += Exponential(sampler.Next1D()) / majorant_;
      if (!(t < end)) {
        return step;
      }
      const Vec3 p = grid_from_world_.Point(ray.origin + ray.direction * t);
      const Color sigma_t = sigma_t_ * density_.At(p).x;
      const Color sigma_s = sigma_t * albedo_.At(p);
      const Color null = Color{majorant_, majorant_, majorant_} - sigma_t;
      const float to_scatter = Dot(throughput * step.weight, sigma_s);
      const float to_pass = Dot(throughput * step.weight, null);
      if (!(to_scatter + to_pass > 0)) {
        step.weight = {};
        return step;
      }
      const float probability = to_scatter / (to_scatter + to_pass);
      if (sampler.Next1D() < probability) {
        step.weight *= sigma_s / (majorant_ * probability);
        step.scattered = true;
        step.distance = t;
        return step;
      }
      step.weight *= null / (majorant_ * (1 - probability));
    }
  }

  // Ratio tracking [Novák14].
  Color Transmittance(const Ray& ray, float distance, Sampler& sampler) const override {
    Color left{1, 1, 1};
    float t = 0;
    float end = distance;
    if (!Clip(ray, t, end)) {
      return left;
    }
    for (;;) {
      t += Exponential(sampler.Next1D()) / majorant_;
      if (!(t < end)) {
        return left;
      }
      const Vec3 p = grid_from_world_.Point(ray.origin + ray.direction * t);
      left *= Color{1, 1, 1} - sigma_t_ * (density_.At(p).x / majorant_);
    }
  }

 private:
  // The part of the ray in the grid's box.
  bool Clip(const Ray& ray, float& begin, float& end) const {
    if (!(majorant_ > 0)) {
      return false;
    }
    const Vec3 origin = grid_from_world_.Point(ray.origin);
    const Vec3 direction = grid_from_world_.Vector(ray.direction);
    for (int axis = 0; axis < 3; ++axis) {
      const float a = (density_.grid().low[axis] - origin[axis]) / direction[axis];
      const float b = (density_.grid().high[axis] - origin[axis]) / direction[axis];
      if (direction[axis] == 0) {
        if (origin[axis] < density_.grid().low[axis] ||
            origin[axis] > density_.grid().high[axis]) {
          return false;
        }
        continue;
      }
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    return begin < end;
  }

  GridField density_;
  GridField albedo_;
  Color sigma_t_;
  Transform grid_from_world_;
  float majorant_ = 0;
};

}  // namespace

MediumPtr MakeHomogeneousMedium(Color sigma_a, Color sigma_s, float g) {
  return std::make_shared<HomogeneousMedium>(sigma_a, sigma_s, g);
}

MediumPtr MakeGridMedium(const GridMediumParameters& parameters) {
  return std::make_shared<GridMedium>(parameters);
}

float PhasePdf(float g, float cosine) {
  const float base = 1 + g * g - 2 * g * cosine;
  return 0.25F * kInvPi * (1 - g * g) / (base * std::sqrt(base));
}

Vec3 SamplePhase(float g, Vec3 forward, Vec2 u) {
  // Solved without a division by g: with s = 2u − 1,
  // μ = (2s + g (s² + 3) + 2g² s + g³ (s² − 1)) / (2 (1 + g s)²).
  const float s = 2 * u.x - 1;
  const float once = 1 + g * s;
  const float mu = (2 * s + g * (s * s + 3) + 2 * g * g * s + g * g * g * (s * s - 1)) /
                   (2 * once * once);
  const float cosine = std::clamp(mu, -1.0F, 1.0F);
  const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
  const float phi = 2 * kPi * u.y;
  return Frame(forward).ToWorld({sine * std::cos(phi), sine * std::sin(phi), cosine});
}

}  // namespace nacre::render
