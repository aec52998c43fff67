// The viewer behind its page: what each request answers. Knows nothing of HTTP's connections (server.h).
#pragma once

#include "apps/viewer/events.h"
#include "apps/viewer/request.h"
#include "apps/viewer/start_list.h"
#include "apps/viewer/tabs.h"
#include "render/film/display.h"
#include "render/film/shot_renderer.h"
#include "render/session/session.h"

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace surflect::viewer {

struct Answer {
  int status = 200;
  std::string body;
  std::string type = "application/json";
  std::string picture = {}; // of the header X-Picture; or empty
};

// Safe from many threads.
class Viewer {
public:
  // Throws as openStartList().
  Viewer(ViewerInput input, const Progress& progress);
  ~Viewer();

  // Answers a request of a tab to a route such as "/frame". Errors become answers: 400 for malformed
  // requests, 404 for unknown routes, 409 for superseded ones, 422 for mistaken scripts, 429 for too many
  // tabs, 500 for failures.
  Answer answer(const std::string& tab, const std::string& route, const std::string& body);
  // Events after a number, for GET /events.
  Answer events(const std::string& tab, uint64_t after);
  // Closes models that no tab looks at. To be called now and then.
  void tidy();
  // Ends all waiting.
  void end();

private:
  // A rendered frame of a script.
  struct Rendered {
    method::FrameLayers layers;
    capture::Camera<ObjectSpace> camera;
    double seconds = 0;
  };
  struct Probed {
    std::string state;
    Rendered rendered;
  };

  Json start() const;
  Answer frame(const std::string& tab, const FrameRequest& request);
  Answer photograph(const FrameRequest& request);
  Answer comparison(const std::string& tab, const FrameRequest& request);
  Json probe(const std::string& tab, const Json& body);
  Answer thumbnail(const Json& body);
  Json snapshot(const std::string& tab, const FrameRequest& request);
  Json record(const std::string& tab, const Json& body);
  // Numbers of a script's values at a frame, and the pose of its camera.
  Json valuesOf(const Json& values, size_t model, int frame) const;
  Answer save(const Json& body);

  // Runs work with the renderer of a script's frames, at the request's size or at the script's own.
  void withShot(const std::string& client, const FrameRequest& request, const std::string& text,
                bool isOwnSize, const std::function<void(film::ShotRenderer&)>& work);
  // Renders the request's frame, sharp in a preview at the request's size; or its object alone, sharp and
  // without the ground.
  enum class Part { frame, object };
  Rendered render(const std::string& client, const FrameRequest& request, const std::string& text,
                  const std::vector<std::string>& aovs, bool isOwnSize, Part part = Part::frame);
  method::Setting settingOf(const FrameRequest& request, const DescribedModel& model) const;
  size_t modelAt(const Json& body) const;       // throws Malformed
  void requireModel(size_t model) const;        // throws Malformed for a capture alone
  Photographs& photographs(size_t model) const; // throws Malformed without a capture of the model's object
  // Values whose camera is a pose, if it is a held-out one, which models do not know.
  Json withKnownCamera(const FrameRequest& request) const;
  // How a frame of a script is shown: by the script where it says so, else by the page. Behind what the
  // script calls transparent is the page's background.
  DisplayOptions displayOf(const FrameRequest& request, const std::string& text, const image::Image& color);
  // Shows a photograph, or what is shown like one, at the script's exposure if it has one.
  void exposeAsShot(const FrameRequest& request, DisplayOptions& display) const;
  // Reports to the pages; cancelled when the viewer ends.
  Progress untilTheEnd();
  std::string stemOf(size_t model) const;
  // A path in the folder of snapshots that no file has, without extension; makes the folder.
  std::filesystem::path freeName(const std::string& stem);

  ViewerInput input_;
  StartList list_;
  Events events_;
  std::atomic<bool> isEnding_ = false;
  scene::Environments environments_; // of the session's thread
  Tabs tabs_;
  std::mutex finishing_; // of finish_, the last one
  std::shared_ptr<const film::Finish> finish_;
  std::mutex mutex_;                     // of the next three
  std::shared_ptr<const Probed> probed_; // the last one
  std::string recordingTab_;             // whose film is being made; or empty
  bool isStopped_ = false;               // that film
  std::mutex naming_;
  std::unique_ptr<session::Session> session_; // last: its thread uses the others
};

} // namespace surflect::viewer
