// Collective calls made of messages: few and small ones, in an order that is the same
// for every run. How messages travel is in core/ranks_mpi.cc.

#include "core/ranks.h"

#include "core/error.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <thread>

namespace nacre {
namespace {

constexpr int kTagLimit = 1000;
constexpr int kCollective = kTagLimit;  // a tag of its own

std::optional<int> FromEnvironment(const char* name) {
  const char* text = std::getenv(name);
  if (text == nullptr) {
    return std::nullopt;
  }
  int value = 0;
  const char* end = text + std::strlen(text);
  const auto [at, error] = std::from_chars(text, end, value);
  return error == std::errc{} && at == end ? std::optional<int>(value) : std::nullopt;
}

std::string Pack(const std::vector<std::string>& parts) {
  std::string bytes;
  for (const std::string& part : parts) {
    const std::uint64_t size = part.size();
    bytes += ToBytes(std::span<const std::uint64_t>(&size, 1)) + part;
  }
  return bytes;
}

std::vector<std::string> Unpack(const std::string& bytes) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at < bytes.size();) {
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data() + at, sizeof(size));
    parts.push_back(bytes.substr(at + sizeof(size), size));
    at += sizeof(size) + size;
  }
  return parts;
}

}  // namespace

void Ranks::Sum(std::span<std::int64_t> values) const {
  for (int step = 1; step < size_; step *= 2) {
    if (rank_ % (2 * step) != 0) {
      Post(rank_ - step, kCollective, ToBytes(std::span<const std::int64_t>(values)));
      break;
    }
    if (rank_ + step < size_) {
      const auto other =
          FromBytes<std::int64_t>(Receive(kCollective, rank_ + step).bytes);
      Expect(other.size() == values.size(), "as many values to sum on all ranks");
      for (std::size_t k = 0; k < values.size(); ++k) {
        values[k] += other[k];
      }
    }
  }
  std::string total = ToBytes(std::span<const std::int64_t>(values));
  Broadcast(total);
  if (!values.empty()) {
    std::memcpy(values.data(), total.data(), values.size_bytes());
  }
}

// Down a binary tree: the rank whose lowest set bit is `step` gets it from the one
// without that bit.
void Ranks::Broadcast(std::string& bytes) const {
  int step = 1;
  while (step < size_ && (rank_ & step) == 0) {
    step *= 2;
  }
  if (rank_ != 0) {
    bytes = Receive(kCollective, rank_ - step).bytes;
  }
  for (step /= 2; step > 0; step /= 2) {
    if (rank_ + step < size_) {
      Post(rank_ + step, kCollective, bytes);
    }
  }
}

std::vector<std::string> Ranks::Gather(const std::string& bytes) const {
  if (rank_ != 0) {
    Post(0, kCollective, bytes);
    return {};
  }
  std::vector<std::string> all{bytes};
  for (int from = 1; from < size_; ++from) {
    all.push_back(Receive(kCollective, from).bytes);
  }
  return all;
}

std::vector<std::string> Ranks::AllGather(const std::string& bytes) const {
  std::string all = Pack(Gather(bytes));
  Broadcast(all);
  return Unpack(all);
}

void Ranks::Barrier() const {
  Sum({});
}

void Ranks::Post(int to, int tag, std::string bytes) const {
  Expect(to >= 0 && to < size_ && to != rank_, "another rank to send to");
  Expect(tag >= 0 && tag <= kCollective, "a tag from 0 to 999");
  traffic_.bytes_sent += std::ssize(bytes);
  ++traffic_.messages_sent;
  DoPost(to, tag, std::move(bytes));
}

std::optional<RankMessage> Ranks::Poll(int tag, int from) const {
  std::optional<RankMessage> message = DoPoll(tag, from);
  if (message) {
    traffic_.bytes_received += std::ssize(message->bytes);
    ++traffic_.messages_received;
  }
  return message;
}

// Ranks may be more than there are cores: who waits sleeps, each time for an eighth of
// what it has waited so far, so that not much more than that is lost.
RankMessage Ranks::Receive(int tag, int from) const {
  using std::chrono::steady_clock;
  constexpr steady_clock::duration kShortest = std::chrono::microseconds(5);
  constexpr steady_clock::duration kLongest = std::chrono::milliseconds(1);
  const steady_clock::time_point start = steady_clock::now();
  for (;;) {
    if (std::optional<RankMessage> message = Poll(tag, from)) {
      return std::move(*message);
    }
    std::this_thread::sleep_for(
        std::clamp((steady_clock::now() - start) / 8, kShortest, kLongest));
  }
}

void Ranks::Abort(int exit_code) const {
  std::exit(exit_code);
}

// NOLINTNEXTLINE(performance-unnecessary-value-param): overriders keep the bytes
void Ranks::DoPost(int, int, std::string) const {
  throw LogicError("a process alone has nobody to send to");
}

std::optional<RankMessage> Ranks::DoPoll(int, int) const {
  throw LogicError("a process alone has nobody to hear from");
}

std::optional<LaunchedAs> FindLauncher() {
  constexpr const char* kNames[][2] = {{"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"},
                                       {"PMI_RANK", "PMI_SIZE"}};
  for (const auto& [rank_name, size_name] : kNames) {
    const std::optional<int> rank = FromEnvironment(rank_name);
    const std::optional<int> size = FromEnvironment(size_name);
    if (rank && size) {
      return LaunchedAs{*rank, *size};
    }
  }
  return std::nullopt;
}

RankShare ShareOf(std::int64_t count, int rank, int size) {
  return {count * rank / size, count * (rank + 1) / size};
}

RankShare ShareOf(std::int64_t count, const Ranks* ranks) {
  return ranks == nullptr ? RankShare{0, count}
                          : ShareOf(count, ranks->rank(), ranks->size());
}

}  // namespace nacre
