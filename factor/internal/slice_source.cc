#include "factor/internal/slice_source.h"

#include "core/error.h"

#include <algorithm>
#include <fmt/format.h>
#include <future>
#include <utility>

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
  bool in_memory() const override { return true; }

 private:
  const reconstruct::RdDataset& dataset_;
};

class FileSource : public SliceSource {
 public:
  explicit FileSource(reconstruct::RdReader& reader) : reader_(reader) {}

  const RdHeader& header() const override { return reader_.header(); }

  SliceBlock Read(std::int64_t first, std::int64_t count) override {
    if (ahead_.valid()) {
      ahead_.get();
      std::swap(now_, next_);
    }
    if (now_.first != first || now_.count != count) {
      Load(first, count, now_);
    }
    const std::int64_t end = first + count;
    if (count > 1 && end < header().PointCount()) {
      ahead_ = std::async(std::launch::async, [this, end, count] {
        Load(end, std::min(count, header().PointCount() - end), next_);
      });
    }
    return {first, count, now_.rd.data(), now_.valid.data(), now_.sigma.data()};
  }

  void Know(const std::vector<std::int64_t>* rows,
            const reconstruct::RdDataset* dataset) override {
    if (ahead_.valid()) {
      ahead_.wait();  // it may be looking
    }
    known_rows_ = rows;
    known_ = dataset;
  }

 private:
  struct Block {
    std::int64_t first = 0;
    std::int64_t count = 0;
    std::vector<float> rd;
    std::vector<std::uint8_t> valid;
    std::vector<float> sigma;
  };

  void Load(std::int64_t first, std::int64_t count, Block& block) {
    const std::int64_t size = header().SliceSize();
    block.count = 0;  // nothing, should reading fail
    block.rd.resize(static_cast<std::size_t>(count * size));
    block.valid.resize(block.rd.size());
    block.sigma.resize(block.rd.size());
    for (std::int64_t s = 0; s < count; ++s) {
      const std::int64_t n = first + s;
      if (CopyKnown(n, s * size, block)) {
        continue;
      }
      const reconstruct::RdSlice slice =
          reader_.ReadSlice(static_cast<int>(n % header().points_x),
                            static_cast<int>(n / header().points_x));
      std::copy(slice.rd.begin(), slice.rd.end(), block.rd.begin() + s * size);
      std::copy(slice.valid.begin(), slice.valid.end(), block.valid.begin() + s * size);
      std::copy(slice.sigma.begin(), slice.sigma.end(), block.sigma.begin() + s * size);
    }
    block.first = first;
    block.count = count;
  }

  // Whether slice n is known; if so, it is put there.
  bool CopyKnown(std::int64_t n, std::int64_t to, Block& block) const {
    if (known_rows_ == nullptr) {
      return false;
    }
    const auto found = std::lower_bound(known_rows_->begin(), known_rows_->end(), n);
    if (found == known_rows_->end() || *found != n) {
      return false;
    }
    const std::int64_t size = header().SliceSize();
    const std::int64_t from = (found - known_rows_->begin()) * size;
    const auto copy = [&](const auto& values, auto& target) {
      std::copy_n(values.begin() + from, size, target.begin() + to);
    };
    copy(known_->rd, block.rd);
    copy(known_->valid, block.valid);
    copy(known_->sigma, block.sigma);
    return true;
  }

  reconstruct::RdReader& reader_;
  const std::vector<std::int64_t>* known_rows_ = nullptr;
  const reconstruct::RdDataset* known_ = nullptr;
  Block now_;
  Block next_;
  std::future<void> ahead_;  // last: it is waited for before the blocks go
};

}  // namespace

std::unique_ptr<SliceSource> SourceOf(const reconstruct::RdDataset& dataset) {
  return std::make_unique<MemorySource>(dataset);
}

std::unique_ptr<SliceSource> SourceOf(reconstruct::RdReader& reader) {
  return std::make_unique<FileSource>(reader);
}

}  // namespace nacre::factor::internal
