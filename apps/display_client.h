// Shows frames in tev, an image viewer, or in any program that speaks its protocol, while they are rendered.
#pragma once

#include "srf/image/image.h"

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace surflect {

// Host and port of "HOST", "HOST:PORT", "[IPv6]:PORT"; port 14158 by default. Throws Error for anything else.
struct DisplayAddress {
  std::string host, port;
};
DisplayAddress displayAddress(std::string_view text);

// Pictures are sent by a thread of its own, so that the film waits for the viewer only at its end, and then
// for at most kMostSeconds. A viewer that does not take data for so long is given up; so is one that does not
// answer. Where more than kMostBytes of frames wait to be sent, the oldest are left out.
class DisplayClient {
public:
  static constexpr double kMostSeconds = 3;
  static constexpr size_t kMostBytes = size_t{1} << 28;

  // `name` is the picture's in the viewer; all frames have the same size. `giveUp` is called at most once
  // with a line that says why nothing more is shown: from the other thread, or from the caller's at its end.
  DisplayClient(DisplayAddress address, std::string name, std::function<void(const std::string&)> giveUp);
  // Waits as above.
  ~DisplayClient();
  DisplayClient(const DisplayClient&) = delete;
  DisplayClient& operator=(const DisplayClient&) = delete;

  // Shows a frame of premultiplied RGBA in linear light instead of the one before; values below 0 as 0, as in
  // the frame's file.
  void show(const image::Image& color);

private:
  struct State; // of both threads; a thread that hangs in a look-up of the host's name keeps it
  std::shared_ptr<State> state_;
};

} // namespace surflect
