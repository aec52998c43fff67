// The viewer's server: HTTP on the loopback interface, for the page that it serves and nobody else.
//
// Each request must name this machine by a name of its own (no foreign name can be made to lead here), come
// from no other page (Origin), and carry a token of 128 random bits in a header, which other pages cannot
// send; the page's own files, which are in the program, need no token. No request names a file.
#pragma once

#include "apps/viewer/viewer.h"

#include <memory>
#include <string>

namespace surflect::viewer {

struct ServerOptions {
  std::string host = "127.0.0.1";
  int port = 0; // 0: any that is free
};

class Server {
public:
  // Begins to listen. Throws Error if the port is taken or the host is none of this machine's.
  Server(Viewer& viewer, const ServerOptions& options);
  // Stops, after the requests that are being answered.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // "http://127.0.0.1:40123/#token=0123.."
  std::string url() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace surflect::viewer
