#include "render/subsurface/window_source.h"

#include "core/error.h"
#include "reconstruct/rd_dataset.h"

#include <atomic>
#include <mutex>
#include <numeric>

namespace nacre::render {
namespace {

class MaterialSource final : public WindowSource {
 public:
  explicit MaterialSource(std::shared_ptr<const factor::Material> material)
      : material_(std::move(material)) {
    points_x = material_->points_x;
    points_y = material_->points_y;
    core = material_->core;
    pitch_mm = material_->pitch_mm;
    eta = material_->eta;
    channels = material_->channels;
  }

  void EvaluateWindow(int channel, int i, int j, float* window) const override {
    material_->EvaluateWindow(channel, i, j, window);
  }
  float Evaluate(int channel, int i, int j, int u, int v) const override {
    return material_->Evaluate(channel, i, j, u, v);
  }
  float Albedo(int channel, int i, int j) const override {
    const std::int64_t point = std::int64_t{j} * points_x + i;
    return material_
        ->albedo[static_cast<std::size_t>(channel * material_->PointCount() + point)];
  }

 private:
  std::shared_ptr<const factor::Material> material_;
};

class DatasetSource final : public WindowSource {
 public:
  explicit DatasetSource(const std::filesystem::path& path) : reader_(path) {
    const reconstruct::RdHeader& header = reader_.header();
    points_x = header.points_x;
    points_y = header.points_y;
    core = header.core;
    pitch_mm = header.pitch_mm;
    eta = header.eta;
    channels = header.channels;
    slices_ = std::vector<std::atomic<const std::vector<float>*>>(
        static_cast<std::size_t>(header.PointCount()));
  }
  ~DatasetSource() override {
    for (const auto& slice : slices_) {
      delete slice.load();
    }
  }

  void EvaluateWindow(int channel, int i, int j, float* window) const override {
    const std::size_t size = WindowSize();
    const float* values = &Slice(i, j)[static_cast<std::size_t>(channel) * size];
    std::copy(values, values + size, window);
  }
  float Evaluate(int channel, int i, int j, int u, int v) const override {
    const auto cell = static_cast<std::size_t>(v * core + u);
    return Slice(i, j)[static_cast<std::size_t>(channel) * WindowSize() + cell];
  }
  float Albedo(int channel, int i, int j) const override {
    return Slice(i,
                 j)[channels.size() * WindowSize() + static_cast<std::size_t>(channel)];
  }
  std::int64_t tiles_read() const override { return read_.load(); }
  std::int64_t tiles_total() const override {
    return static_cast<std::int64_t>(slices_.size());
  }

 private:
  std::size_t WindowSize() const {
    return static_cast<std::size_t>(core) * static_cast<std::size_t>(core);
  }

  /// The windows of all channels, then their albedos.
  const std::vector<float>& Slice(int i, int j) const {
    auto& slot = slices_[static_cast<std::size_t>(j * points_x + i)];
    if (const auto* known = slot.load(std::memory_order_acquire)) {
      return *known;
    }
    const std::lock_guard lock(reading_);
    if (const auto* known = slot.load(std::memory_order_acquire)) {
      return *known;
    }
    reconstruct::RdSlice slice = reader_.ReadSlice(i, j);
    for (float& value : slice.rd) {
      value = std::max(0.0F, value);  // noise about zero; light doesn't go backwards
    }
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const auto first =
          slice.rd.begin() + static_cast<std::ptrdiff_t>(c * WindowSize());
      const double sum = std::accumulate(
          first, first + static_cast<std::ptrdiff_t>(WindowSize()), 0.0);
      slice.rd.push_back(static_cast<float>(sum * pitch_mm * pitch_mm));
    }
    auto made = std::make_unique<const std::vector<float>>(std::move(slice.rd));
    slot.store(made.get(), std::memory_order_release);
    read_.fetch_add(1, std::memory_order_relaxed);
    return *made.release();
  }

  mutable std::mutex reading_;
  mutable reconstruct::RdReader reader_;
  mutable std::vector<std::atomic<const std::vector<float>*>> slices_;
  mutable std::atomic<std::int64_t> read_ = 0;
};

}  // namespace

std::shared_ptr<const WindowSource> MakeMaterialSource(
    std::shared_ptr<const factor::Material> material) {
  Expect(material != nullptr, "a source of windows needs a material");
  factor::Validate(*material, "subsurface");
  return std::make_shared<MaterialSource>(std::move(material));
}

std::shared_ptr<const WindowSource> OpenDatasetSource(
    const std::filesystem::path& path) {
  return std::make_shared<DatasetSource>(path);
}

}  // namespace nacre::render
