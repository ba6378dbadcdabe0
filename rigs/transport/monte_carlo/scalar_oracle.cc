#include "rigs/transport/monte_carlo/scalar_oracle.h"

#include "core/fresnel.h"
#include "core/random.h"
#include "rigs/transport/monte_carlo/tally.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>

namespace nacre::rigs::monte_carlo {
namespace {

constexpr double kForEver = std::numeric_limits<double>::infinity();
// Past a face by this much, a point is surely in the next cell.
constexpr double kNudgeMm = 1e-9;

using Vector = std::array<double, 3>;  // x, y, depth

class Photon {
 public:
  Photon(const Volume& volume, const OracleMethod& method, RandomStream random)
      : volume_(volume), method_(method), random_(random) {
    for (const Optics& medium : volume.media) {
      majorant_ = std::max(majorant_, medium.SigmaT());
    }
  }

  // Follows one photon to its end.
  void Run(const Source& source, MomentTally& tally) {
    const Entry entry = DrawEntry(source, volume_, [this] { return Uniform(); });
    position_ = {entry.x_mm, entry.y_mm, 0};
    direction_ = {entry.ux, entry.uy, entry.uz};
    while (!ended_) {
      Step();
      ++step_count_;
    }
    Finish(tally);
  }

 private:
  double Uniform() { return random_.Uniform(); }
  // The optical length of a free flight.
  double Exponential() { return -std::log1p(-Uniform()); }

  bool Heterogeneous() const {
    return volume_.voxels || volume_.pattern.MediumCount() > 1;
  }

  std::size_t MediumHere() const {
    if (!Heterogeneous()) {
      return volume_.layers[layer_].medium;
    }
    // A point on a face belongs to the cell the photon flies into.
    return volume_.MediumAt(position_[0] + kNudgeMm * direction_[0],
                            position_[1] + kNudgeMm * direction_[1],
                            position_[2] + kNudgeMm * direction_[2]);
  }

  // Distance to the plane that bounds the layer or box; the axis it is normal to.
  double DistanceToFace(std::size_t& axis) const {
    const double z = direction_[2];
    double distance = kForEver;
    if (z < 0) {
      distance = (layer_top_ - position_[2]) / z;
    } else if (z > 0) {
      distance = (layer_top_ + volume_.layers[layer_].thickness_mm - position_[2]) / z;
    }
    axis = 2;
    if (volume_.box) {
      const std::array<double, 2> half{volume_.box->half_x_mm, volume_.box->half_y_mm};
      for (std::size_t side = 0; side < 2; ++side) {
        const double u = direction_[side];
        const double d = (std::copysign(half[side], u) - position_[side]) / u;
        if (u != 0 && d < distance) {
          distance = d;
          axis = side;
        }
      }
    }
    return std::max(0.0, distance);
  }

  // Distance to the next lattice plane of pattern or voxels.
  double DistanceToCell() const {
    Vector cell{kForEver, kForEver, kForEver};
    Vector origin{0, 0, 0};
    if (volume_.voxels) {
      cell = volume_.voxels->size_mm;
      origin = {volume_.voxels->left_mm, volume_.voxels->lower_mm, 0};
    } else if (Heterogeneous()) {
      cell[0] = volume_.pattern.cell_mm;
      if (volume_.pattern.type == PatternType::kChessboard) {
        cell[1] = volume_.pattern.cell_mm;
      }
    }
    double distance = kForEver;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double u = direction_[axis];
      if (std::isinf(cell[axis]) || u == 0) {
        continue;
      }
      const double inside = position_[axis] + kNudgeMm * u - origin[axis];
      const double index = std::floor(inside / cell[axis]) + (u > 0 ? 1 : 0);
      distance =
          std::min(distance, (index * cell[axis] + origin[axis] - position_[axis]) / u);
    }
    return std::max(kNudgeMm, distance);
  }

  void Move(double distance) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position_[axis] += distance * direction_[axis];
    }
  }

  // One flight: to a collision, to a lattice plane, or to a face.
  void Step() {
    std::size_t axis = 2;
    const double to_face = DistanceToFace(axis);
    const std::size_t medium = MediumHere();
    const Optics& optics = volume_.media[medium];
    const bool implicit = method_.capture == Capture::kImplicit;
    const bool woodcock = method_.tracking == Tracking::kWoodcock && Heterogeneous();
    // Implicit capture: collisions are scatterings, absorption acts along the path;
    // with null collisions it acts at them instead.
    const double sigma = woodcock   ? majorant_
                         : implicit ? optics.sigma_s_per_mm
                                    : optics.SigmaT();
    const double to_collision = sigma > 0 ? Exponential() / sigma : kForEver;
    const double to_cell = woodcock ? kForEver : DistanceToCell();
    const double distance = std::min({to_face, to_collision, to_cell});
    Move(distance);
    if (implicit && !woodcock) {
      weight_ *= std::exp(-optics.sigma_a_per_mm * distance);
    }
    if (distance == to_face) {
      MeetFace(axis);
    } else if (distance == to_collision) {
      woodcock ? CollideTentatively() : Collide(optics, medium);
    }
    Roulette();
  }

  void Collide(const Optics& optics, std::size_t medium) {
    if (method_.capture == Capture::kAnalog &&
        Uniform() * optics.SigmaT() < optics.sigma_a_per_mm) {
      End(Fate::kAbsorbed);
      ending_.medium = medium;
      return;
    }
    Scatter(optics.g);
  }

  void CollideTentatively() {
    const std::size_t medium = MediumHere();
    const Optics& optics = volume_.media[medium];
    const double u = Uniform() * majorant_;
    if (method_.capture == Capture::kImplicit) {
      weight_ *= 1 - optics.sigma_a_per_mm / majorant_;
      if (u < optics.sigma_s_per_mm / (1 - optics.sigma_a_per_mm / majorant_)) {
        Scatter(optics.g);
      }
    } else if (u < optics.sigma_a_per_mm) {
      End(Fate::kAbsorbed);
      ending_.medium = medium;
    } else if (u < optics.SigmaT()) {
      Scatter(optics.g);
    }
  }

  // Henyey & Greenstein 1941.
  void Scatter(double g) {
    ending_.scattered = true;
    const double s = 2 * Uniform() - 1;
    const double q = (1 - g * g) / (1 + g * s);
    const double cosine =
        std::abs(g) < 1e-6 ? s : std::clamp((1 + g * g - q * q) / (2 * g), -1.0, 1.0);
    Turn(cosine, 2 * std::numbers::pi * Uniform());
  }

  void Turn(double cosine, double azimuth) {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const Vector u = direction_;
    const double across = std::hypot(u[0], u[1]);
    const double p = sine * std::cos(azimuth);
    const double q = sine * std::sin(azimuth);
    if (across < 1e-9) {
      direction_ = {p, q, u[2] > 0 ? cosine : -cosine};
    } else {
      direction_ = {(p * u[0] * u[2] - q * u[1]) / across + cosine * u[0],
                    (p * u[1] * u[2] + q * u[0]) / across + cosine * u[1],
                    -p * across + cosine * u[2]};
    }
    const double length = std::hypot(direction_[0], direction_[1], direction_[2]);
    for (double& component : direction_) {
      component /= length;
    }
  }

  void MeetFace(std::size_t axis) {
    const double here = volume_.layers[layer_].eta;
    const double cosine = std::abs(direction_[axis]);
    if (axis < 2) {
      position_[axis] =
          std::copysign(axis == 0 ? volume_.box->half_x_mm : volume_.box->half_y_mm,
                        direction_[axis]);
      ReflectOr(axis, 1 / here, [&] { End(Fate::kSides); });
      return;
    }
    const bool up = direction_[2] < 0;
    if (up) {
      position_[2] = layer_top_;
      if (layer_ == 0) {
        ReflectOr(2, 1 / here, [&] {
          End(Fate::kReflected);
          ending_.cosine = Refracted(cosine, here);
        });
        return;
      }
    } else {
      position_[2] = layer_top_ + volume_.layers[layer_].thickness_mm;
      if (layer_ + 1 == volume_.layers.size()) {
        MeetBottom(cosine, here);
        return;
      }
    }
    const std::size_t next = up ? layer_ - 1 : layer_ + 1;
    ReflectOr(2, volume_.layers[next].eta / here, [&] { EnterLayer(next, up); });
  }

  void MeetBottom(double cosine, double here) {
    switch (volume_.bottom) {
      case Bottom::kAir:
        ReflectOr(2, 1 / here, [&] {
          End(Fate::kTransmitted);
          ending_.cosine = Refracted(cosine, here);
        });
        return;
      case Bottom::kMatched:
        End(Fate::kTransmitted);
        ending_.cosine = cosine;
        return;
      case Bottom::kBlack:
        End(Fate::kBacking);
        return;
      case Bottom::kWhite: {
        ending_.scattered = true;
        direction_ = {0, 0, -1};
        Turn(std::sqrt(Uniform()), 2 * std::numbers::pi * Uniform());
        return;
      }
    }
  }

  // Cosine behind a face to air.
  static double Refracted(double cosine, double here) {
    return std::sqrt(std::max(0.0, 1 - here * here * (1 - cosine * cosine)));
  }

  template <class Cross>
  void ReflectOr(std::size_t axis, double eta_ratio, Cross&& cross) {
    if (Uniform() < FresnelReflectance(std::abs(direction_[axis]), eta_ratio)) {
      direction_[axis] = -direction_[axis];
    } else {
      cross();
    }
  }

  void EnterLayer(std::size_t next, bool up) {
    const double ratio = volume_.layers[layer_].eta / volume_.layers[next].eta;
    layer_top_ +=
        up ? -volume_.layers[next].thickness_mm : volume_.layers[layer_].thickness_mm;
    layer_ = next;
    direction_[0] *= ratio;
    direction_[1] *= ratio;
    const double across2 =
        direction_[0] * direction_[0] + direction_[1] * direction_[1];
    direction_[2] = std::copysign(std::sqrt(1 - across2), direction_[2]);
  }

  // Lux & Koblinger 1991: unbiased whatever the threshold, since the expected weight is
  // the weight before. What is gained and lost is entered in the books.
  void Roulette() {
    constexpr double kSurvival = 0.1;
    if (ended_ || weight_ >= method_.roulette_weight) {
      return;
    }
    if (Uniform() < kSurvival) {
      roulette_gain_ += weight_ * (1 / kSurvival - 1);
      weight_ /= kSurvival;
    } else {
      roulette_gain_ -= weight_;
      weight_ = 0;
      End(Fate::kAlive);
    }
  }

  void End(Fate fate) {
    ended_ = true;
    ending_.fate = fate;
    ending_.x_mm = position_[0];
    ending_.y_mm = position_[1];
    ending_.depth_mm = position_[2];
  }

  // Enters weight and absorption, once each a photon.
  void Finish(MomentTally& tally) {
    tally.AddSteps(step_count_);
    if (ending_.fate != Fate::kAlive) {
      tally.Add(ending_, weight_);
    }
    if (method_.capture == Capture::kImplicit) {
      Ending absorbed = ending_;
      absorbed.fate = Fate::kAbsorbed;
      absorbed.depth_mm = kForEver;  // spread over the path
      // Entered weight plus roulette's gains is either absorbed or left.
      tally.Add(absorbed, 1 + roulette_gain_ - weight_);
    }
  }

  const Volume& volume_;
  const OracleMethod& method_;
  RandomStream random_;
  double majorant_ = 0;
  Vector position_{};
  Vector direction_{};
  std::size_t layer_ = 0;
  double layer_top_ = 0;
  double weight_ = 1;
  double roulette_gain_ = 0;
  bool ended_ = false;
  Ending ending_;
  std::int64_t step_count_ = 0;
};

}  // namespace

Result SimulateScalar(const Volume& volume,
                      const Source& source,
                      const TallyRequest& request,
                      const Options& options,
                      const OracleMethod& method) {
  Validate(volume);
  Validate(source);
  nacre::Validate(options);
  const std::clock_t start = std::clock();
  MomentTally tally(request, volume.media.size());
  for (std::int64_t k = 0; k < options.photon_count; ++k) {
    const RandomStream random(static_cast<std::uint64_t>(options.seed),
                              static_cast<std::uint64_t>(k));
    Photon(volume, method, random).Run(source, tally);
  }
  Result result = tally.ToResult(options.photon_count);
  result.specular = SpecularReflectance(source, volume);
  result.cpu_seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return result;
}

}  // namespace nacre::rigs::monte_carlo
