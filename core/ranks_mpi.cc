// Messages between ranks by MPI: the only file that knows of it.

#include "core/error.h"
#include "core/ranks.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <list>
#include <mpi.h>
#include <thread>

namespace nacre {
namespace {

// Messages go in pieces that MPI sends at once, see SetUpSharedMemory; one that is
// shorter than this ends them.
constexpr std::size_t kPiece = 30 * 1024;

int WorldRank() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

int WorldSize() {
  int size = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return size;
}

// What MPI calls fail from ends all ranks: its default.
class MpiRanks : public Ranks {
 public:
  MpiRanks() : Ranks(WorldRank(), WorldSize()) {}
  ~MpiRanks() override {
    Flush();
    MPI_Finalize();
  }

  void Flush() const override {
    constexpr std::chrono::microseconds kLongest{1000};
    std::chrono::microseconds pause{5};
    for (Forget(); !posted_.empty(); Forget()) {
      std::this_thread::sleep_for(pause);
      pause = std::min(2 * pause, kLongest);
    }
  }

  void Abort(int exit_code) const override {
    MPI_Abort(MPI_COMM_WORLD, exit_code);
    std::abort();
  }

 private:
  struct Posted {
    std::string bytes;
    std::vector<MPI_Request> requests;
  };

  void DoPost(int to, int tag, std::string bytes) const override {
    Forget();
    Posted& posted = posted_.emplace_back();
    posted.bytes = std::move(bytes);
    for (std::size_t at = 0; at <= posted.bytes.size(); at += kPiece) {
      MPI_Isend(posted.bytes.data() + at,
                static_cast<int>(std::min(kPiece, posted.bytes.size() - at)),
                MPI_BYTE,
                to,
                tag,
                MPI_COMM_WORLD,
                &posted.requests.emplace_back());
    }
  }

  // Frees what has been sent.
  void Forget() const {
    posted_.remove_if([](Posted& posted) {
      int done = 0;
      MPI_Testall(static_cast<int>(posted.requests.size()),
                  posted.requests.data(),
                  &done,
                  MPI_STATUSES_IGNORE);
      return done != 0;
    });
  }

  std::optional<RankMessage> DoPoll(int tag, int from) const override {
    int arrived = 0;
    MPI_Status status{};
    MPI_Iprobe(from == kAnyRank ? MPI_ANY_SOURCE : from,
               tag,
               MPI_COMM_WORLD,
               &arrived,
               &status);
    if (arrived == 0) {
      return std::nullopt;
    }
    RankMessage message{status.MPI_SOURCE, {}};
    for (;;) {
      int count = 0;
      MPI_Get_count(&status, MPI_BYTE, &count);
      const std::size_t at = message.bytes.size();
      message.bytes.resize(at + static_cast<std::size_t>(count));
      MPI_Recv(message.bytes.data() + at,
               count,
               MPI_BYTE,
               message.from,
               tag,
               MPI_COMM_WORLD,
               MPI_STATUS_IGNORE);
      if (static_cast<std::size_t>(count) < kPiece) {
        return message;
      }
      MPI_Probe(message.from, tag, MPI_COMM_WORLD, &status);
    }
  }

  mutable std::list<Posted> posted_;
};

// How Open MPI carries messages between ranks of one machine, unless the user has said
// so.
void SetUpSharedMemory() {
  constexpr int kKeepWhatIsSet = 0;
  const auto set = [](const char* name, const char* value) {
    setenv(name, value, kKeepWhatIsSet);
  };
  // It reads large messages straight out of the other process' memory, and aborts where
  // that process has died in between; through shared memory the rest goes on.
  set("OMPI_MCA_btl_vader_single_copy_mechanism", "none");
  // Of messages above 4 kB it sends the head, and the rest once the receiver has
  // answered and the sender, who computes meanwhile, looks: until then the receiver
  // spins. Here pieces go at once, as many as there is room for.
  set("OMPI_MCA_btl_vader_eager_limit", "32768");
  set("OMPI_MCA_btl_vader_max_send_size", "32768");
}

}  // namespace

std::unique_ptr<Ranks> JoinRanks() {
  if (!FindLauncher()) {
    return std::make_unique<Ranks>();
  }
  SetUpSharedMemory();
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  if (provided < MPI_THREAD_FUNNELED) {
    throw Error("this MPI library can't be used by programs with threads");
  }
  return std::make_unique<MpiRanks>();
}

}  // namespace nacre
