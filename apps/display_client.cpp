// [tev] github.com/Tom94/tev, include/tev/Ipc.h: packets over TCP. All numbers have the least significant
// byte first; a packet begins with its own length (32 bits) and its type (8 bits); texts end with a zero
// byte.
#include "apps/display_client.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <netdb.h>
#include <optional>
#include <poll.h>
#include <span>
#include <sys/socket.h>
#include <system_error>
#include <thread>
#include <unistd.h>

namespace surflect {

namespace {

constexpr std::string_view kTevPort = "14158";
constexpr std::array<std::string_view, 4> kTevChannels = {"R", "G", "B", "A"};
constexpr char kCreateImage = 4, kUpdateImageV3 = 6; // types of packets

// A packet under construction.
class Packet {
public:
  explicit Packet(char type) { add(uint32_t{0}).add(type); }

  template <class Number> Packet& add(Number value) {
    static_assert(std::endian::native == std::endian::little);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Packet& text(std::string_view value) {
    bytes_.append(value).push_back('\0');
    return *this;
  }
  // Values below 0, which the frame's file has as 0, are so here.
  Packet& floats(std::span<const float> values) {
    for (const float value : values) add(value < 0 ? 0.f : value);
    return *this;
  }
  std::string finished() && {
    const auto size = static_cast<uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &size, sizeof size);
    return std::move(bytes_);
  }

private:
  std::string bytes_;
};

// CreateImage: whether the viewer changes to it, name, size, channels.
std::string creationPacket(const std::string& name, const image::Image& color) {
  Packet packet(kCreateImage);
  packet.add(char{1}).text(name).add(int32_t{color.width}).add(int32_t{color.height});
  packet.add(static_cast<int32_t>(kTevChannels.size()));
  for (const std::string_view channel : kTevChannels) packet.text(channel);
  return std::move(packet).finished();
}

// UpdateImageV3 of lines [first, end): as above; x, y, width, height; for each channel the first float and
// the distance from pixel to pixel; floats.
std::string linesPacket(const std::string& name, const image::Image& color, int first, int end) {
  Packet packet(kUpdateImageV3);
  packet.add(char{0}).text(name).add(static_cast<int32_t>(kTevChannels.size()));
  for (const std::string_view channel : kTevChannels) packet.text(channel);
  packet.add(int32_t{0}).add(int32_t{first}).add(int32_t{color.width}).add(int32_t{end - first});
  for (int64_t channel = 0; channel < 4; ++channel) packet.add(channel);
  for (int64_t channel = 0; channel < 4; ++channel) packet.add(int64_t{4});
  const size_t line = 4 * static_cast<size_t>(color.width);
  packet.floats(std::span(color.values)
                    .subspan(static_cast<size_t>(first) * line, static_cast<size_t>(end - first) * line));
  return std::move(packet).finished();
}

std::string reasonOf(int error) { return std::generic_category().message(error); }

// A connection; calls throw Error with the reason, and if nothing happens for kMostSeconds.
class Connection {
public:
  explicit Connection(const DisplayAddress& address) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (const int error = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found))
      throw Error(::gai_strerror(error));
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, ::freeaddrinfo);
    std::string reason;
    for (const addrinfo* each = found; each; each = each->ai_next) {
      reason = tryConnect(*each);
      if (reason.empty()) return;
    }
    throw Error(reason);
  }
  ~Connection() { close(); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent > 0) {
        bytes.remove_prefix(static_cast<size_t>(sent));
      } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
        if (!isReady()) throw Error("it takes no data");
      } else if (errno != EINTR) {
        throw Error(reasonOf(errno));
      }
    }
  }

private:
  // Empty if it worked.
  std::string tryConnect(const addrinfo& to) {
    socket_ = ::socket(to.ai_family, to.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, to.ai_protocol);
    if (socket_ < 0) return reasonOf(errno);
    int error = 0;
    if (::connect(socket_, to.ai_addr, to.ai_addrlen) != 0) error = errno;
    if (error == EINPROGRESS) {
      socklen_t size = sizeof error;
      if (!isReady())
        error = ETIMEDOUT;
      else if (::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size) != 0)
        error = errno;
    }
    if (error == 0) return "";
    close();
    return reasonOf(error);
  }
  bool isReady() const {
    pollfd wanted{socket_, POLLOUT, 0};
    return ::poll(&wanted, 1, static_cast<int>(1000 * DisplayClient::kMostSeconds)) != 0;
  }
  void close() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }

  int socket_ = -1;
};

} // namespace

DisplayAddress displayAddress(std::string_view text) {
  const auto complain = [&] {
    return Error::mismatch("HOST or HOST:PORT, with a port in 1..65535", '"' + std::string(text) + '"');
  };
  DisplayAddress address{"", std::string(kTevPort)};
  const bool isBracketed = text.starts_with('[');
  const size_t end = isBracketed ? text.find(']') : text.find(':');
  if (isBracketed && end == text.npos) throw complain();
  address.host = text.substr(isBracketed, end - (isBracketed && end != text.npos));
  std::string_view rest = end == text.npos ? "" : text.substr(end + isBracketed);
  if (!rest.empty()) {
    if (!rest.starts_with(':')) throw complain();
    rest.remove_prefix(1);
    int port = 0;
    const auto [stop, status] = std::from_chars(rest.data(), rest.data() + rest.size(), port);
    if (status != std::errc() || stop != rest.data() + rest.size() || port < 1 || port > 65535)
      throw complain();
    address.port = rest;
  }
  if (address.host.empty() || address.host.find('\0') != address.host.npos) throw complain();
  return address;
}

struct DisplayClient::State {
  DisplayAddress address;
  std::string name;
  std::function<void(const std::string&)> giveUp;

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<image::Image> waiting;
  size_t waitingBytes = 0;
  bool isClosed = false, isDone = false;

  // Sends what comes until it is closed.
  void work() {
    try {
      Connection connection(address);
      bool isCreated = false;
      while (const auto color = next()) {
        if (!isCreated) connection.send(creationPacket(name, *color));
        isCreated = true;
        constexpr int64_t kFloats = int64_t{1} << 20; // of a packet: a viewer keeps a whole one
        const int lines = static_cast<int>(std::max<int64_t>(1, kFloats / (4 * int64_t{color->width})));
        for (int y = 0; y < color->height; y += lines)
          connection.send(linesPacket(name, *color, y, std::min(y + lines, color->height)));
      }
    } catch (const std::exception& problem) {
      const std::lock_guard lock(mutex);
      if (!isDone && giveUp)
        giveUp("display " + address.host + ":" + address.port + ": " + problem.what() +
               "; rendering goes on without it");
    }
    const std::lock_guard lock(mutex);
    isDone = true;
    waiting.clear();
    changed.notify_all();
  }

  std::optional<image::Image> next() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return isClosed || !waiting.empty(); });
    if (waiting.empty() || isDone) return std::nullopt;
    image::Image color = std::move(waiting.front());
    waiting.pop_front();
    waitingBytes -= color.values.size() * sizeof(float);
    return color;
  }
};

DisplayClient::DisplayClient(DisplayAddress address, std::string name,
                             std::function<void(const std::string&)> giveUp)
    : state_(std::make_shared<State>()) {
  state_->address = std::move(address);
  state_->name = std::move(name);
  state_->giveUp = std::move(giveUp);
  std::thread([state = state_] { state->work(); }).detach();
}

DisplayClient::~DisplayClient() {
  std::unique_lock lock(state_->mutex);
  state_->isClosed = true;
  state_->changed.notify_all();
  const bool isDone = state_->changed.wait_for(lock, std::chrono::duration<double>(kMostSeconds),
                                               [&] { return state_->isDone; });
  if (!isDone) {
    state_->isDone = true; // nothing more is said or sent
    if (state_->giveUp)
      state_->giveUp("display " + state_->address.host + ":" + state_->address.port +
                     ": the last frames are not shown, as it takes data too slowly");
  }
}

void DisplayClient::show(const image::Image& color) {
  const std::lock_guard lock(state_->mutex);
  if (state_->isDone) return;
  const size_t bytes = color.values.size() * sizeof(float);
  while (!state_->waiting.empty() && state_->waitingBytes + bytes > kMostBytes) {
    state_->waitingBytes -= state_->waiting.front().values.size() * sizeof(float);
    state_->waiting.pop_front();
  }
  state_->waiting.push_back(color);
  state_->waitingBytes += bytes;
  state_->changed.notify_all();
}

} // namespace surflect
