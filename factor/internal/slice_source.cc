#include "factor/internal/slice_source.h"

#include "core/error.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::factor::internal {
namespace {

using reconstruct::RdHeader;

class MemorySource : public SliceSource {
 public:
  explicit MemorySource(const reconstruct::RdDataset& dataset) : dataset_(dataset) {
    reconstruct::Validate(dataset.header, "dataset in memory");
    const auto expected = static_cast<std::size_t>(dataset.header.PointCount() *
                                                   dataset.header.SliceSize());
    if (dataset.rd.size() != expected || dataset.valid.size() != expected ||
        (!dataset.sigma.empty() && dataset.sigma.size() != expected)) {
      throw BadData(fmt::format(
          "dataset in memory: {} values and {} validity flags where its header says {}",
          dataset.rd.size(),
          dataset.valid.size(),
          expected));
    }
  }

  const RdHeader& header() const override { return dataset_.header; }

  SliceBlock Read(std::int64_t first, std::int64_t count) override {
    const auto offset = static_cast<std::size_t>(first * dataset_.header.SliceSize());
    return {first,
            count,
            &dataset_.rd[offset],
            &dataset_.valid[offset],
            dataset_.sigma.empty() ? nullptr : &dataset_.sigma[offset]};
  }

 private:
  const reconstruct::RdDataset& dataset_;
};

class FileSource : public SliceSource {
 public:
  explicit FileSource(reconstruct::RdReader& reader) : reader_(reader) {}

  const RdHeader& header() const override { return reader_.header(); }

  SliceBlock Read(std::int64_t first, std::int64_t count) override {
    const std::int64_t size = header().SliceSize();
    rd_.resize(static_cast<std::size_t>(count * size));
    valid_.resize(rd_.size());
    sigma_.resize(rd_.size());
    for (std::int64_t s = 0; s < count; ++s) {
      const std::int64_t slice_index = first + s;
      const reconstruct::RdSlice slice =
          reader_.ReadSlice(static_cast<int>(slice_index % header().points_x),
                            static_cast<int>(slice_index / header().points_x));
      std::copy(slice.rd.begin(), slice.rd.end(), rd_.begin() + s * size);
      std::copy(slice.valid.begin(), slice.valid.end(), valid_.begin() + s * size);
      std::copy(slice.sigma.begin(), slice.sigma.end(), sigma_.begin() + s * size);
    }
    return {first, count, rd_.data(), valid_.data(), sigma_.data()};
  }

 private:
  reconstruct::RdReader& reader_;
  std::vector<float> rd_;
  std::vector<std::uint8_t> valid_;
  std::vector<float> sigma_;
};

}  // namespace

std::unique_ptr<SliceSource> SourceOf(const reconstruct::RdDataset& dataset) {
  return std::make_unique<MemorySource>(dataset);
}

std::unique_ptr<SliceSource> SourceOf(reconstruct::RdReader& reader) {
  return std::make_unique<FileSource>(reader);
}

}  // namespace nacre::factor::internal
