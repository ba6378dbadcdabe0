#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace nacre {

struct RankMessage {
  int from = 0;
  std::string bytes;
};

/// What this rank has sent and received itself, collective calls included.
struct RankTraffic {
  std::int64_t bytes_sent = 0;
  std::int64_t messages_sent = 0;
  std::int64_t bytes_received = 0;
  std::int64_t messages_received = 0;
};

inline constexpr int kAnyRank = -1;

/// The processes that share one run, of which this is number rank(). One of this class
/// itself is a process alone; where a function takes a pointer, null is the same. All
/// ranks must make the same collective calls in the same order. To be called by one
/// thread at a time. A rank that fails ends all others, see Abort: no call has to say
/// what becomes of it.
class Ranks {
 public:
  Ranks() = default;
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  bool IsRoot() const { return rank_ == 0; }

  /// Collective: the sums over ranks, on all ranks. Of doubles: core/lot_sum.h.
  void Sum(std::span<std::int64_t> values) const;
  /// Collective: the root's bytes, on all ranks.
  void Broadcast(std::string& bytes) const;
  /// Collective: what each rank gave, by rank, on the root; nothing elsewhere.
  std::vector<std::string> Gather(const std::string& bytes) const;
  /// Collective: the same on all ranks.
  std::vector<std::string> AllGather(const std::string& bytes) const;
  /// Collective: returns once all ranks have called it.
  void Barrier() const;

  /// Sends to another rank and returns at once; messages of one tag (0 to 999) arrive
  /// in order.
  void Post(int to, int tag, std::string bytes) const;
  /// Returns once all that was posted is on its way and its memory is free.
  virtual void Flush() const {}
  /// A message of that tag, if one has arrived.
  std::optional<RankMessage> Poll(int tag, int from = kAnyRank) const;
  /// Waits for one, asleep.
  RankMessage Receive(int tag, int from = kAnyRank) const;

  const RankTraffic& traffic() const { return traffic_; }

  /// Ends the processes of all ranks with that exit code; does not return.
  virtual void Abort(int exit_code) const;

 protected:
  Ranks(int rank, int size) : rank_(rank), size_(size) {}
  virtual void DoPost(int to, int tag, std::string bytes) const;
  virtual std::optional<RankMessage> DoPoll(int tag, int from) const;

 private:
  int rank_ = 0;
  int size_ = 1;
  mutable RankTraffic traffic_;
};

/// The ranks that `mpirun` started this process among, or this process alone. Once a
/// process; leaves them when destroyed. Throws a usage Error if there are several and
/// this build can't speak to them (NACRE_WITH_MPI).
std::unique_ptr<Ranks> JoinRanks();

/// The number of processes that a launcher says it started, and this one's rank, from
/// the environment that Open MPI, MPICH and Slurm's srun --mpi=pmi2 set. Nothing if no
/// launcher did.
struct LaunchedAs {
  int rank = 0;
  int size = 1;
};
std::optional<LaunchedAs> FindLauncher();

/// A rank's share [begin, end) of `count` things in order.
struct RankShare {
  std::int64_t begin = 0;
  std::int64_t end = 0;
};
RankShare ShareOf(std::int64_t count, int rank, int size);
RankShare ShareOf(std::int64_t count, const Ranks* ranks);

/// The memory of plain values, and back.
template <class T>
std::string ToBytes(std::span<const T> values) {
  std::string bytes(values.size_bytes(), '\0');
  if (!bytes.empty()) {
    std::memcpy(bytes.data(), values.data(), bytes.size());
  }
  return bytes;
}
template <class T>
std::vector<T> FromBytes(const std::string& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) {
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  }
  return values;
}

}  // namespace nacre
