#include "cli/machine_check.h"

#include <algorithm>
#include <fmt/format.h>
#include <fstream>
#include <optional>
#include <sstream>
#include <thread>
#include <unistd.h>

namespace nacre::cli {
namespace {

namespace fs = std::filesystem;
using State = Finding::State;

constexpr double kGigabyte = 1e9;

std::optional<std::string> FirstLine(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) {
    return std::nullopt;
  }
  return line;
}

std::optional<double> NumberIn(const fs::path& path) {
  const std::optional<std::string> line = FirstLine(path);
  std::istringstream text(line.value_or(""));
  double value = 0;
  if (text >> value) {
    return value;
  }
  return std::nullopt;
}

// The value of "key : value" in a file such as /proc/cpuinfo.
std::optional<std::string> Field(const fs::path& path, const std::string& key) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    const auto colon = line.find(':');
    if (line.starts_with(key) && colon != std::string::npos) {
      const auto start = line.find_first_not_of(" \t", colon + 1);
      return start == std::string::npos ? "" : line.substr(start);
    }
  }
  return std::nullopt;
}

std::vector<fs::path> Entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code missing;  // a machine without USB has no such folder
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, missing)) {
    entries.push_back(entry.path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

void CheckProcessor(const fs::path& root, std::vector<Finding>& findings) {
  findings.push_back({"processor",
                      "model",
                      Field(root / "proc/cpuinfo", "model name").value_or("unknown"),
                      State::kGood,
                      ""});
#if defined(__x86_64__)
  const char* level = __builtin_cpu_supports("avx512f")  ? "AVX-512"
                      : __builtin_cpu_supports("avx2")   ? "AVX2"
                      : __builtin_cpu_supports("sse4.2") ? "SSE4.2"
                                                         : "SSE2";
  const bool wide = __builtin_cpu_supports("avx2") != 0;
  findings.push_back(
      {"processor",
       "vector instructions",
       level,
       wide ? State::kGood : State::kNote,
       wide ? "" : "hot loops run on narrow vectors; results are the same"});
#endif
  const unsigned cores = std::thread::hardware_concurrency();
  findings.push_back({"processor",
                      "cores",
                      std::to_string(cores),
                      cores > 1 ? State::kGood : State::kNote,
                      cores > 1 ? "" : "everything works, on one core"});
}

void CheckMemory(const fs::path& root, std::vector<Finding>& findings) {
  const auto gigabytes = [&](const char* key) -> std::optional<double> {
    const auto text = Field(root / "proc/meminfo", key);
    std::istringstream stream(text.value_or(""));
    double kilobytes = 0;
    if (stream >> kilobytes) {
      return kilobytes * 1024 / kGigabyte;
    }
    return std::nullopt;
  };
  const auto total = gigabytes("MemTotal");
  const auto free = gigabytes("MemAvailable");
  if (!total || !free) {
    findings.push_back({"memory",
                        "available",
                        "unknown",
                        State::kNote,
                        "/proc/meminfo tells nothing"});
    return;
  }
  const bool enough = *free > 2;
  findings.push_back(
      {"memory",
       "available",
       fmt::format("{:.1f} of {:.1f} GB", *free, *total),
       enough ? State::kGood : State::kNote,
       enough ? "" : "close other programs, or give verbs a --memory they may use"});
}

void CheckDisk(const fs::path& folder, std::vector<Finding>& findings) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (error) {
    findings.push_back(
        {"disk", folder.string(), "unknown", State::kNote, error.message()});
    return;
  }
  const double free = static_cast<double>(space.available) / kGigabyte;
  const bool enough = free > 20;
  findings.push_back(
      {"disk",
       "free in " + folder.string(),
       fmt::format("{:.0f} GB", free),
       enough ? State::kGood : State::kNote,
       enough ? ""
              : "a full-size session takes up to 100 GB: capture to another "
                "disk, or free some space"});
}

void CheckNetwork(const fs::path& root, std::vector<Finding>& findings) {
  constexpr double kJumboMtu = 8000;
  for (const fs::path& interface : Entries(root / "sys/class/net")) {
    const std::string name = interface.filename().string();
    const auto mtu = NumberIn(interface / "mtu");
    const bool is_device = fs::exists(interface / "device");
    if (name == "lo" || !mtu || !is_device) {
      continue;  // loopback and virtual interfaces carry no camera
    }
    const auto speed = NumberIn(interface / "speed");
    const bool jumbo = *mtu >= kJumboMtu;
    findings.push_back(
        {"network",
         name,
         fmt::format("{}, MTU {}{}",
                     FirstLine(interface / "operstate").value_or("state unknown"),
                     *mtu,
                     speed && *speed > 0 ? fmt::format(", {} Mbit/s", *speed) : ""),
         jumbo ? State::kGood : State::kNote,
         jumbo
             ? ""
             : fmt::format("if a GigE camera hangs there: ip link set dev {} mtu 9000 "
                           "(jumbo frames lose fewer packets)",
                           name)});
  }
  constexpr double kWantedBuffer = 4e6;
  const auto buffer = NumberIn(root / "proc/sys/net/core/rmem_max");
  if (buffer) {
    const bool enough = *buffer >= kWantedBuffer;
    findings.push_back(
        {"network",
         "receive buffer",
         fmt::format("{:.0f} kB at most", *buffer / 1e3),
         enough ? State::kGood : State::kNote,
         enough ? ""
                : "for a GigE camera: sysctl -w net.core.rmem_max=33554432, or "
                  "frames are lost"});
  }
}

struct KnownDevice {
  const char* id;
  const char* name;
};

// USB devices that rigs of this kind are made of.
constexpr KnownDevice kKnownDevices[] = {
    {"1209:e500", "Helios laser DAC"},
    {"1fc9:04d8", "LaserCube / LaserDock DAC"},
    {"9588:9899", "BJJCZ galvo board"},
};

fs::path UsbNode(const fs::path& root, const fs::path& device) {
  return root / "dev/bus/usb" /
         fmt::format("{:03.0f}/{:03.0f}",
                     NumberIn(device / "busnum").value_or(0),
                     NumberIn(device / "devnum").value_or(0));
}

void CheckUsbDevice(const fs::path& root,
                    const fs::path& device,
                    std::vector<Finding>& findings) {
  const auto vendor = FirstLine(device / "idVendor");
  const auto product = FirstLine(device / "idProduct");
  if (!vendor || !product) {
    return;
  }
  const std::string id = *vendor + ":" + *product;
  const auto* known = std::find_if(std::begin(kKnownDevices),
                                   std::end(kKnownDevices),
                                   [&](const KnownDevice& d) { return d.id == id; });
  if (known == std::end(kKnownDevices)) {
    return;
  }
  const fs::path node = UsbNode(root, device);
  const bool usable = ::access(node.c_str(), R_OK | W_OK) == 0;
  findings.push_back(
      {"usb",
       known->name,
       id + " at " + node.string(),
       usable ? State::kGood : State::kProblem,
       usable ? ""
              : fmt::format("no permission: put SUBSYSTEM==\"usb\", "
                            "ATTR{{idVendor}}==\"{}\", ATTR{{idProduct}}==\"{}\", "
                            "MODE=\"0660\", GROUP=\"plugdev\" into "
                            "/etc/udev/rules.d/70-nacre.rules, join plugdev, replug",
                            *vendor,
                            *product)});
}

// USB3 Vision has no vendor of its own: an interface of class EF, subclass 05 tells it.
void CheckUsbCamera(const fs::path& root,
                    const fs::path& interface,
                    std::vector<Finding>& findings) {
  if (FirstLine(interface / "bInterfaceClass") != "ef" ||
      FirstLine(interface / "bInterfaceSubClass") != "05" ||
      FirstLine(interface / "bInterfaceProtocol") != "00") {  // its control interface
    return;
  }
  const std::string name = interface.filename().string();
  const fs::path device = interface.parent_path() / name.substr(0, name.find(':'));
  const fs::path node = UsbNode(root, device);
  const auto speed = NumberIn(device / "speed");
  const bool usable = ::access(node.c_str(), R_OK | W_OK) == 0;
  const bool fast = !speed || *speed >= 5000;
  findings.push_back({"usb",
                      FirstLine(device / "product").value_or("USB3 Vision camera"),
                      fmt::format("USB3 Vision at {}{}",
                                  node.string(),
                                  speed ? fmt::format(", {:.0f} Mbit/s", *speed) : ""),
                      !usable ? State::kProblem
                      : fast  ? State::kGood
                              : State::kNote,
                      !usable
                          ? "no permission: copy share/nacre/70-nacre-camera.rules to "
                            "/etc/udev/rules.d, join plugdev, replug"
                      : fast ? ""
                             : "this is no USB 3 port: plug it into a blue one"});
}

void CheckUsb(const fs::path& root, std::vector<Finding>& findings) {
  const std::size_t before = findings.size();
  const std::vector<fs::path> entries = Entries(root / "sys/bus/usb/devices");
  for (const fs::path& device : entries) {
    CheckUsbDevice(root, device, findings);
  }
  const std::size_t lasers = findings.size();
  for (const fs::path& interface : entries) {
    CheckUsbCamera(root, interface, findings);
  }
  // Cameras are no lasers.
  std::rotate(findings.begin() + static_cast<std::ptrdiff_t>(before),
              findings.begin() + static_cast<std::ptrdiff_t>(lasers),
              findings.end());
  if (lasers > before) {
    return;
  }
  findings.push_back({"usb",
                      "laser",
                      "none found",
                      State::kNote,
                      "plug in a Helios DAC (1209:e500) to scan with a real laser; "
                      "simulated rigs need none"});
}

}  // namespace

const char* Name(Finding::State state) {
  switch (state) {
    case State::kGood:
      return "good";
    case State::kNote:
      return "note";
    case State::kProblem:
      return "problem";
  }
  return "";
}

std::vector<Finding> CheckMachine(const fs::path& root, const fs::path& folder) {
  std::vector<Finding> findings;
  CheckProcessor(root, findings);
  CheckMemory(root, findings);
  CheckDisk(folder, findings);
  CheckNetwork(root, findings);
  CheckUsb(root, findings);
  return findings;
}

}  // namespace nacre::cli
