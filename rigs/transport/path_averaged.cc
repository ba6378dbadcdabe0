#include "rigs/transport/path_averaged.h"

#include "core/error.h"
#include "rigs/internal/gauss_legendre.h"
#include "rigs/transport/dipole.h"
#include "rigs/transport/multipole.h"
#include "rigs/transport/refine_cells.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <numbers>

namespace nacre::rigs {
namespace {

// The medium whose coefficients are those of the phantom's media, mixed.
DiffusionMedium Mix(const Phantom& phantom, std::size_t channel, double fraction) {
  const Medium& first = phantom.media.front();
  const Medium& last = phantom.media.back();
  return {
      std::lerp(first.sigma_a_per_mm[channel], last.sigma_a_per_mm[channel], fraction),
      std::lerp(
          first.ReducedScattering(channel), last.ReducedScattering(channel), fraction)};
}

SlabBoundary BoundaryOf(const Slab& slab) {
  const double top = BoundaryFactor(slab.eta);
  return {.thickness_mm = slab.thickness_mm,
          .top_factor = top,
          .bottom_factor = slab.bottom == Bottom::kAir ? top : 1.0,
          .bottom_reflects_all = slab.bottom == Bottom::kWhite};
}

bool IsThick(const Slab& slab) {
  return std::isinf(slab.thickness_mm);
}

double Reflectance(const DiffusionMedium& medium,
                   const SlabBoundary& boundary,
                   double r_mm) {
  return std::isinf(boundary.thickness_mm)
             ? Dipole(medium, boundary.top_factor).Reflectance(r_mm)
             : Multipole(medium, boundary).Reflectance(r_mm);
}

void CheckPhantom(const Phantom& phantom) {
  RequirePlanePattern(phantom, "the fast solver");
  const auto refuse = [](const std::string& what) {
    throw BadData("the fast solver is a diffusion model and can't do this: " + what);
  };
  if (phantom.beam.angle_rad != 0) {
    refuse("beam.angle_deg other than 0");
  }
  for (const Medium& medium : phantom.media) {
    for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
      const double scattering = medium.ReducedScattering(c);
      if (!(scattering > 0)) {
        refuse(fmt::format("medium '{}' doesn't scatter in channel {}",
                           medium.name,
                           phantom.channels[c]));
      }
      const double free_path_mm = 1 / (scattering + medium.sigma_a_per_mm[c]);
      if (free_path_mm >= phantom.slab.thickness_mm) {
        refuse(
            fmt::format("slab.thickness_mm = {} is less than the mean free path of "
                        "medium '{}' in channel {}, {:.3g} mm",
                        phantom.slab.thickness_mm,
                        medium.name,
                        phantom.channels[c],
                        free_path_mm));
      }
    }
  }
}

double ShortestFreePathMm(const Phantom& phantom, std::size_t channel) {
  return std::min(1 / Mix(phantom, channel, 0).SigmaTPrime(),
                  1 / Mix(phantom, channel, 1).SigmaTPrime());
}

RadialTable::Layout LayoutFor(const Phantom& phantom, std::size_t channel) {
  constexpr double kNearlyLinear = 10;
  const double first = Mix(phantom, channel, 0).sigma_a_per_mm;
  const double last = Mix(phantom, channel, 1).sigma_a_per_mm;
  const double smaller = std::min(first, last);
  const double difference = std::abs(last - first);
  const double free_path_mm = ShortestFreePathMm(phantom, channel);
  return {.inner_mm = 0.5 * free_path_mm,
          .outer_mm = std::max(1000.0, 100 * free_path_mm),
          .fraction_offset = kNearlyLinear * difference > smaller ? smaller / difference
                                                                  : kNearlyLinear,
          .fraction_reversed = last < first,
          .fraction_rows = phantom.media.size() == 1 ? 2 : 65};
}

RadialTable PencilTable(const Phantom& phantom, std::size_t channel, int thread_count) {
  const SlabBoundary boundary = BoundaryOf(phantom.slab);
  return RadialTable(
      LayoutFor(phantom, channel),
      [&](double fraction, double r_mm) {
        return Reflectance(Mix(phantom, channel, fraction), boundary, r_mm);
      },
      thread_count);
}

// R_d averaged over a round beam: radial again. The medium is taken to be that of the
// segment from the beam's centre, which matters only within a beam's width of an edge.
RadialTable RoundBeamTable(const Phantom& phantom,
                           std::size_t channel,
                           const RadialTable& pencil,
                           int thread_count) {
  const std::vector<BeamNode> beam =
      HalfRoundBeam(phantom.beam, ShortestFreePathMm(phantom, channel));
  return RadialTable(
      LayoutFor(phantom, channel),
      [&](double fraction, double r_mm) {
        double sum = 0;
        std::vector<float> x;
        std::vector<float> y;
        for (const BeamNode& node : beam) {
          x.push_back(static_cast<float>(node.offset_mm.x));
          y.push_back(static_cast<float>(node.offset_mm.y));
        }
        const std::vector<float> f(beam.size(), static_cast<float>(fraction));
        std::vector<float> value(beam.size(), 0.0F);
        pencil.Add(
            {r_mm, 0}, 1, {x.data(), y.data(), x.size()}, f.data(), value.data());
        for (std::size_t k = 0; k < beam.size(); ++k) {
          sum += beam[k].weight * static_cast<double>(value[k]);
        }
        return sum;
      },
      thread_count);
}

}  // namespace

PathAveraged::PathAveraged(const Phantom& phantom, int thread_count, const Ranks* ranks)
    : Transport(thread_count, ranks), phantom_(phantom), beam_(1) {
  CheckPhantom(phantom);
  constexpr double kLossBeyondReach = 1e-4;
  const Beam& beam = phantom.beam;
  double feature_mm = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    RadialTable pencil = PencilTable(phantom, c, thread_count);
    if (beam.shape == BeamShape::kGaussian || beam.shape == BeamShape::kDisc) {
      tables_.push_back(RoundBeamTable(phantom, c, pencil, thread_count));
    } else {
      tables_.push_back(std::move(pencil));
    }
    reach_mm_.push_back(tables_.back().Reach(kLossBeyondReach) + beam.width_mm);
    feature_mm = std::min(feature_mm, ShortestFreePathMm(phantom, c));
  }
  if (beam.shape == BeamShape::kSquare) {
    beam_ = SquareBeam(beam, feature_mm);
  }
  if (phantom.grid.points_x > 0) {
    std::vector<std::function<double(double)>> profiles;
    for (const RadialTable& table : tables_) {
      profiles.emplace_back([&](double r_mm) { return table.Value(r_mm, 0); });
      profiles.emplace_back([&](double r_mm) { return table.Value(r_mm, 1); });
    }
    quadrature_ = MakeCellQuadrature(
        {.core = phantom.grid.core, .pitch_mm = phantom.grid.pitch_mm}, profiles);
  }
}

void PathAveraged::AddExitance(PointMm x_i,
                               std::size_t channel,
                               double flux,
                               const PointColumns& points,
                               float* exitance) const {
  AddChannels(x_i, channel, channel + 1, flux, points, exitance);
}

// Channels [first, last), each into its own points.count values: which media a segment
// passes through is the same for all.
void PathAveraged::AddChannels(PointMm x_i,
                               std::size_t first,
                               std::size_t last,
                               double flux,
                               const PointColumns& points,
                               float* exitance) const {
  constexpr std::size_t kPiece = 512;
  float fraction[kPiece];
  for (const BeamNode& node : beam_) {
    const PointMm from{x_i.x + node.offset_mm.x, x_i.y + node.offset_mm.y};
    for (std::size_t begin = 0; begin < points.count; begin += kPiece) {
      const PointColumns piece{points.x_mm + begin,
                               points.y_mm + begin,
                               std::min(kPiece, points.count - begin)};
      phantom_.pattern.SecondMediumFraction(from, piece, fraction);
      for (std::size_t c = first; c < last; ++c) {
        tables_[c].Add(from,
                       flux * node.weight,
                       piece,
                       fraction,
                       exitance + (c - first) * points.count + begin);
      }
    }
  }
}

Window PathAveraged::WindowAround(PointMm x_i) const {
  Expect(quadrature_.cell_begin.size() > 1, "a phantom with a grid");
  const std::size_t channels = phantom_.channels.size();
  const std::size_t cells = quadrature_.CellCount();
  const WindowFunction around = [&](const PointColumns& offsets, float* values) {
    std::vector<float> x(offsets.x_mm, offsets.x_mm + offsets.count);
    std::vector<float> y(offsets.y_mm, offsets.y_mm + offsets.count);
    for (std::size_t k = 0; k < offsets.count; ++k) {
      x[k] += static_cast<float>(x_i.x);
      y[k] += static_cast<float>(x_i.y);
    }
    std::fill_n(values, channels * offsets.count, 0.0F);
    AddChannels(x_i, 0, channels, 1, {x.data(), y.data(), offsets.count}, values);
  };
  Window window;
  window.rd.resize(cells * channels);
  window.sigma.resize(window.rd.size());
  IntegrateCells(quadrature_, channels, around, window.rd);
  if (phantom_.media.size() > 1) {
    RefineCells({.core = phantom_.grid.core, .pitch_mm = phantom_.grid.pitch_mm},
                CellsOfSeveralMedia(x_i),
                channels,
                around,
                window.rd);
  }
  return window;
}

// The cells that aren't reached from x_i through one medium alone, or through mixtures
// that are all the same: R_d bends there for other reasons than distance.
std::vector<std::size_t> PathAveraged::CellsOfSeveralMedia(PointMm x_i) const {
  constexpr float kSame = 1e-3F;
  const std::size_t nodes = quadrature_.weight.size();
  std::vector<float> x(nodes);
  std::vector<float> y(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    x[k] = static_cast<float>(x_i.x) + quadrature_.dx_mm[k];
    y[k] = static_cast<float>(x_i.y) + quadrature_.dy_mm[k];
  }
  std::vector<float> fraction(nodes);
  phantom_.pattern.SecondMediumFraction(
      x_i, {x.data(), y.data(), nodes}, fraction.data());
  std::vector<std::size_t> mixed;
  for (std::size_t cell = 0; cell < quadrature_.CellCount(); ++cell) {
    const auto begin = fraction.begin();
    const auto [low, high] = std::minmax_element(
        begin + static_cast<std::ptrdiff_t>(quadrature_.cell_begin[cell]),
        begin + static_cast<std::ptrdiff_t>(quadrature_.cell_begin[cell + 1]));
    if (*high - *low > kSame) {
      mixed.push_back(cell);
    }
  }
  return mixed;
}

double PathAveraged::Direct(PointMm x_i, PointMm x_o, std::size_t channel) const {
  const double fraction = phantom_.pattern.SecondMediumFraction(x_i, x_o);
  return Reflectance(Mix(phantom_, channel, fraction),
                     BoundaryOf(phantom_.slab),
                     std::hypot(x_o.x - x_i.x, x_o.y - x_i.y));
}

namespace {

Totals HomogeneousTotals(const DiffusionMedium& medium, const Slab& slab) {
  Totals totals;
  const SlabBoundary boundary = BoundaryOf(slab);
  if (IsThick(slab)) {
    totals.reflected = Dipole(medium, boundary.top_factor).TotalReflectance();
  } else {
    const Multipole multipole(medium, boundary);
    totals.reflected = multipole.TotalReflectance();
    totals.transmitted = multipole.TotalTransmittance();
  }
  return totals;
}

}  // namespace

Totals PathAveraged::TotalsAt(PointMm x_i, std::size_t channel) const {
  const Slab& slab = phantom_.slab;
  Totals totals;
  if (phantom_.media.size() == 1) {
    totals = HomogeneousTotals(Mix(phantom_, channel, 0), slab);
  } else {
    // Polar coordinates around x_i, r = r₀ sinh u: both the peak and the tail are
    // smooth in u.
    constexpr int kAngles = 96;
    const double inner_mm = ShortestFreePathMm(phantom_, channel);
    const double farthest = std::asinh(reach_mm_[channel] / inner_mm);
    const internal::GaussRule radial = internal::GaussLegendre(64);
    const SlabBoundary boundary = BoundaryOf(slab);
    for (std::size_t k = 0; k < radial.node.size(); ++k) {
      const double u = 0.5 * farthest * (1 + radial.node[k]);
      const double r = inner_mm * std::sinh(u);
      const double r_dr = r * inner_mm * std::cosh(u) * 0.5 * farthest *
                          radial.weight[k] * 2 * std::numbers::pi / kAngles;
      for (int a = 0; a < kAngles; ++a) {
        const double angle = 2 * std::numbers::pi * (a + 0.5) / kAngles;
        const PointMm x_o{x_i.x + r * std::cos(angle), x_i.y + r * std::sin(angle)};
        const DiffusionMedium medium =
            Mix(phantom_, channel, phantom_.pattern.SecondMediumFraction(x_i, x_o));
        totals.reflected += r_dr * Reflectance(medium, boundary, r);
        totals.transmitted +=
            IsThick(slab) ? 0 : r_dr * Multipole(medium, boundary).Transmittance(r);
      }
    }
  }
  if (slab.bottom == Bottom::kBlack) {
    totals.transmitted = 0;  // arrived, and was absorbed there
  }
  totals.absorbed = 1 - totals.reflected - totals.transmitted;
  return totals;
}

}  // namespace nacre::rigs
