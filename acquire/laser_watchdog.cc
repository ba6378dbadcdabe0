#include "acquire/laser_watchdog.h"

#include "acquire/internal/helios_usb.h"
#include "core/error.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <string>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace nacre::acquire {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr char kStandsBy = 'r';
constexpr char kRelease = 'q';
constexpr std::chrono::seconds kStartTimeout{10};
// After its parent's death: the system closes what that had open within milliseconds.
constexpr std::chrono::seconds kGiveUp{2};
constexpr std::chrono::microseconds kWatchPause{500};

class SpawnSettings {
 public:
  explicit SpawnSettings(int socket) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_adddup2(&actions_, socket, STDIN_FILENO);
    // Whatever it inherited of the device would keep that from being free.
    posix_spawn_file_actions_addclosefrom_np(&actions_, STDERR_FILENO + 1);
    posix_spawnattr_init(&attributes_);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  pid_t Spawn(const fs::path& program, const std::array<std::string, 3>& arguments) {
    std::array<std::string, 4> texts{program.string()};
    std::copy(arguments.begin(), arguments.end(), texts.begin() + 1);
    std::array<char*, 5> argv{};
    for (std::size_t k = 0; k < texts.size(); ++k) {
      argv[k] = texts[k].data();
    }
    pid_t pid = -1;
    errno = posix_spawn(
        &pid, program.c_str(), &actions_, &attributes_, argv.data(), environ);
    if (errno != 0) {
      throw SystemError("starting the laser's watch-dog " + program.string());
    }
    return pid;
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

// Stops the DAC and closes its shutter; false if it isn't ours yet.
bool MakeDark(internal::HeliosUsb& dac) {
  if (!dac.Claim()) {
    return false;
  }
  dac.Stop();
  dac.SetShutter(false);
  return true;
}

// True as soon as the parent is dead, false if it released us.
bool AwaitDeath(pid_t parent) {
  const auto process = static_cast<int>(syscall(SYS_pidfd_open, parent, 0));
  std::array<pollfd, 2> ready{{{STDIN_FILENO, POLLIN, 0}, {process, POLLIN, 0}}};
  for (;;) {
    // Without a handle of the process (an old kernel) the socket alone tells.
    if (poll(ready.data(), process >= 0 ? 2 : 1, -1) < 0) {
      continue;
    }
    char word = 0;
    if (ready[0].revents != 0) {
      const ssize_t count = read(STDIN_FILENO, &word, 1);
      if (count <= 0 || word == kRelease) {
        return count <= 0;
      }
    } else {
      return true;
    }
  }
}

}  // namespace

fs::path LaserWatchdog::Program() {
  if (const char* given = std::getenv("NACRE_LASER_WATCHDOG")) {
    return given;
  }
  constexpr const char* kName = "nacre-laser-watchdog";
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  for (const fs::path& place :
       {folder / kName, folder.parent_path() / "libexec" / "nacre" / kName}) {
    if (fs::exists(place)) {
      return place;
    }
  }
  throw DeviceError(fmt::format(
      "the laser's watch-dog, {}, is neither in {} nor in {}; without it no laser is "
      "switched on. Install nacre whole, or set NACRE_LASER_WATCHDOG to its path",
      kName,
      folder.string(),
      (folder.parent_path() / "libexec" / "nacre").string()));
}

LaserWatchdog::LaserWatchdog(int usb_bus, int usb_address) {
  const fs::path program = Program();
  std::array<int, 2> pair{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    throw SystemError("the laser's watch-dog: a socket to it");
  }
  socket_ = pair[0];
  try {
    pid_ = SpawnSettings(pair[1]).Spawn(program,
                                        {std::to_string(usb_bus),
                                         std::to_string(usb_address),
                                         std::to_string(getpid())});
  } catch (const Error&) {
    close(pair[0]);
    close(pair[1]);
    throw;
  }
  close(pair[1]);
  pollfd ready{socket_, POLLIN, 0};
  char word = 0;
  const auto timeout = std::chrono::milliseconds(kStartTimeout);
  if (poll(&ready, 1, static_cast<int>(timeout.count())) != 1 ||
      read(socket_, &word, 1) != 1 || word != kStandsBy) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    close(socket_);
    throw DeviceError(
        fmt::format("the laser's watch-dog {} can't open the laser DAC at USB {}:{}",
                    program.string(),
                    usb_bus,
                    usb_address));
  }
}

LaserWatchdog::~LaserWatchdog() {
  close(socket_);
  waitpid(pid_, nullptr, 0);
}

bool LaserWatchdog::IsAlive() const {
  pollfd ready{socket_, POLLIN, 0};
  return poll(&ready, 1, 0) == 0;  // it says nothing more, but that its end is closed
}

void LaserWatchdog::Release() noexcept {
  send(socket_, &kRelease, 1, MSG_NOSIGNAL);
}

int RunLaserWatchdog(int usb_bus, int usb_address, pid_t parent) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) {
    std::signal(signal, SIG_IGN);
  }
  internal::HeliosUsb dac({usb_bus, usb_address});
  if (send(STDIN_FILENO, &kStandsBy, 1, MSG_NOSIGNAL) != 1) {
    return 1;
  }
  if (!AwaitDeath(parent)) {
    return 0;
  }
  std::string last = "another program has it";
  for (const auto end = Clock::now() + kGiveUp; Clock::now() < end;) {
    try {
      if (MakeDark(dac)) {
        return 0;
      }
    } catch (const Error& e) {  // tried again: it is the last line of defence
      if (dac.IsGone()) {
        return 0;  // without power there is no light
      }
      last = e.what();
    }
    std::this_thread::sleep_for(kWatchPause);
  }
  throw DeviceError(last);
}

}  // namespace nacre::acquire
