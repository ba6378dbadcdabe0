#include "tests/factor/synthetic.h"

#include "core/random.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::testing {
namespace {

using reconstruct::RdDataset;
using reconstruct::RdHeader;

RdHeader MakeHeader(int points_x, int points_y, int core, int channels) {
  const char* names[] = {"R", "G", "B", "850nm"};
  RdHeader header;
  header.points_x = points_x;
  header.points_y = points_y;
  header.core = core;
  header.pitch_mm = 0.25;
  header.eta = 1.5;
  for (int c = 0; c < channels; ++c) {
    header.channels.emplace_back(names[c]);
  }
  return header;
}

RdDataset Allocate(const RdHeader& header) {
  RdDataset dataset;
  dataset.header = header;
  const auto size = static_cast<std::size_t>(header.PointCount() * header.SliceSize());
  dataset.rd.assign(size, 0.0F);
  dataset.sigma.assign(size, 0.0F);
  dataset.valid.assign(size, 1);
  return dataset;
}

// 0 in one medium, 1 in the other, soft in between, with a little texture.
double Mixture(PointMm p) {
  constexpr double kCellMm = 2;
  const double waves = std::sin(std::numbers::pi * p.x / kCellMm) *
                       std::sin(std::numbers::pi * p.y / kCellMm);
  return 0.5 + 0.5 * std::tanh(4 * waves) + 0.05 * std::sin(5 * p.x + 3 * p.y);
}

double Gauss(RandomStream& random) {
  const double radius = std::sqrt(-2 * std::log(1 - random.Uniform()));
  return radius * std::cos(2 * std::numbers::pi * random.Uniform());
}

}  // namespace

RdDataset MakeChessboard(const SyntheticOptions& options) {
  RdDataset dataset = Allocate(
      MakeHeader(options.points_x, options.points_y, options.core, options.channels));
  const RdHeader& header = dataset.header;
  RandomStream random(options.seed, 0);
  std::size_t n = 0;
  for (std::int64_t slice = 0; slice < header.PointCount(); ++slice) {
    const PointMm x_i = header.GridPoint(static_cast<int>(slice % header.points_x),
                                         static_cast<int>(slice / header.points_x));
    for (int c = 0; c < options.channels; ++c) {
      for (int v = 0; v < header.core; ++v) {
        for (int u = 0; u < header.core; ++u) {
          const PointMm d = header.Offset(u, v);
          double mixture = 0;
          for (int step = 0; step < 4; ++step) {
            const double t = (step + 0.5) / 4;
            mixture += Mixture({x_i.x + t * d.x, x_i.y + t * d.y}) / 4;
          }
          const double sigma = 0.6 + 0.4 * c + 0.8 * mixture;
          const double z = 0.45;
          const double r2 = d.x * d.x + d.y * d.y + z * z;
          const double r = std::sqrt(r2);
          const double rd =
              z * (sigma + 1 / r) * std::exp(-sigma * r) / (2 * std::numbers::pi * r2);
          const double noise = options.noise > 0 ? options.noise * Gauss(random) : 0;
          dataset.rd[n++] = static_cast<float>(options.scale * (rd + noise));
        }
      }
    }
  }
  return dataset;
}

RdDataset MakeConstant(int points_x, int points_y, int core, float value) {
  RdDataset dataset = Allocate(MakeHeader(points_x, points_y, core, 1));
  std::fill(dataset.rd.begin(), dataset.rd.end(), value);
  return dataset;
}

factor::Material MakeMaterial(std::uint64_t seed) {
  RandomStream random(seed, 1);
  factor::Material m;
  m.points_x = 5;
  m.points_y = 4;
  m.core = 3;
  m.pitch_mm = 0.1 + random.Uniform();
  m.eta = 1.3;
  m.channels = {"R", "G", "B"};
  m.method = "log-svd";
  m.transform = factor::Transform::kLog;
  m.terms = 2;
  m.cluster_count = 2;
  m.a = {0.1, random.Uniform() + 0.1, 3e-7};
  m.b = {1, random.Uniform() + 0.1, 2};
  const auto fill = [&](std::vector<float>& values, std::size_t size, double low) {
    for (std::size_t n = 0; n < size; ++n) {
      values.push_back(static_cast<float>(low + random.Uniform()));
    }
  };
  fill(m.f, 3 * 2 * 20, -0.5);
  fill(m.h, 3 * 2 * 2 * 9, -0.5);
  fill(m.row_scale, 3 * 20, 0.5);
  fill(m.albedo, 3 * 20, 0);
  for (int n = 0; n < 20; ++n) {
    m.cluster.push_back(static_cast<std::uint8_t>(random.Uniform() * 2));
  }
  m.error = {{"relative_l2", random.Uniform()}, {"log_rms", 0.1}};
  m.error_curve = {{1, 0.3, 0.4}, {2, random.Uniform(), 0.1}};
  m.provenance = R"({"software":"nacre"})";
  return m;
}

}  // namespace nacre::testing
