#include "render/subsurface/window_source.h"

#include "core/error.h"
#include "factor/material_file.h"
#include "reconstruct/rd_dataset.h"

#include <algorithm>
#include <atomic>
#include <cmath>
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

float LargestOf(const float* values, std::int64_t count) {
  float largest = 0;
  for (std::int64_t n = 0; n < count; ++n) {
    largest = std::max(largest, std::abs(values[n]));
  }
  return largest;
}

// By how much R_d changes at most, of its largest value, if the sum of terms changes by
// `s`.
double ErrorOfSum(const factor::Material& channel, double largest, double s) {
  switch (channel.transform) {
    case factor::Transform::kLinear:
      return s / largest;
    case factor::Transform::kSqrt:
      return s * (2 * std::sqrt(largest) + s) / largest;
    case factor::Transform::kLog:
      break;
  }
  // R_d + A B is multiplied by eˢ.
  return (1 + channel.a[0] * channel.b[0] / largest) * std::expm1(s);
}

// A material of one channel without its last terms, as many as `error` allows.
factor::Material WithinError(const factor::Material& channel, double error) {
  double largest = 0;
  for (int j = 0; j < channel.points_y; ++j) {
    for (int i = 0; i < channel.points_x; ++i) {
      const int middle = channel.core / 2;
      const auto scale = static_cast<double>(channel.row_scale[static_cast<std::size_t>(
          std::int64_t{j} * channel.points_x + i)]);
      const auto peak = static_cast<double>(channel.Evaluate(0, i, j, middle, middle));
      largest = std::max(largest, scale > 0 ? peak / scale : 0);
    }
  }
  int terms = channel.terms;
  double left_out = 0;
  while (terms > 1 && largest > 0) {
    float kernel = 0;
    for (int k = 0; k < channel.cluster_count; ++k) {
      kernel = std::max(
          kernel, LargestOf(channel.Kernel(0, k, terms - 1), channel.KernelSize()));
    }
    left_out += static_cast<double>(kernel) *
                static_cast<double>(
                    LargestOf(channel.FactorMap(0, terms - 1), channel.MapSize()));
    if (ErrorOfSum(channel, largest, left_out) > error) {
      break;
    }
    --terms;
  }
  factor::Material fewer = channel;
  fewer.terms = terms;
  fewer.f.resize(static_cast<std::size_t>(terms * channel.MapSize()));
  fewer.h.clear();
  for (int k = 0; k < channel.cluster_count; ++k) {
    const float* first = channel.Kernel(0, k, 0);
    fewer.h.insert(fewer.h.end(), first, first + terms * channel.KernelSize());
  }
  return fewer;
}

// The grid, as a material's header and a dataset's both have it.
template <class Header>
void SetGrid(const Header& header, WindowSource& source) {
  source.points_x = header.points_x;
  source.points_y = header.points_y;
  source.core = header.core;
  source.pitch_mm = header.pitch_mm;
  source.eta = header.eta;
  source.channels = header.channels;
}

class MaterialFileSource final : public WindowSource {
 public:
  MaterialFileSource(const std::filesystem::path& path, double error)
      : file_(path), error_(error), channels_(file_.header().channels.size()) {
    SetGrid(file_.header(), *this);
    if (file_.header().is_grey) {
      channels.resize(1);
    }
  }

  void EvaluateWindow(int channel, int i, int j, float* window) const override {
    Of(channel).EvaluateWindow(0, i, j, window);
  }
  float Evaluate(int channel, int i, int j, int u, int v) const override {
    return Of(channel).Evaluate(0, i, j, u, v);
  }
  float Albedo(int channel, int i, int j) const override {
    return Of(channel).albedo[static_cast<std::size_t>(std::int64_t{j} * points_x + i)];
  }
  int channels_read() const override { return file_.channels_read(); }
  int terms_used() const override { return terms_used_.load(); }
  int terms_total() const override {
    return file_.header().terms * static_cast<int>(channels.size());
  }

 private:
  struct Channel {
    std::once_flag read;
    factor::Material fewer;
    const factor::Material* used = nullptr;
  };

  const factor::Material& Of(int channel) const {
    Channel& kept = channels_[static_cast<std::size_t>(channel)];
    std::call_once(kept.read, [&] {
      kept.used = &file_.Channel(channel);
      if (error_ > 0 && kept.used->form == factor::Form::kSum) {
        kept.fewer = WithinError(*kept.used, error_);
        kept.used = &kept.fewer;
      }
      terms_used_.fetch_add(kept.used->terms);
    });
    return *kept.used;
  }

  factor::MaterialFile file_;
  double error_;
  mutable std::vector<Channel> channels_;
  mutable std::atomic<int> terms_used_ = 0;
};

class DatasetSource final : public WindowSource {
 public:
  explicit DatasetSource(const std::filesystem::path& path) : reader_(path) {
    SetGrid(reader_.header(), *this);
    slices_ = std::vector<std::atomic<const std::vector<float>*>>(
        static_cast<std::size_t>(reader_.header().PointCount()));
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
    const auto cell = static_cast<std::size_t>(std::int64_t{v} * core + u);
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
    auto& slot = slices_[static_cast<std::size_t>(std::int64_t{j} * points_x + i)];
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

std::shared_ptr<const WindowSource> OpenMaterialSource(
    const std::filesystem::path& path, double error) {
  return std::make_shared<MaterialFileSource>(path, error);
}

std::shared_ptr<const WindowSource> OpenDatasetSource(
    const std::filesystem::path& path) {
  return std::make_shared<DatasetSource>(path);
}

}  // namespace nacre::render
