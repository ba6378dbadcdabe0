#include "core/lot_sum.h"

#include "core/error.h"

#include <algorithm>

namespace nacre {
namespace {

constexpr int kTag = 999;

void AddTo(std::vector<double>& sum, const std::vector<double>& values) {
  Expect(sum.size() == values.size(), "lots of one size");
  for (std::size_t k = 0; k < sum.size(); ++k) {
    sum[k] += values[k];
  }
}

}  // namespace

LotSum::LotSum(std::int64_t lot_count, const Ranks* ranks)
    : lot_count_(lot_count),
      ranks_(ranks),
      own_(ShareOf(lot_count, ranks)),
      next_(own_.begin) {}

void LotSum::Add(std::vector<double> values) {
  Expect(next_ < own_.end, "no more lots than this rank's");
  nodes_.push_back({0, next_++, std::move(values)});
  while (nodes_.size() > 1) {
    const Node& right = nodes_.back();
    Node& left = nodes_[nodes_.size() - 2];
    if (left.level != right.level || right.index % 2 == 0) {
      break;
    }
    AddTo(left.values, right.values);
    ++left.level;
    left.index /= 2;
    nodes_.pop_back();
  }
}

int LotSum::Owner(std::int64_t lot) const {
  const int size = ranks_ == nullptr ? 1 : ranks_->size();
  int owner = static_cast<int>(lot * size / lot_count_);
  while (ShareOf(lot_count_, owner, size).end <= lot) {
    ++owner;
  }
  while (ShareOf(lot_count_, owner, size).begin > lot) {
    --owner;
  }
  return owner;
}

// The sum of a node's lots where its first lot is owned; nothing elsewhere.
std::vector<double> LotSum::Reduce(int level, std::int64_t index) {
  const std::int64_t begin = index << level;
  const std::int64_t end = std::min(lot_count_, (index + 1) << level);
  if (begin >= end || own_.end <= begin || own_.begin >= end) {
    return {};
  }
  const auto known = std::find_if(nodes_.begin(), nodes_.end(), [&](const Node& node) {
    return node.level == level && node.index == index;
  });
  if (known != nodes_.end()) {
    return std::move(known->values);
  }
  Expect(level > 0, "all lots of this rank");
  std::vector<double> left = Reduce(level - 1, 2 * index);
  const std::int64_t middle = (2 * index + 1) << (level - 1);
  if (middle >= lot_count_) {
    return left;
  }
  std::vector<double> right = Reduce(level - 1, 2 * index + 1);
  const int left_owner = Owner(begin);
  const int right_owner = Owner(middle);
  const int own = ranks_ == nullptr ? 0 : ranks_->rank();
  if (own == right_owner && own != left_owner) {
    ranks_->Post(left_owner, kTag, ToBytes(std::span<const double>(right)));
    return {};
  }
  if (own == left_owner) {
    if (own != right_owner) {
      right = FromBytes<double>(ranks_->Receive(kTag, right_owner).bytes);
    }
    AddTo(left, right);
  }
  return left;
}

std::vector<double> LotSum::Finish() {
  int level = 0;
  while ((std::int64_t{1} << level) < lot_count_) {
    ++level;
  }
  // The first lot may belong to another rank than the root, if ranks are more than
  // lots.
  std::vector<double> total = Reduce(level, 0);
  if (ranks_ == nullptr || ranks_->size() == 1 || lot_count_ == 0) {
    return total;
  }
  const int first = Owner(0);
  if (first != 0 && ranks_->rank() == first) {
    ranks_->Post(0, kTag, ToBytes(std::span<const double>(total)));
  }
  if (first != 0 && ranks_->IsRoot()) {
    total = FromBytes<double>(ranks_->Receive(kTag, first).bytes);
  }
  std::string bytes = ToBytes(std::span<const double>(total));
  ranks_->Broadcast(bytes);
  return FromBytes<double>(bytes);
}

}  // namespace nacre
