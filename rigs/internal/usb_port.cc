#include "rigs/internal/usb_port.h"

#include "core/error.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <deque>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <memory>
#include <mutex>
#include <string>
#include <sys/ioctl.h>
#include <termios.h>
#include <thread>
#include <umockdev.h>
#include <unistd.h>
#include <utility>

namespace nacre::rigs::internal {
namespace {

// A full-speed device of one interface whose alternate setting 1 has the endpoints.
constexpr const char* kDescriptors =
    "120100020000000809120 0E500020102 0001"
    "0902450001010080 4B"
    "0904000000FFFFFF00"
    "0904000106FFFFFF00"
    "07058303200001"
    "07050603200001"
    "07058102400000"
    "07050202400000"
    "07058401010001"
    "07050501010001";
constexpr const char* kHub =
    "P: /devices/usb1\nN: bus/usb/001/001\nE: SUBSYSTEM=usb\nE: DRIVER=usb\n"
    "E: BUSNUM=001\nE: DEVNUM=001\nE: DEVNAME=/dev/bus/usb/001/001\n"
    "E: DEVTYPE=usb_device\nA: bConfigurationValue=1\\n\nA: busnum=1\\n\n"
    "A: devnum=1\\n\nA: speed=480\\n\nA: idVendor=1d6b\\n\nA: idProduct=0002\\n\n"
    "H: descriptors=12010002090001406B1D0200060603020101"
    "09021900010100E0000904000001090000000705810304000C\n";

std::string WithoutSpaces(std::string text) {
  std::erase(text, ' ');
  return text;
}

void Checked(bool good, GError* error, const char* doing) {
  if (!good) {
    throw LogicError(fmt::format(
        "emulated USB: {}: {}", doing, error ? error->message : "no reason"));
  }
}

// The emulated bus, one a process.
class Testbed {
 public:
  static Testbed& Only() {
    static Testbed testbed;
    return testbed;
  }
  UMockdevTestbed* get() const { return testbed_; }
  const std::string& root() const { return root_; }
  int NextAddress() {
    const std::lock_guard lock(mutex_);
    return ++address_;
  }

 private:
  Testbed() : testbed_(umockdev_testbed_new()) {
    if (umockdev_in_mock_environment() == 0) {
      throw LogicError(
          "an emulated USB needs the program to be run by umockdev-wrapper");
    }
    gchar* root = umockdev_testbed_get_root_dir(testbed_);
    root_ = root;
    g_free(root);
    GError* error = nullptr;
    Checked(umockdev_testbed_add_from_string(testbed_, kHub, &error) != 0,
            error,
            "adding a hub");
    std::signal(SIGHUP, SIG_IGN);  // what is unplugged hangs up
  }
  ~Testbed() { g_object_unref(testbed_); }

  UMockdevTestbed* testbed_;
  std::string root_;
  std::mutex mutex_;
  int address_ = 1;
};

usbdevfs_urb* Urb(UMockdevIoctlData* data) {
  return reinterpret_cast<usbdevfs_urb*>(data->data);
}

// Of a program that dies meanwhile the memory can't be read, or reads as zeros, which
// no transfer to a Helios is.
bool IsWhole(const usbdevfs_urb& urb, const UMockdevIoctlData* buffer) {
  if (buffer == nullptr || urb.buffer_length <= 0) {
    return false;
  }
  const auto* bytes = static_cast<const std::uint8_t*>(urb.buffer);
  return (urb.endpoint & 0x80) != 0 ||
         std::any_of(bytes, bytes + urb.buffer_length, [](std::uint8_t byte) {
           return byte != 0;
         });
}

}  // namespace

bool CanEmulateUsb() {
  const char* preloaded = std::getenv("LD_PRELOAD");
  return preloaded != nullptr &&
         std::strstr(preloaded, "libumockdev-preload") != nullptr;
}

struct UsbPort::Parts : std::enable_shared_from_this<UsbPort::Parts> {
  struct Transfer {
    UMockdevIoctlClient* client;
    UMockdevIoctlData* data;
  };

  Parts(int its_port, UsbFunction& its_function)
      : port(its_port), function(its_function) {}

  // The device's node is the slave of a pseudo-terminal, for its poll() answers as that
  // of usbfs: writable only if a transfer has ended, an error once it is unplugged.
  void MakeNode() {
    master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    char name[64];
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
        ptsname_r(master, name, sizeof name) != 0) {
      throw SystemError("emulated USB: a pseudo-terminal");
    }
    slave = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    const std::string file = Testbed::Only().root() + node;
    unlink(file.c_str());
    if (symlink(name, file.c_str()) != 0) {
      throw SystemError("emulated USB: node " + file);
    }
    Gate();
  }

  void Gate() {
    if (slave >= 0) {
      tcflow(slave, done.empty() ? TCOOFF : TCOON);
    }
  }

  void Finish(const Transfer& transfer, int status, std::size_t count) {
    Urb(transfer.data)->status = status;
    Urb(transfer.data)->actual_length = static_cast<int>(count);
    done.push_back(transfer);
    Gate();
  }

  // False if the device isn't ready for it.
  bool Execute(const Transfer& transfer) {
    usbdevfs_urb* urb = Urb(transfer.data);
    auto* buffer = static_cast<std::uint8_t*>(urb->buffer);
    const auto length = static_cast<std::size_t>(urb->buffer_length);
    if (urb->type == USBDEVFS_URB_TYPE_CONTROL || alternate != 1) {
      Finish(transfer, -EPIPE, 0);
    } else if ((urb->endpoint & 0x80) == 0) {
      const UsbAnswer answer = function.Out(urb->endpoint, {buffer, length});
      if (answer == UsbAnswer::kLater) {
        return false;
      }
      const bool done_now = answer == UsbAnswer::kDone;
      Finish(transfer, done_now ? 0 : -EPIPE, done_now ? length : 0);
    } else {
      const auto answer = function.In(urb->endpoint);
      if (!answer) {
        return false;
      }
      const std::size_t count = std::min(length, answer->size());
      std::copy_n(answer->begin(), count, buffer);
      Finish(transfer, 0, count);
    }
    return true;
  }

  void RetryLocked() {
    for (std::size_t k = 0; k < flying.size();) {
      if (Execute(flying[k])) {
        flying.erase(flying.begin() + static_cast<std::ptrdiff_t>(k));
      } else {
        ++k;
      }
    }
  }

  static void Answer(UMockdevIoctlClient* client, long result, int error = 0) {
    umockdev_ioctl_client_complete(client, result, error);
  }

  void Submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    UMockdevIoctlData* data =
        umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
    if (data == nullptr) {  // its program has just died
      Answer(client, -1, EFAULT);
      return;
    }
    UMockdevIoctlData* buffer =
        umockdev_ioctl_data_resolve(data,
                                    offsetof(usbdevfs_urb, buffer),
                                    static_cast<gsize>(Urb(data)->buffer_length),
                                    nullptr);
    if (!IsWhole(*Urb(data), buffer)) {
      g_object_unref(data);
      Answer(client, -1, EFAULT);
      return;
    }
    g_object_unref(buffer);  // the transfer holds it
    if (claimed_by != client && Urb(data)->type != USBDEVFS_URB_TYPE_CONTROL) {
      g_object_unref(data);
      Answer(client, -1, ENOENT);
      return;
    }
    const Transfer transfer{client, data};
    if (!Execute(transfer)) {
      flying.push_back(transfer);
    }
    Answer(client, 0);
  }

  void Reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    const auto found =
        std::find_if(done.begin(), done.end(), [client](const Transfer& transfer) {
          return transfer.client == client;
        });
    if (found == done.end()) {
      Answer(client, -1, gone ? ENODEV : EAGAIN);
      return;
    }
    UMockdevIoctlData* data = found->data;
    done.erase(found);
    Gate();
    UMockdevIoctlData* pointer =
        umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
    if (pointer == nullptr) {
      Answer(client, -1, EFAULT);
      return;
    }
    umockdev_ioctl_data_set_ptr(pointer, 0, data);
    g_object_unref(pointer);
    Answer(client, 0);
  }

  void Discard(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    unsigned long address = 0;
    std::memcpy(&address, argument->data, sizeof address);
    const auto found =
        std::find_if(flying.begin(), flying.end(), [&](const Transfer& transfer) {
          return transfer.client == client && transfer.data->client_addr == address;
        });
    if (found == flying.end()) {
      Answer(client, -1, EINVAL);
      return;
    }
    const Transfer transfer = *found;
    flying.erase(found);
    Finish(transfer, -ENOENT, 0);
    Answer(client, 0);
  }

  void Release() {
    claimed_by = nullptr;
    alternate = 0;
  }

  void OnIoctl(UMockdevIoctlClient* client) {
    const std::lock_guard lock(mutex);
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    const gulong request = umockdev_ioctl_client_get_request(client);
    const bool is_ending = request == USBDEVFS_REAPURBNDELAY ||
                           request == USBDEVFS_REAPURB ||
                           request == USBDEVFS_DISCARDURB;
    if (gone && !is_ending) {
      Answer(client, -1, ENODEV);
      return;
    }
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES: {
        UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, 4, nullptr);
        if (data == nullptr) {
          return Answer(client, -1, EFAULT);
        }
        const std::uint32_t capabilities =
            USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
            USBDEVFS_CAP_BULK_SCATTER_GATHER | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        std::memcpy(data->data, &capabilities, sizeof capabilities);
        g_object_unref(data);
        return Answer(client, 0);
      }
      case USBDEVFS_CLAIMINTERFACE:
        if (claimed_by != nullptr && claimed_by != client) {
          return Answer(client, -1, EBUSY);
        }
        claimed_by = client;
        return Answer(client, 0);
      case USBDEVFS_RELEASEINTERFACE:
        if (claimed_by == client) {
          Release();
        }
        return Answer(client, 0);
      case USBDEVFS_SETINTERFACE: {
        UMockdevIoctlData* data = umockdev_ioctl_data_resolve(
            argument, 0, sizeof(usbdevfs_setinterface), nullptr);
        if (data == nullptr) {
          return Answer(client, -1, EFAULT);
        }
        alternate = static_cast<int>(
            reinterpret_cast<usbdevfs_setinterface*>(data->data)->altsetting);
        g_object_unref(data);
        return Answer(client, 0);
      }
      case USBDEVFS_CLEAR_HALT:
      case USBDEVFS_RESETEP:
        return Answer(client, 0);
      case USBDEVFS_GETDRIVER:
        return Answer(client, -1, ENODATA);
      case USBDEVFS_SUBMITURB:
        return Submit(client, argument);
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY:
        return Reap(client, argument);
      case USBDEVFS_DISCARDURB:
        return Discard(client, argument);
      default:
        return Answer(client, -1, ENOTTY);
    }
  }

  // As the kernel does when a program closes its node, or dies.
  void OnVanished(UMockdevIoctlClient* client) {
    const std::lock_guard lock(mutex);
    for (std::deque<Transfer>* queue : {&flying, &done}) {
      std::erase_if(*queue, [client](const Transfer& transfer) {
        return transfer.client == client;
      });
    }
    if (claimed_by == client) {
      Release();
    }
    Gate();
  }

  const int port;
  UsbFunction& function;
  std::mutex plugging;  // of Plug and Unplug against each other
  bool plugged = false;
  std::string node;
  std::string path;                       // in sysfs
  std::vector<UMockdevIoctlBase*> bases;  // one for each time it was plugged in

  std::mutex mutex;  // of all below
  int master = -1;
  int slave = -1;
  bool gone = true;
  int alternate = 0;
  UMockdevIoctlClient* claimed_by = nullptr;
  std::deque<Transfer> flying;
  std::deque<Transfer> done;
};

UsbPort::UsbPort(int port, UsbFunction& function)
    : parts_(std::make_shared<Parts>(port, function)) {}
UsbPort::~UsbPort() {
  Unplug();
  for (UMockdevIoctlBase* base : parts_->bases) {  // programs may have it open still
    g_signal_handlers_disconnect_by_data(base, parts_.get());
    g_object_unref(base);
  }
}

void UsbPort::Plug() {
  Parts& parts = *parts_;
  const std::lock_guard plugging(parts.plugging);
  if (parts.plugged) {
    return;
  }
  Testbed& testbed = Testbed::Only();
  const int address = testbed.NextAddress();
  parts.node = fmt::format("/dev/bus/usb/001/{:03}", address);
  parts.path = fmt::format("/devices/usb1/1-{}", parts.port);
  UMockdevIoctlBase* const base = umockdev_ioctl_base_new();
  parts.bases.push_back(base);
  using Handler = gboolean (*)(UMockdevIoctlBase*, UMockdevIoctlClient*, gpointer);
  using Connected = void (*)(UMockdevIoctlBase*, UMockdevIoctlClient*, gpointer);
  const Handler on_ioctl = [](auto*, UMockdevIoctlClient* client, gpointer self) {
    static_cast<Parts*>(self)->OnIoctl(client);
    return gboolean{1};
  };
  // The library tells nobody that a client is gone, other than by forgetting it.
  const Connected on_connected = [](auto*, UMockdevIoctlClient* client, gpointer self) {
    const GWeakNotify on_vanished = [](gpointer data, GObject* was_client) {
      const std::unique_ptr<std::weak_ptr<Parts>> holder(
          static_cast<std::weak_ptr<Parts>*>(data));
      if (const auto held = holder->lock()) {
        held->OnVanished(reinterpret_cast<UMockdevIoctlClient*>(was_client));
      }
    };
    g_object_weak_ref(
        reinterpret_cast<GObject*>(client),
        on_vanished,
        new std::weak_ptr<Parts>(static_cast<Parts*>(self)->weak_from_this()));
  };
  g_signal_connect_data(base,
                        "handle-ioctl",
                        reinterpret_cast<GCallback>(on_ioctl),
                        &parts,
                        nullptr,
                        GConnectFlags{});
  g_signal_connect_data(base,
                        "client-connected",
                        reinterpret_cast<GCallback>(on_connected),
                        &parts,
                        nullptr,
                        GConnectFlags{});
  GError* error = nullptr;
  Checked(umockdev_testbed_attach_ioctl(
              testbed.get(), parts.node.c_str(), base, &error) != 0,
          error,
          "attaching the device");
  {
    const std::lock_guard lock(parts.mutex);
    parts.gone = false;
    parts.MakeNode();  // before the event that add_from_string sends
  }
  const std::string device = fmt::format(
      "P: {0}\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: BUSNUM=001\nE: DEVNUM={1:03}\n"
      "E: DEVNAME={2}\nE: DEVTYPE=usb_device\nE: PRODUCT=1209/e500/200\n"
      "A: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum={1}\\n\nA: speed=12\\n\n"
      "A: idVendor=1209\\n\nA: idProduct=e500\\n\nH: descriptors={3}\n",
      parts.path,
      address,
      parts.node,
      WithoutSpaces(kDescriptors));
  Checked(umockdev_testbed_add_from_string(testbed.get(), device.c_str(), &error) != 0,
          error,
          "plugging the device in");
  parts.plugged = true;
}

// In the kernel's order: transfers end, the node gives errors, then all are told.
void UsbPort::Unplug() {
  Parts& parts = *parts_;
  const std::lock_guard plugging(parts.plugging);
  if (!parts.plugged) {
    return;
  }
  UMockdevTestbed* testbed = Testbed::Only().get();
  {
    const std::lock_guard lock(parts.mutex);
    parts.gone = true;
    for (const Parts::Transfer& transfer : std::exchange(parts.flying, {})) {
      parts.Finish(transfer, -ESHUTDOWN, 0);
    }
    close(parts.slave);
    close(parts.master);
    parts.slave = parts.master = -1;
    parts.Release();
  }
  const std::string path = "/sys" + parts.path;
  umockdev_testbed_uevent(testbed, path.c_str(), "remove");
  umockdev_testbed_remove_device(testbed, path.c_str());
  unlink((Testbed::Only().root() + parts.node).c_str());
  std::this_thread::sleep_for(
      std::chrono::milliseconds(20));  // last transfers are reaped
  umockdev_testbed_detach_ioctl(testbed, parts.node.c_str(), nullptr);
  parts.plugged = false;
  const std::lock_guard lock(parts.mutex);
  parts.done.clear();
}

void UsbPort::Retry() {
  const std::lock_guard lock(parts_->mutex);
  parts_->RetryLocked();
}

}  // namespace nacre::rigs::internal
