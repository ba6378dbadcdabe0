#include "factor/internal/reciprocal_sides.h"

#include "core/parallel.h"
#include "factor/internal/reciprocal.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace nacre::factor::internal {
namespace {

constexpr int kNear = 2;               // points, along each axis
constexpr int kRounds = 6;             // map, then kernels
constexpr int kSteps = 20;             // of conjugate gradients
constexpr double kEnough = 1e-8;       // of the squared residual
constexpr double kPrior = 1e-3;        // of the mean diagonal
constexpr double kLeastPart = 0.5;     // of the difference that has to be explained
constexpr double kMostDifference = 1;  // half of ln R − ln R that is believed
constexpr double kFarPrior = 0.01;  // inverse variance of kernels, near ones' squares

// Half the logarithm of a pair's two measurements' ratio, and its weight: errors of
// R_d.
struct Difference {
  std::size_t first;
  std::size_t second;
  double weight;
  double value;
};

std::vector<Difference> Differences(const ReciprocalData& data,
                                    std::size_t cell,
                                    const PairSides& sides) {
  std::vector<Difference> list;
  const PlaneArea area = AreaOf(data, cell);
  const int to = data.OffsetY(cell) * data.width + data.OffsetX(cell);
  for (int y = area.y0; y < area.y1; ++y) {
    for (int x = area.x0; x < area.x1; ++x) {
      const int p = y * data.width + x;
      const auto at = static_cast<std::size_t>(p);
      if (sides.first.weight[at] < 0 || sides.second.weight[at] < 0) {
        continue;
      }
      const auto a = static_cast<double>(sides.first.value[at]);
      const auto b = static_cast<double>(sides.second.value[at]);
      const double variance = static_cast<double>(sides.first.weight[at]) +
                              static_cast<double>(sides.second.weight[at]);
      if (!(a > 0 && b > 0 && (a + b) * (a + b) > 36 * variance)) {
        continue;  // mostly noise
      }
      list.push_back(
          {at,
           static_cast<std::size_t>(p + to),
           a * b,
           std::clamp(0.5 * std::log(a / b), -kMostDifference, kMostDifference)});
    }
  }
  return list;
}

class SidesFit {
 public:
  SidesFit(const std::vector<PairSides>& near,
           int thread_count,
           const ReciprocalData& data)
      : lists_(near.size()), kernels_(near.size(), 1.0), map_(data.Plane(), 0.0) {
    const std::vector<int> cells = NearCells(data);
    ParallelFor(std::ssize(near), thread_count, [&](std::int64_t n) {
      const auto at = static_cast<std::size_t>(n);
      lists_[at] = Differences(
          data, static_cast<std::size_t>(cells[at % cells.size()]), near[at]);
    });
  }

  // Returns the part of the differences' squares that is left.
  double Run() {
    double all = 0;
    for (const std::vector<Difference>& list : lists_) {
      for (const Difference& d : list) {
        all += d.weight * d.value * d.value;
      }
    }
    if (!(all > 0)) {
      return 1;
    }
    double left = all;
    for (int round = 0; round < kRounds; ++round) {
      SolveMap();
      left = SolveKernels();
    }
    return left / all;
  }

  const std::vector<double>& kernels() const { return kernels_; }
  const std::vector<double>& map() const { return map_; }

 private:
  template <class Work>
  void ForEach(Work&& work) const {
    for (std::size_t n = 0; n < lists_.size(); ++n) {
      for (const Difference& d : lists_[n]) {
        work(n, d);
      }
    }
  }

  void SolveMap() {
    std::vector<double> diagonal(map_.size(), 0.0);
    std::vector<double> r(map_.size(), 0.0);
    ForEach([&](std::size_t n, const Difference& d) {
      const double g = kernels_[n];
      diagonal[d.first] += d.weight * g * g;
      diagonal[d.second] += d.weight * g * g;
      const double pull =
          d.weight * g * (d.value - g * (map_[d.first] - map_[d.second]));
      r[d.first] += pull;
      r[d.second] -= pull;
    });
    const double prior = kPrior * std::reduce(diagonal.begin(), diagonal.end()) /
                             static_cast<double>(map_.size()) +
                         1e-300;
    for (std::size_t p = 0; p < map_.size(); ++p) {
      diagonal[p] += prior;
      r[p] -= prior * map_[p];
    }
    std::vector<double> z(map_.size());
    const auto precondition = [&] {
      double rz = 0;
      for (std::size_t p = 0; p < z.size(); ++p) {
        z[p] = r[p] / diagonal[p];
        rz += r[p] * z[p];
      }
      return rz;
    };
    double rz = precondition();
    std::vector<double> along = z;
    std::vector<double> product(map_.size());
    const double enough = kEnough * rz;
    for (int step = 0; step < kSteps && rz > enough; ++step) {
      for (std::size_t p = 0; p < product.size(); ++p) {
        product[p] = prior * along[p];
      }
      ForEach([&](std::size_t n, const Difference& d) {
        const double pull =
            d.weight * kernels_[n] * kernels_[n] * (along[d.first] - along[d.second]);
        product[d.first] += pull;
        product[d.second] -= pull;
      });
      const double length =
          rz / std::inner_product(along.begin(), along.end(), product.begin(), 0.0);
      for (std::size_t p = 0; p < along.size(); ++p) {
        map_[p] += length * along[p];
        r[p] -= length * product[p];
      }
      const double next = precondition();
      for (std::size_t p = 0; p < along.size(); ++p) {
        along[p] = z[p] + next / rz * along[p];
      }
      rz = next;
    }
  }

  double SolveKernels() {
    std::vector<double> squares(kernels_.size(), 1e-300);
    std::vector<double> products(kernels_.size(), 0.0);
    double all = 0;
    ForEach([&](std::size_t n, const Difference& d) {
      const double t = map_[d.first] - map_[d.second];
      squares[n] += d.weight * t * t;
      products[n] += d.weight * t * d.value;
      all += d.weight * d.value * d.value;
    });
    for (std::size_t n = 0; n < kernels_.size(); ++n) {
      kernels_[n] = products[n] / squares[n];
      all -= products[n] * kernels_[n];
    }
    return all;
  }

  std::vector<std::vector<Difference>> lists_;  // a channel and near cell
  std::vector<double> kernels_;
  std::vector<double> map_;
};

}  // namespace

std::vector<int> NearCells(const ReciprocalData& data) {
  std::vector<int> cells;
  for (std::size_t cell = 0; cell + 1 < data.cells; ++cell) {  // not the middle
    if (std::abs(data.OffsetX(cell)) <= kNear && data.OffsetY(cell) >= -kNear) {
      cells.push_back(static_cast<int>(cell));
    }
  }
  return cells;
}

void FitSides(const std::vector<PairSides>& near,
              int thread_count,
              ReciprocalData& data) {
  SidesFit fit(near, thread_count, data);
  if (!(fit.Run() < 1 - kLeastPart)) {
    return;
  }
  const int grid_width = data.width - 2 * data.margin;
  const int grid_height = data.height - 2 * data.margin;
  const double points = static_cast<double>(grid_width) * grid_height;
  double mean = 0;
  double square = 0;
  for (int y = data.margin; y < data.margin + grid_height; ++y) {
    for (int x = data.margin; x < data.margin + grid_width; ++x) {
      const double q =
          fit.map()[static_cast<std::size_t>(std::int64_t{y} * data.width + x)];
      mean += q / points;
      square += q * q / points;
    }
  }
  const double largest = *std::max_element(
      fit.kernels().begin(), fit.kernels().end(), [](double a, double b) {
        return std::abs(a) < std::abs(b);
      });
  const double rms = std::sqrt(std::max(square - mean * mean, 1e-300));
  const double unit = std::copysign(rms, largest);
  data.sides = SharedMaps::Zero(1, static_cast<Eigen::Index>(data.Plane()));
  for (std::size_t p = 0; p < data.Plane(); ++p) {
    data.sides(0, static_cast<Eigen::Index>(p)) =
        static_cast<float>((fit.map()[p] - mean) / unit);
  }
  ExtendMaps(data.width, data.height, data.margin, data.sides);
  data.sides_near = fit.kernels();
  for (double& kernel : data.sides_near) {
    kernel *= unit;
  }
}

void MergeSides(const std::vector<PairSides>& near, ReciprocalData& data) {
  const std::vector<int> cells = NearCells(data);
  for (std::size_t n = 0; n < near.size(); ++n) {
    const auto cell = static_cast<std::size_t>(cells[n % cells.size()]);
    const std::size_t channel = n / cells.size();
    const auto held = static_cast<std::size_t>(
        std::find(data.held.begin(), data.held.end(), static_cast<int>(cell)) -
        data.held.begin());
    const PlaneArea area = AreaOf(data, cell);
    const int to = data.OffsetY(cell) * data.width + data.OffsetX(cell);
    for (int y = area.y0; y < area.y1; ++y) {
      for (int x = area.x0; x < area.x1; ++x) {
        const int p = y * data.width + x;
        const auto at = static_cast<std::size_t>(p);
        const bool has_first = near[n].first.weight[at] >= 0;
        const bool has_second = near[n].second.weight[at] >= 0;
        const double first = data.sides.size() == 0
                                 ? 1
                                 : std::exp(data.sides_near[n] *
                                            static_cast<double>(data.sides(0, p) -
                                                                data.sides(0, p + to)));
        const double a = has_first ? first : 0;
        const double b = has_second ? 1 / first : 0;
        const double norm = a * a + b * b;
        if (!(norm > 0)) {
          continue;
        }
        const double va = static_cast<double>(near[n].first.weight[at]);
        const double vb = static_cast<double>(near[n].second.weight[at]);
        const auto value =
            static_cast<float>((a * static_cast<double>(near[n].first.value[at]) +
                                b * static_cast<double>(near[n].second.value[at])) /
                               norm);
        const auto variance =
            static_cast<float>((a * a * va + b * b * vb) / (norm * norm));
        if (held < data.held.size()) {
          data.pairs.value[data.HeldOffset(channel, held) + at] = value;
          data.pairs.weight[data.HeldOffset(channel, held) + at] = variance;
        }
        if (!data.HoldsAll() && at % data.stride == cell % data.stride) {
          const std::size_t to_sample =
              data.SampleOffset(channel, cell) + at / data.stride;
          data.sample.value[to_sample] = value;
          data.sample.weight[to_sample] = variance;
        }
      }
    }
  }
}

namespace {

// Kernels of all offsets of a channel, from the sampled slices.
std::vector<double> SampledKernels(const Job& job,
                                   const ReciprocalData& data,
                                   int channel,
                                   double typical,
                                   const Material& m) {
  const auto window = static_cast<std::size_t>(m.WindowSize());
  std::vector<double> squares(data.cells, kFarPrior / (typical * typical));
  std::vector<double> products(data.cells, 0.0);
  std::vector<float> modelled(window);
  for (std::size_t row = 0; row < job.sample.rows.size(); ++row) {
    const auto x = static_cast<int>(job.sample.rows[row] % m.points_x);
    const auto y = static_cast<int>(job.sample.rows[row] / m.points_x);
    ReciprocalWindows(m, {x, y}, channel, 1, modelled.data());
    const std::size_t slice =
        (row * data.channels + static_cast<std::size_t>(channel)) * window;
    const auto side = [&](int i, int j) {
      return static_cast<double>(
          data.sides(0, (j + data.margin) * data.width + i + data.margin));
    };
    for (std::size_t n = 0; n < window; ++n) {
      const std::size_t cell = std::min(n, window - 1 - n);
      const int sign = n == cell ? 1 : -1;
      const int i = x + sign * data.OffsetX(cell);
      const int j = y + sign * data.OffsetY(cell);
      if (i < 0 || j < 0 || i >= m.points_x || j >= m.points_y ||
          job.sample.dataset.valid[slice + n] == 0) {
        continue;
      }
      const auto c = static_cast<std::size_t>(channel);
      const double model = static_cast<double>(modelled[n]) / data.scale[c];
      const double error =
          static_cast<double>(job.sample.dataset.rd[slice + n]) / data.scale[c] - model;
      const double change = model * (side(x, y) - side(i, j));
      const double weight = 1 / Tolerance(model, data.tail_weight);
      squares[cell] += weight * change * change;
      products[cell] += weight * change * error;
    }
  }
  for (std::size_t cell = 0; cell < data.cells; ++cell) {
    products[cell] /= squares[cell];
  }
  return products;
}

}  // namespace

void AddSides(const Job& job, const ReciprocalData& data, Material& m) {
  if (data.sides.size() == 0) {
    return;
  }
  const std::vector<int> near = NearCells(data);
  std::vector<std::vector<double>> kernels;
  for (std::size_t c = 0; c < data.channels; ++c) {
    const double* own = &data.sides_near[c * near.size()];
    const double squares = std::inner_product(own, own + near.size(), own, 1e-12);
    kernels.push_back(
        SampledKernels(job,
                       data,
                       static_cast<int>(c),
                       std::sqrt(squares / static_cast<double>(near.size())),
                       m));
    for (std::size_t n = 0; n < near.size(); ++n) {
      kernels.back()[static_cast<std::size_t>(near[n])] = own[n];
    }
    kernels.back().back() = 0;  // the middle: a point and itself
  }
  const auto size = static_cast<std::size_t>(m.KernelSize());
  const auto window = static_cast<std::size_t>(m.WindowSize());
  std::vector<float> h;
  for (std::size_t c = 0; c < data.channels; ++c) {
    const float* own = m.Kernel(static_cast<int>(c), 0, 0);
    h.insert(h.end(), own, own + size * static_cast<std::size_t>(m.KernelCount()));
    for (std::size_t cell = 0; cell < size; ++cell) {
      h.push_back(static_cast<float>(kernels[c][std::min(cell, window - 1 - cell)]));
    }
  }
  m.h = std::move(h);
  m.f.insert(m.f.end(), data.sides.data(), data.sides.data() + data.sides.size());
  m.sides = 1;
}

}  // namespace nacre::factor::internal
