// The viewer behind its page: what each request answers. Knows nothing of HTTP's connections (server.h).
#pragma once

#include "apps/viewer/description.h"
#include "apps/viewer/events.h"
#include "apps/viewer/photographs.h"
#include "apps/viewer/request.h"
#include "apps/viewer/shot_document.h"
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

struct ViewerInput {
  // Models, that of the script first; or a capture alone.
  std::vector<std::filesystem::path> models;
  std::optional<capture::Capture> capture;
  std::filesystem::path script;    // or empty
  std::filesystem::path snapshots; // folder of snapshots and films; made when the first one is written
  std::vector<std::filesystem::path> environments; // pictures that lights may use
  method::Setting setting;                         // of the models, given on the command line
};

struct Answer {
  int status = 200;
  std::string body;
  std::string type = "application/json";
  std::string picture = {}; // of the header X-Picture; or empty
};

// Most tabs at a time.
inline constexpr size_t kMostTabs = 8;

// Safe from many threads.
class Viewer {
public:
  // Opens each model once, to describe it. Throws Error as openRenderer() and ShotDocument do, for a script
  // in original coordinates, which pages do not know, and Cancelled.
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
    double seconds = 0;
  };
  struct Probed {
    std::string state;
    Rendered rendered;
  };
  struct Tab {
    std::chrono::steady_clock::time_point seen;
    std::vector<size_t> models; // the last two that it looked at, A and B
  };

  Json start() const;
  Answer frame(const std::string& tab, const FrameRequest& request);
  Answer photograph(const FrameRequest& request);
  Answer comparison(const std::string& tab, const FrameRequest& request);
  Json probe(const std::string& tab, const Json& body);
  Answer thumbnail(const Json& body);
  Json snapshot(const std::string& tab, const FrameRequest& request);
  Json record(const std::string& tab, const Json& body);
  Json valuesOf(const Json& body) const;
  Answer save(const Json& body);

  // Runs work with the renderer of a script's frames, at the request's size or at the script's own.
  void withShot(const std::string& client, const FrameRequest& request, const std::string& text,
                bool isOwnSize, const std::function<void(film::ShotRenderer&)>& work);
  // Renders the request's frame.
  Rendered render(const std::string& client, const FrameRequest& request, const std::string& text,
                  const std::vector<std::string>& aovs, bool isOwnSize);
  method::Setting settingOf(const FrameRequest& request, const DescribedModel& model) const;
  void requireModel(size_t model) const;        // throws Malformed for a capture alone
  Photographs& photographs(size_t model) const; // throws Malformed without a capture of the model's object
  // Values whose camera is a pose, if it is a held-out one, which models do not know.
  Json withKnownCamera(const FrameRequest& request) const;
  DisplayOptions displayOf(const FrameRequest& request, const image::Image& color) const;
  // Takes note of a tab; false if there are too many.
  bool admit(const std::string& tab);
  void leave(const std::string& tab);
  void setModel(const std::string& tab, size_t model);
  void forgetClosedTabs(); // with mutex_ held
  void report(std::string_view stage, double fraction);
  // Reports to the pages; cancelled when the viewer ends.
  Progress untilTheEnd();
  std::string stemOf(size_t model) const;
  // A path in the folder of snapshots that no file has, without extension; makes the folder.
  std::filesystem::path freeName(const std::string& stem);

  ViewerInput input_;
  std::vector<std::unique_ptr<DescribedModel>> models_;
  std::unique_ptr<ShotDocument> document_;
  std::vector<std::pair<std::string, std::string>> environmentNames_; // name, and path as scripts name it
  std::vector<std::unique_ptr<Photographs>>
      photographs_; // by model; null where the capture is another object's
  Events events_;
  std::atomic<bool> isEnding_ = false;
  scene::Environments environments_; // of the session's thread
  std::mutex mutex_;
  std::map<std::string, Tab> tabs_;
  std::shared_ptr<const Probed> probed_; // the last one
  std::string recordingTab_;             // whose film is being made; or empty
  bool isStopped_ = false;               // that film
  std::mutex naming_;
  std::mutex reporting_;
  std::string stage_;
  std::chrono::steady_clock::time_point stageBegin_, reported_;
  std::unique_ptr<session::Session> session_; // last: its thread uses the others
};

} // namespace surflect::viewer
