#include "apps/viewer/server.h"

#include "page/page.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <httplib.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <random>
#include <thread>

namespace surflect::viewer {

namespace {

constexpr size_t kLargestBody = 1 << 20;
constexpr size_t kThreads = 4 * kMostTabs; // a tab waits for events, a picture, and holds idle connections

std::string randomToken() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", random());
  return token;
}

// "127.0.0.1" of "127.0.0.1:8080", "[::1]" of "[::1]:8080".
std::string withoutPort(const std::string& host) {
  const size_t colon = host.rfind(':');
  const bool isPort = colon != host.npos && host.find(']', colon) == host.npos;
  return isPort ? host.substr(0, colon) : host;
}

bool isLoopback(const std::string& host) {
  return host == "127.0.0.1" || host == "localhost" || host == "::1";
}

// Whether texts are equal, in a time that does not tell how many letters agree.
bool isSame(const std::string& a, const std::string& b) {
  unsigned differs = a.size() != b.size();
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    differs |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return differs == 0;
}

const PageFile* pageFile(const std::string& path) {
  const std::string name = path == "/" ? "index.html" : path.substr(1);
  const auto* const found = std::ranges::find(kPage, name, &PageFile::name);
  return found == std::end(kPage) ? nullptr : found;
}

const char* typeOf(std::string_view name) {
  if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  if (name.ends_with(".svg")) return "image/svg+xml";
  return "text/html; charset=utf-8";
}

bool isTabName(const std::string& tab) {
  return tab.size() >= 8 && tab.size() <= 64 &&
         std::ranges::all_of(tab, [](unsigned char c) { return std::isxdigit(c) != 0; });
}

void refuse(httplib::Response& response, int status, const char* problem) {
  response.status = status;
  response.set_content(fmt::format("{{\"error\":\"{}\"}}", problem), "application/json");
}

} // namespace

struct Server::State {
  Viewer& viewer;
  const std::string host, token = randomToken();
  int port = 0;
  httplib::Server http;
  std::atomic<bool> hasEnded = false;
  std::thread thread;

  State(Viewer& of, const ServerOptions& options) : viewer(of), host(options.host) {
    http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    // Not SO_REUSEPORT, the library's default, by which a second viewer would take half of the first one's
    // requests.
    http.set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    http.set_payload_max_length(kLargestBody);
    http.set_tcp_nodelay(true);
    http.set_keep_alive_timeout(5);
    http.set_keep_alive_max_count(10'000);
    http.set_read_timeout(10);
    http.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"X-Content-Type-Options", "nosniff"},
         {"Referrer-Policy", "no-referrer"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Content-Security-Policy",
          "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
          "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"}});
    http.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      return admit(request, response) ? httplib::Server::HandlerResponse::Unhandled
                                      : httplib::Server::HandlerResponse::Handled;
    });
    http.Get(".*", [this](const httplib::Request& request, httplib::Response& response) {
      get(request, response);
    });
    http.Post(".*", [this](const httplib::Request& request, httplib::Response& response) {
      answer(viewer.answer(request.get_header_value("X-Surflect-Tab"), request.path, request.body), response);
    });
    http.set_error_handler([](const httplib::Request&, httplib::Response& response) {
      if (response.body.empty())
        refuse(response, response.status,
               response.status == 413 ? "the body is larger than 1 MiB" : "the request cannot be read");
    });
    port = options.port == 0 ? http.bind_to_any_port(host.c_str()) : options.port;
    if (port <= 0 || (options.port != 0 && !http.bind_to_port(host.c_str(), port)))
      throw Error(
          fmt::format("cannot listen on {}:{}: the port is taken, or the address is not this machine's", host,
                      options.port))
          .at("--port");
    thread = std::thread([this] {
      http.listen_after_bind();
      hasEnded = true;
    });
  }

  ~State() {
    while (!http.is_running() && !hasEnded) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    http.stop();
    thread.join();
  }

  // Whether a request may be answered; otherwise it has been refused.
  bool admit(const httplib::Request& request, httplib::Response& response) const {
    const std::string named = request.get_header_value("Host"), origin = request.get_header_value("Origin");
    const std::string name = withoutPort(named);
    // Whoever opened the server to other machines does not know all names by which they call this one.
    const bool isOwnName = !isLoopback(host) || name == "127.0.0.1" || name == "localhost" || name == "[::1]";
    if (request.get_header_value_count("Host") != 1 || !isOwnName)
      return refuse(response, 403, "the request names another host"), false;
    if (request.has_header("Origin") && origin != "http://" + named)
      return refuse(response, 403, "the request comes from another page"), false;
    if (request.method != "GET" && request.method != "POST")
      return refuse(response, 405, "GET and POST alone are answered"), false;
    // The library bounds bodies of a stated length alone.
    if (request.has_header("Transfer-Encoding") || request.has_header("Content-Encoding"))
      return refuse(response, 400, "the body must have a stated length, and no encoding"), false;
    if (request.method == "GET" && pageFile(request.path)) return true;
    if (!isSame(request.get_header_value("X-Surflect-Token"), token))
      return refuse(response, 403,
                    "the token is missing or wrong: open the address that surflect view prints"),
             false;
    if (!isTabName(request.get_header_value("X-Surflect-Tab")))
      return refuse(response, 400, "X-Surflect-Tab: expected 8 to 64 hexadecimal digits"), false;
    return true;
  }

  void get(const httplib::Request& request, httplib::Response& response) {
    if (const PageFile* const file = pageFile(request.path))
      return response.set_content(file->text.data(), file->text.size(), typeOf(file->name));
    const std::string tab = request.get_header_value("X-Surflect-Tab");
    if (request.path == "/start") return answer(viewer.answer(tab, "/start", ""), response);
    if (request.path == "/events") {
      const std::string text = request.get_param_value("after");
      uint64_t after = 0;
      const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), after);
      if (status != std::errc() || end != text.data() + text.size())
        return refuse(response, 400, "after: expected a whole number");
      return answer(viewer.events(tab, after), response);
    }
    refuse(response, 404, "no such request");
  }

  static void answer(Answer made, httplib::Response& response) {
    response.status = made.status;
    if (!made.picture.empty()) response.set_header("X-Picture", made.picture);
    response.set_content(std::move(made.body), made.type);
  }
};

Server::Server(Viewer& viewer, const ServerOptions& options)
    : state_(std::make_unique<State>(viewer, options)) {}

Server::~Server() { state_->viewer.end(); }

std::string Server::url() const {
  const std::string& host = state_->host;
  const bool isAll = host == "0.0.0.0" || host == "::", isSixth = host.find(':') != host.npos;
  return fmt::format("http://{}:{}/#token={}",
                     isAll     ? "127.0.0.1"
                     : isSixth ? '[' + host + ']'
                               : host,
                     state_->port, state_->token);
}

} // namespace surflect::viewer
