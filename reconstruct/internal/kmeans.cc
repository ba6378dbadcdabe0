#include "reconstruct/internal/kmeans.h"

#include "core/parallel.h"
#include "core/random.h"
#include "core/ranks.h"
#include "reconstruct/internal/nearest_centres.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace nacre::reconstruct::internal {
namespace {

// Bounds are kept in floats: widened by what their rounding can add up to.
constexpr float kSlack = 1e-5F;

using Centres = std::vector<double>;  // row by row, as the points

void AppendCentre(const PointSet& points, std::int64_t n, Centres& centres) {
  centres.insert(centres.end(), points.Row(n), points.Row(n) + points.dimensions);
}

// Each next centre is a point drawn in proportion to its squared distance to the
// nearest centre so far [Arthur07].
Centres Seed(const PointSet& points, int k, RandomStream& random) {
  const auto count = static_cast<std::size_t>(points.count);
  auto chosen =
      static_cast<std::int64_t>(random.Uniform() * static_cast<double>(points.count));
  Centres centres;
  AppendCentre(points, chosen, centres);
  std::vector<float> distance(count, std::numeric_limits<float>::max());
  for (int c = 1; c < k; ++c) {
    LowerToDistance2(points, points.Row(chosen), distance);
    const double total = std::accumulate(distance.begin(), distance.end(), 0.0);
    if (total <= 0) {
      break;  // all points are centres already
    }
    double left = random.Uniform() * total;
    for (std::size_t n = 0; n < count && left >= 0; ++n) {
      if (distance[n] > 0) {
        chosen = static_cast<std::int64_t>(n);
        left -= static_cast<double>(distance[n]);
      }
    }
    AppendCentre(points, chosen, centres);
  }
  return centres;
}

// One run of Lloyd's iteration.
class Lloyd {
 public:
  Lloyd(const PointSet& points, const KMeansOptions& options)
      : points_(points), options_(options) {
    RandomStream random(options.seed, options.run);
    centres_ = Seed(points, options.clusters, random);
    const auto count = static_cast<std::size_t>(points.count);
    result_.centre_count =
        static_cast<int>(centres_.size() / static_cast<std::size_t>(points.dimensions));
    result_.labels.assign(count, -1);
    upper_.assign(count, std::numeric_limits<float>::max());
    lower_.assign(count, 0.0F);
    sums_.assign(centres_.size(), 0.0);
    sizes_.assign(static_cast<std::size_t>(result_.centre_count), 0.0);
  }

  KMeansResult Run() {
    while (result_.iterations < options_.max_iterations) {
      ++result_.iterations;
      if (!Assign()) {
        break;
      }
      Update();
    }
    Finish();
    return std::move(result_);
  }

 private:
  // Labels of the nearest centres (the first of equals); true if any changed.
  bool Assign() {
    const NearestCentres nearest(centres_, result_.centre_count, points_.dimensions);
    const std::vector<float> half = HalfGaps(nearest);
    undecided_.clear();
    for (std::int64_t n = 0; n < points_.count; ++n) {
      const auto at = static_cast<std::size_t>(n);
      const int label = result_.labels[at];
      // No other centre can be as near as the own one [Hamerly10, lemma 1].
      const bool decided =
          options_.use_bounds && label >= 0 &&
          upper_[at] * (1 + kSlack) <
              std::max(half[static_cast<std::size_t>(label)], lower_[at]);
      if (!decided) {
        undecided_.push_back(n);
      }
    }
    found_.resize(undecided_.size());
    nearest.Find(points_, undecided_, found_);
    result_.distance_count += std::ssize(undecided_) * result_.centre_count;
    bool changed = false;
    for (std::size_t m = 0; m < undecided_.size(); ++m) {
      const auto at = static_cast<std::size_t>(undecided_[m]);
      upper_[at] = std::sqrt(found_[m].distance2);
      lower_[at] = std::sqrt(found_[m].second_distance2) * (1 - kSlack);
      changed = Move(undecided_[m], found_[m].centre) || changed;
    }
    return changed;
  }

  // Keeps the sums of each cluster's points up to date.
  bool Move(std::int64_t n, int to) {
    int& label = result_.labels[static_cast<std::size_t>(n)];
    if (label == to) {
      return false;
    }
    Add(n, to, 1.0);
    if (label >= 0) {
      Add(n, label, -1.0);
    }
    label = to;
    return true;
  }

  void Add(std::int64_t n, int cluster, double sign) {
    double* sum =
        &sums_[static_cast<std::size_t>(std::int64_t{cluster} * points_.dimensions)];
    const float* row = points_.Row(n);
    for (int d = 0; d < points_.dimensions; ++d) {
      sum[d] += sign * static_cast<double>(row[d]);
    }
    sizes_[static_cast<std::size_t>(cluster)] += sign;
  }

  // Half the distance of each centre to its nearest neighbour.
  std::vector<float> HalfGaps(const NearestCentres& nearest) const {
    PointSet rows{
        {centres_.begin(), centres_.end()}, result_.centre_count, points_.dimensions};
    std::vector<std::int64_t> all(static_cast<std::size_t>(result_.centre_count));
    std::iota(all.begin(), all.end(), 0);
    std::vector<Nearest> found(all.size());
    nearest.Find(rows, all, found);
    std::vector<float> half;
    half.reserve(found.size());
    for (const Nearest& own : found) {
      half.push_back(0.5F * std::sqrt(own.second_distance2) * (1 - kSlack));
    }
    return half;
  }

  // Centres to the means of their points; one that lost all of them stays. Bounds
  // follow what the centres moved by.
  void Update() {
    std::vector<float> moved(static_cast<std::size_t>(result_.centre_count), 0.0F);
    const auto dimensions = static_cast<std::size_t>(points_.dimensions);
    for (std::size_t c = 0; c < moved.size(); ++c) {
      double square = 0;
      for (std::size_t d = c * dimensions; sizes_[c] > 0 && d < (c + 1) * dimensions;
           ++d) {
        const double mean = sums_[d] / sizes_[c];
        square += (mean - centres_[d]) * (mean - centres_[d]);
        centres_[d] = mean;
      }
      moved[c] = static_cast<float>(std::sqrt(square)) * (1 + kSlack);
    }
    const auto farthest = std::max_element(moved.begin(), moved.end());
    float second = 0;
    for (auto it = moved.begin(); it != moved.end(); ++it) {
      second = it == farthest ? second : std::max(second, *it);
    }
    const auto farthest_label = static_cast<int>(farthest - moved.begin());
    for (std::size_t n = 0; n < upper_.size(); ++n) {
      const int label = result_.labels[n];
      upper_[n] += moved[static_cast<std::size_t>(label)];
      lower_[n] =
          std::max(0.0F, lower_[n] - (label == farthest_label ? second : *farthest));
    }
  }

  void Finish() {
    for (std::int64_t n = 0; n < points_.count; ++n) {
      const double* centre = &centres_[static_cast<std::size_t>(
          std::int64_t{result_.labels[static_cast<std::size_t>(n)]} *
          points_.dimensions)];
      const float* row = points_.Row(n);
      for (int d = 0; d < points_.dimensions; ++d) {
        const double difference = static_cast<double>(row[d]) - centre[d];
        result_.inertia += difference * difference;
      }
    }
  }

  const PointSet& points_;
  const KMeansOptions& options_;
  KMeansResult result_;
  Centres centres_;
  std::vector<double> sums_;  // of the points of each cluster
  std::vector<double> sizes_;
  std::vector<float> upper_;  // bound of the distance to the own centre
  std::vector<float> lower_;  // bound of the distance to all others
  std::vector<std::int64_t> undecided_;
  std::vector<Nearest> found_;
};

// Collective: the result of least inertia, of the first of equal ones, as of runs in
// one process.
KMeansResult BestOfRanks(const Ranks& ranks, bool has_one, const KMeansResult& own) {
  const double inertia =
      has_one ? own.inertia : std::numeric_limits<double>::infinity();
  const auto all = ranks.AllGather(ToBytes(std::span<const double>(&inertia, 1)));
  const auto best = std::min_element(
      all.begin(), all.end(), [](const std::string& a, const std::string& b) {
        return FromBytes<double>(a).front() < FromBytes<double>(b).front();
      });
  const int winner = static_cast<int>(best - all.begin());
  const bool is_winner = ranks.rank() == winner;
  const std::int64_t numbers[] = {own.iterations, own.centre_count, own.distance_count};
  const auto counts =
      ranks.AllGather(is_winner ? ToBytes(std::span<const std::int64_t>(numbers)) : "");
  const auto labels =
      ranks.AllGather(is_winner ? ToBytes(std::span<const int>(own.labels)) : "");
  KMeansResult result;
  const auto from = static_cast<std::size_t>(winner);
  const auto values = FromBytes<std::int64_t>(counts[from]);
  result.labels = FromBytes<int>(labels[from]);
  result.inertia = FromBytes<double>(*best).front();
  result.iterations = static_cast<int>(values[0]);
  result.centre_count = static_cast<int>(values[1]);
  result.distance_count = values[2];
  return result;
}

}  // namespace

KMeansResult KMeans(const PointSet& points, const KMeansOptions& options) {
  return Lloyd(points, options).Run();
}

KMeansResult BestKMeans(const PointSet& points,
                        const KMeansOptions& options,
                        int restarts,
                        const Workers& workers) {
  const RankShare share = ShareOf(restarts, workers.ranks);
  std::vector<KMeansResult> runs(static_cast<std::size_t>(share.end - share.begin));
  ParallelFor(std::ssize(runs), workers.thread_count, [&](std::int64_t n) {
    KMeansOptions one = options;
    one.run = static_cast<std::uint64_t>(share.begin + n);
    runs[static_cast<std::size_t>(n)] = KMeans(points, one);
  });
  const auto best =
      std::min_element(runs.begin(), runs.end(), [](const auto& a, const auto& b) {
        return a.inertia < b.inertia;
      });
  KMeansResult own = best != runs.end() ? std::move(*best) : KMeansResult{};
  return workers.ranks == nullptr ? own
                                  : BestOfRanks(*workers.ranks, !runs.empty(), own);
}

}  // namespace nacre::reconstruct::internal
