// A session: one thread that opens, uses and closes renderers, for programs whose states come faster than
// frames. Contexts of OpenGL belong to a thread, so that nothing else may own a renderer there.
//
// Clients, such as tabs of a browser, ask for work on a renderer and wait for its end. The latest state wins:
// work of a client that has not begun gives way to newer work of the same client, and work that can be given
// up ends at its next checkpoint. Work of different clients takes turns.
#pragma once

#include "render/method/renderer.h"
#include "surfel/base/time.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace surflect::session {

// Thrown to a client whose work gave way to newer work.
class Superseded : public std::exception {
public:
  const char* what() const noexcept override { return "superseded by a newer state"; }
};

enum class Urgency {
  preview, // runs to its end once it has begun: else a drag would show nothing
  full     // is given up for newer work of its client
};

class Session {
public:
  using Open = std::function<std::unique_ptr<method::Renderer>(const Progress&)>;
  using Work = std::function<void(method::Renderer&, const Progress&)>;

  // `models` are opened when work first asks for them. `progress` reports from the session's thread, and may
  // cancel everything.
  Session(std::vector<Open> models, Progress progress);
  // Gives up all work, waits until no call of run() is left, and closes the renderers.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Runs work with the renderer of a model on the session's thread, and waits for its end. Throws Superseded,
  // Cancelled when the session ends, and what opening the model or the work throws. Safe from many threads.
  void run(const std::string& client, size_t model, Urgency urgency, const Work& work);

  // Closes the renderer of a model once no work uses it; it is opened again for the next work.
  void close(size_t model);

private:
  struct Job {
    const std::string& client;
    size_t model;
    Urgency urgency;
    const Work& work;
    bool isSuperseded = false, isDone = false;
    std::exception_ptr problem = {};
  };

  void serve();
  void perform(Job& job);

  const std::vector<Open> models_;
  const Progress progress_;
  std::vector<std::unique_ptr<method::Renderer>> renderers_; // of the thread alone
  // State shared by all threads.
  std::mutex mutex_;
  std::condition_variable asked_, done_;
  std::deque<Job*> waiting_;
  Job* current_ = nullptr;
  std::vector<bool> isClosing_; // by model
  bool isEnding_ = false;
  size_t callers_ = 0; // of run()
  std::thread thread_; // last: it uses the others
};

} // namespace surflect::session
