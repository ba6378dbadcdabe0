#include "cli/view/sample.h"

#include "cli/artefact.h"
#include "core/error.h"
#include "core/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <numeric>

namespace nacre::cli::view {
namespace {

using reconstruct::RdSlice;

class DatasetSample final : public Sample {
 public:
  DatasetSample(const std::filesystem::path& path, const ProgressFunction& progress)
      : reader_(path) {
    header_ = reader_.header();
    albedo_.assign(header_.channels.size(), {});
    for (int j = 0; j < header_.points_y; ++j) {
      Report(progress, {"read", j, header_.points_y, ""});
      for (int i = 0; i < header_.points_x; ++i) {
        Add(reader_.ReadSlice(i, j));
      }
    }
  }

  RdSlice Slice(int i, int j, int) const override {
    const std::lock_guard lock(mutex_);
    return reader_.ReadSlice(i, j);
  }

 private:
  void Add(const RdSlice& slice) {
    const auto size = static_cast<std::size_t>(header_.WindowSize());
    for (std::size_t c = 0; c < albedo_.size(); ++c) {
      const auto begin = slice.rd.begin() + static_cast<std::ptrdiff_t>(c * size);
      const double sum =
          std::accumulate(begin, begin + static_cast<std::ptrdiff_t>(size), 0.0);
      albedo_[c].push_back(static_cast<float>(sum * header_.CellAreaMm2()));
    }
  }

  mutable std::mutex mutex_;  // the reader isn't thread-safe
  mutable reconstruct::RdReader reader_;
};

class MaterialSample final : public Sample {
 public:
  explicit MaterialSample(const std::filesystem::path& path)
      : material_(factor::ReadMaterial(path)) {
    header_ = {.points_x = material_.points_x,
               .points_y = material_.points_y,
               .core = material_.core,
               .pitch_mm = material_.pitch_mm,
               .eta = material_.eta,
               .channels = material_.channels,
               .provenance = material_.provenance};
    const auto points = static_cast<std::size_t>(header_.PointCount());
    for (std::size_t c = 0; c < material_.channels.size(); ++c) {
      const float* begin = &material_.albedo[c * points];
      albedo_.emplace_back(begin, begin + points);
    }
  }

  RdSlice Slice(int i, int j, int terms) const override {
    RdSlice slice = MakeSlice(header_);
    for (int c = 0; c < static_cast<int>(header_.channels.size()); ++c) {
      float* window = &slice.rd[static_cast<std::size_t>(c * header_.WindowSize())];
      if (terms > 0 && terms < material_.terms) {
        material_.EvaluateTerms(c, i, j, terms, window);
      } else {
        material_.EvaluateWindow(c, i, j, window);
      }
    }
    return slice;
  }

  const factor::Material* material() const override { return &material_; }

 private:
  factor::Material material_;
};

// The share of a cell (side 1, at distance `away` from the disc's centre) within a
// disc: the chord's place along the way out, as if the rim were straight.
double ShareInside(double away, double radius) {
  return std::clamp(radius - away + 0.5, 0.0, 1.0);
}

// A window around a grid point, times `weight`, onto the grid.
void AddWindow(const reconstruct::RdHeader& header,
               int centre_i,
               int centre_j,
               const float* window,
               float weight,
               std::vector<float>& exitance) {
  const int reach = header.Radius();
  for (int v = 0; v < header.core; ++v) {
    for (int u = 0; u < header.core; ++u) {
      const int i = centre_i + u - reach;
      const int j = centre_j + v - reach;
      if (i >= 0 && i < header.points_x && j >= 0 && j < header.points_y) {
        exitance[static_cast<std::size_t>(std::int64_t{j} * header.points_x + i)] +=
            weight * window[v * header.core + u];
      }
    }
  }
}

}  // namespace

float Sample::LargestAlbedo() const {
  float largest = 0;
  for (const std::vector<float>& plane : albedo_) {
    largest = std::max(largest, *std::max_element(plane.begin(), plane.end()));
  }
  return largest;
}

std::unique_ptr<Sample> OpenSample(const std::filesystem::path& path,
                                   const ProgressFunction& progress) {
  switch (const ArtefactKind kind = DetectKind(path)) {
    case ArtefactKind::kDataset:
      return std::make_unique<DatasetSample>(path, progress);
    case ArtefactKind::kMaterial:
      return std::make_unique<MaterialSample>(path);
    default:
      throw BadData(path.string() + ": " + Name(kind) +
                    "; a dataset (*.rd.exr) or a material (*.nacre.exr) is needed");
  }
}

std::vector<std::vector<float>> LightDisc(const Sample& sample,
                                          double x_mm,
                                          double y_mm,
                                          double radius_mm) {
  const reconstruct::RdHeader& header = sample.header();
  std::vector<std::vector<float>> exitance(
      header.channels.size(),
      std::vector<float>(static_cast<std::size_t>(header.PointCount())));
  for (int j = 0; j < header.points_y; ++j) {
    for (int i = 0; i < header.points_x; ++i) {
      const PointMm point = header.GridPoint(i, j);
      const double share =
          ShareInside(std::hypot(point.x - x_mm, point.y - y_mm) / header.pitch_mm,
                      radius_mm / header.pitch_mm);
      if (share <= 0) {
        continue;
      }
      const RdSlice slice = sample.Slice(i, j, 0);
      const auto weight = static_cast<float>(share * header.CellAreaMm2());
      for (std::size_t c = 0; c < exitance.size(); ++c) {
        const float* window =
            &slice.rd[c * static_cast<std::size_t>(header.WindowSize())];
        AddWindow(header, i, j, window, weight, exitance[c]);
      }
    }
  }
  return exitance;
}

}  // namespace nacre::cli::view
