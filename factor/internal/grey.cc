// Datasets whose channels are all the same: one is factored, and stored once.

#include "factor/internal/grey.h"

#include "factor/internal/mean_slice.h"

#include <algorithm>
#include <cstring>

namespace nacre::factor::internal {
namespace {

constexpr std::int64_t kFirstLook = 16;  // slices

template <class T>
bool Repeats(const T* slice, std::int64_t window, std::int64_t channels) {
  for (std::int64_t c = 1; c < channels && slice != nullptr; ++c) {
    if (std::memcmp(slice,
                    slice + c * window,
                    static_cast<std::size_t>(window) * sizeof(T)) != 0) {
      return false;
    }
  }
  return true;
}

bool BlockRepeats(const reconstruct::RdHeader& header, const SliceBlock& block) {
  const std::int64_t window = header.WindowSize();
  const auto channels = std::ssize(header.channels);
  for (std::int64_t row = 0; row < block.count; ++row) {
    const std::int64_t at = row * header.SliceSize();
    if (!Repeats(block.rd + at, window, channels) ||
        !Repeats(block.valid + at, window, channels) ||
        !Repeats(
            block.sigma == nullptr ? nullptr : block.sigma + at, window, channels)) {
      return false;
    }
  }
  return true;
}

// Adds the first channel of each slice.
template <class T>
void Take(const T* from,
          const reconstruct::RdHeader& header,
          std::int64_t count,
          std::vector<T>& to) {
  const auto window = static_cast<std::size_t>(header.WindowSize());
  to.resize(static_cast<std::size_t>(count) * window);
  for (std::int64_t row = 0; row < count; ++row) {
    std::copy_n(from + row * header.SliceSize(),
                window,
                to.begin() + row * header.WindowSize());
  }
}

}  // namespace

bool HasEqualChannels(SliceSource& source) {
  const reconstruct::RdHeader& header = source.header();
  if (header.channels.size() < 2) {
    return false;
  }
  const std::int64_t points = header.PointCount();
  for (std::int64_t n = 0; n < kFirstLook; ++n) {
    if (!BlockRepeats(header, source.Read(n * points / kFirstLook, 1))) {
      return false;
    }
  }
  for (std::int64_t first = 0; first < points; first += kBlockRows) {
    if (!BlockRepeats(header,
                      source.Read(first, std::min(kBlockRows, points - first)))) {
      return false;
    }
  }
  return true;
}

FirstChannel::FirstChannel(SliceSource& source)
    : source_(source), header_(source.header()) {
  header_.channels.resize(1);
}

SliceBlock FirstChannel::Read(std::int64_t first, std::int64_t count) {
  const SliceBlock block = source_.Read(first, count);
  Take(block.rd, source_.header(), count, rd_);
  Take(block.valid, source_.header(), count, valid_);
  if (block.sigma != nullptr) {
    Take(block.sigma, source_.header(), count, sigma_);
  }
  return {first,
          count,
          rd_.data(),
          valid_.data(),
          block.sigma == nullptr ? nullptr : sigma_.data()};
}

void SpreadChannels(const std::vector<std::string>& channels, Material& m) {
  const auto repeat = [&](auto& values) {
    const auto once = values;
    for (std::size_t c = 1; c < channels.size(); ++c) {
      values.insert(values.end(), once.begin(), once.end());
    }
  };
  m.channels = channels;
  m.is_grey = true;
  repeat(m.a);
  repeat(m.b);
  repeat(m.row_scale);
  repeat(m.albedo);
}

}  // namespace nacre::factor::internal
