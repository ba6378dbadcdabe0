// Pictures sent to a viewer: a socket takes the packets and reads them as tev does.
#include "render/tev.h"

#include "core/error.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <cstring>
#include <map>
#include <netinet/in.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace nacre::render {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;

// Listens for one caller on a free port of this machine, which is put into `port`.
int Listen(int& port) {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  auto* const any = reinterpret_cast<sockaddr*>(&address);  // NOLINT
  EXPECT_EQ(bind(listener, any, size), 0);
  EXPECT_EQ(listen(listener, 1), 0);
  EXPECT_EQ(getsockname(listener, any, &size), 0);
  port = ntohs(address.sin_port);
  return listener;
}

// Listens on a port of its own, and takes all that one client sends.
class Viewer {
 public:
  Viewer() : listener_(Listen(port_)) {
    thread_ = std::jthread([this] { TakeAll(); });
  }
  ~Viewer() { close(listener_); }

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  const std::string& bytes() {
    thread_.join();
    return bytes_;
  }

 private:
  void TakeAll() {
    const int client = accept(listener_, nullptr, nullptr);
    std::array<char, 4096> buffer{};
    for (ssize_t got = 1; got > 0;) {
      got = read(client, buffer.data(), buffer.size());
      bytes_.append(buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    }
    close(client);
  }

  int port_ = 0;  // before what sets it
  int listener_;
  std::string bytes_;
  std::jthread thread_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  T Next() {
    T value{};
    EXPECT_LE(at_ + sizeof(T), bytes_.size());
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string Text() {
    std::string text(bytes_.data() + at_);
    at_ += text.size() + 1;
    return text;
  }
  std::string_view Rest() const { return bytes_.substr(at_); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

ExrPart Gradient(int width, int height) {
  ExrPart image{"", width, height, {"R", "G", "B"}, {}, {}};
  for (int n = 0; n < 3 * width * height; ++n) {
    image.values.push_back(static_cast<float>(n) * 0.5F);
  }
  return image;
}

// Does what a viewer does with the packets.
std::map<std::string, std::vector<float>> Shown(std::string_view bytes,
                                                int width,
                                                int height) {
  std::map<std::string, std::vector<float>> channels;
  while (!bytes.empty()) {
    const auto length = Reader(bytes).Next<std::uint32_t>();
    Reader packet(bytes.substr(4, length - 4));
    bytes.remove_prefix(length);
    const int type = packet.Next<std::uint8_t>();
    packet.Next<std::uint8_t>();  // whether to come to the front
    EXPECT_EQ(packet.Text(), "dragon");
    if (type == 4) {
      EXPECT_EQ(packet.Next<std::int32_t>(), width);
      EXPECT_EQ(packet.Next<std::int32_t>(), height);
      for (int n = packet.Next<std::int32_t>(); n > 0; --n) {
        channels[packet.Text()].resize(static_cast<std::size_t>(width * height));
      }
      EXPECT_TRUE(packet.Rest().empty());
      continue;
    }
    EXPECT_EQ(type, 6);
    std::vector<std::string> names(
        static_cast<std::size_t>(packet.Next<std::int32_t>()));
    for (std::string& name : names) {
      name = packet.Text();
    }
    const int x0 = packet.Next<std::int32_t>();
    const int y0 = packet.Next<std::int32_t>();
    const int w = packet.Next<std::int32_t>();
    const int h = packet.Next<std::int32_t>();
    std::vector<std::int64_t> offsets;
    std::vector<std::int64_t> strides;
    for (std::size_t n = 0; n < names.size(); ++n) {
      offsets.push_back(packet.Next<std::int64_t>());
    }
    for (std::size_t n = 0; n < names.size(); ++n) {
      strides.push_back(packet.Next<std::int64_t>());
    }
    const std::string_view data = packet.Rest();
    for (std::size_t n = 0; n < names.size(); ++n) {
      for (int i = 0; i < w * h; ++i) {
        const auto at = static_cast<std::size_t>(offsets[n] + strides[n] * i) * 4;
        EXPECT_LE(at + 4, data.size());
        const int pixel = (y0 + i / w) * width + x0 + i % w;
        std::memcpy(&channels.at(names[n])[static_cast<std::size_t>(pixel)],
                    data.data() + at,
                    4);
      }
    }
  }
  return channels;
}

TEST(TevTest, TheViewerShowsThePictureThatWasSent) {
  // More than a packet's worth of rows.
  const ExrPart image = Gradient(512, 300);
  Viewer viewer;
  {
    TevDisplay display(viewer.address());
    ExrPart before = image;
    before.values.assign(before.values.size(), 0);
    EXPECT_TRUE(display.Show("dragon", before));
    EXPECT_TRUE(display.Show("dragon", image));
  }
  const auto shown = Shown(viewer.bytes(), 512, 300);
  ASSERT_EQ(shown.size(), 3u);
  for (std::size_t c = 0; c < 3; ++c) {
    const float* expected = image.Channel(c);
    EXPECT_EQ(shown.at(image.channels[c]),
              std::vector<float>(expected, expected + image.PixelCount()));
  }
}

TEST(TevTest, AViewerThatGoesIsNoError) {
  const ExrPart image = Gradient(64, 64);
  int port = 0;
  const int listener = Listen(port);
  TevDisplay display("127.0.0.1:" + std::to_string(port));
  const int client = accept(listener, nullptr, nullptr);
  close(client);
  close(listener);
  // What was sent to nobody is noticed at the latest when its answer has come back.
  bool watched = true;
  for (int n = 0; n < 1000 && watched; ++n) {
    watched = display.Show("dragon", image);
  }
  EXPECT_FALSE(watched);
  EXPECT_FALSE(display.Show("dragon", image));
}

TEST(TevTest, ErrorsSayWhereNobodyListens) {
  EXPECT_THAT(ErrorMessage([] { TevDisplay("127.0.0.1:1"); }, ExitCode::kDevice),
              HasSubstr("no tev at 127.0.0.1:1"));
  EXPECT_THAT(ErrorMessage([] { TevDisplay("localhost:tev"); }, ExitCode::kUsage),
              HasSubstr("'localhost:tev' isn't HOST:PORT"));
}

}  // namespace
}  // namespace nacre::render
