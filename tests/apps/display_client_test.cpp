#include "apps/display_client.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <netinet/in.h>
#include <string>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

namespace surflect {
namespace {

TEST(DisplayAddress, HasTheViewersPortUnlessAnotherIsGiven) {
  const auto parts = [](std::string_view text) {
    const DisplayAddress address = displayAddress(text);
    return address.host + " " + address.port;
  };
  EXPECT_EQ(parts("localhost"), "localhost 14158");
  EXPECT_EQ(parts("studio.example:1"), "studio.example 1");
  EXPECT_EQ(parts("127.0.0.1:65535"), "127.0.0.1 65535");
  EXPECT_EQ(parts("[::1]"), "::1 14158");
  EXPECT_EQ(parts("[::1]:2000"), "::1 2000");
  for (const char* none : {"", ":1", "host:", "host:0", "host:65536", "host:1x", "[::1", "[::1]2000", "[]"})
    EXPECT_THROW(displayAddress(none), Error) << none;
}

// A viewer that begins to read when it is told to.
class LateViewer {
public:
  LateViewer() : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof any;
    works = listener_ >= 0 && ::bind(listener_, reinterpret_cast<sockaddr*>(&any), size) == 0 &&
            ::listen(listener_, 1) == 0 &&
            ::getsockname(listener_, reinterpret_cast<sockaddr*>(&any), &size) == 0;
    address = "127.0.0.1:" + std::to_string(ntohs(any.sin_port));
  }
  ~LateViewer() { ::close(listener_); }

  // Values of the pictures that are sent, each of equal floats, until all lines of one of `last` are there.
  std::vector<float> read(float last, int height) const {
    std::vector<float> values;
    const int connection = ::accept(listener_, nullptr, nullptr);
    std::string packet;
    for (int lines = 0; values.empty() || values.back() != last || lines < height;) {
      uint32_t size = 0;
      if (!take(connection, reinterpret_cast<char*>(&size), sizeof size)) break;
      packet.resize(size - sizeof size);
      if (!take(connection, packet.data(), packet.size())) break;
      constexpr char kUpdateImageV3 = 6;
      if (packet[0] != kUpdateImageV3) continue;
      // Type, whether it changes to the picture, "film", number and names of channels; x, y, width, height.
      constexpr size_t kPlace = 1 + 1 + 5 + 4 + 8;
      std::array<int32_t, 4> place{};
      std::memcpy(place.data(), packet.data() + kPlace, sizeof place);
      float value = 0;
      std::memcpy(&value, packet.data() + packet.size() - sizeof value, sizeof value);
      if (values.empty() || values.back() != value) values.push_back(value);
      lines = place[1] + place[3];
    }
    ::close(connection);
    return values;
  }

  bool works = false; // where there is IPv6
  std::string address;

private:
  static bool take(int connection, char* to, size_t size) {
    while (size > 0) {
      const ssize_t got = ::recv(connection, to, size, 0);
      if (got <= 0) return false;
      to += got;
      size -= static_cast<size_t>(got);
    }
    return true;
  }

  int listener_;
};

TEST(DisplayClient, AViewerThatIsSlowGetsTheLatestFrames) {
  const LateViewer viewer;
  ASSERT_TRUE(viewer.works);
  constexpr int kFrames = 14;
  image::Image frame(2048, 1024, 4);
  constexpr size_t kFit = DisplayClient::kMostBytes / (sizeof(float) * 2048 * 1024 * 4);
  DisplayClient client(displayAddress(viewer.address), "film",
                       [](const std::string& line) { FAIL() << line; });
  for (int k = 1; k <= kFrames; ++k) {
    std::ranges::fill(frame.values, static_cast<float>(k));
    client.show(frame);
  }
  const std::vector<float> shown = viewer.read(kFrames, frame.height);
  ASSERT_FALSE(shown.empty());
  EXPECT_EQ(shown.back(), kFrames);
  // The first may have been on its way when more came than fit.
  EXPECT_LE(shown.size(), kFit + 1);
  for (size_t i = 0; i < std::min(kFit, shown.size()); ++i)
    EXPECT_EQ(shown[shown.size() - 1 - i], static_cast<float>(kFrames - static_cast<int>(i)));
}

} // namespace
} // namespace surflect
