#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "apps/viewer/server.h"
#include "render/scene/script.h"
#include "srf/model/manifest.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

namespace surflect {

namespace {

struct ViewArguments {
  std::vector<std::string> targets;
  std::string capture, environments, snapshots = "snapshots";
  capture::PathRule outside = capture::PathRule::inside;
  viewer::ServerOptions server;
  MethodOptions options;
};

bool isModel(const std::filesystem::path& folder) {
  std::error_code unreadable;
  return std::filesystem::exists(folder / model::kManifestFile, unreadable);
}

// The models in a folder, by name.
std::vector<std::filesystem::path> modelsIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> models;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_directory() && isModel(entry.path())) models.push_back(entry.path());
  std::ranges::sort(models);
  return models;
}

// Adds what a target names: a model, a script, a capture, or a folder of models.
void addTarget(const std::filesystem::path& target, capture::PathRule outside, viewer::ViewerInput& input) {
  requireExisting(target);
  if (!std::filesystem::is_directory(target)) {
    if (target.extension() == ".json") {
      input.capture = capture::readCapture(target, outside);
      return;
    }
    if (target.extension() != ".toml")
      throw Error::mismatch("a model, a script, a capture, or a folder of models", "another file").in(target);
    if (!input.script.empty()) throw UsageError(Error("is a second script; the page edits one").in(target));
    input.script = target;
    const scene::ScriptHead head = scene::readScriptHead(target);
    if (!head.objects.empty())
      throw Error("a scene of several objects cannot be viewed yet: render makes its frames").in(target);
    input.models.insert(input.models.begin(), head.model);
  } else if (isModel(target)) {
    input.models.push_back(target);
  } else if (std::filesystem::exists(target / "transforms.json")) {
    input.capture = capture::readCapture(target, outside);
  } else {
    const auto models = modelsIn(target);
    if (models.empty())
      throw Error::mismatch("a model, a capture (transforms.json), or folders of models in it",
                            "none of these")
          .in(target);
    input.models.insert(input.models.end(), models.begin(), models.end());
  }
}

// Pictures of a folder that can be environments.
std::vector<std::filesystem::path> environmentsIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> pictures;
  std::error_code missing;
  for (const auto& entry : std::filesystem::directory_iterator(folder, missing))
    if (entry.path().extension() == ".exr" || entry.path().extension() == ".hdr")
      pictures.push_back(entry.path());
  std::ranges::sort(pictures);
  return pictures;
}

viewer::ViewerInput inputOf(const ViewArguments& arguments) {
  constexpr size_t kMostModels = 16; // each is opened once to be described
  viewer::ViewerInput input;
  for (const std::string& target : arguments.targets) addTarget(target, arguments.outside, input);
  if (input.models.size() > kMostModels)
    throw Error::mismatch(fmt::format("at most {} models", kMostModels), std::to_string(input.models.size()))
        .in(arguments.targets.front());
  if (!arguments.capture.empty()) input.capture = capture::readCapture(arguments.capture, arguments.outside);
  if (!arguments.environments.empty()) {
    requireExisting(arguments.environments);
    input.environments = environmentsIn(arguments.environments);
    if (input.environments.empty()) throw Error("holds no .exr or .hdr picture").in(arguments.environments);
  }
  requireCreatable(arguments.snapshots);
  input.snapshots = arguments.snapshots;
  return input;
}

// Throws UsageError unless all models take the given options.
method::Setting settingOf(const ViewArguments& arguments, const viewer::ViewerInput& input) {
  method::Setting setting;
  for (const std::filesystem::path& model : input.models)
    setting = arguments.options.settingFor(method::methodOfModel(model));
  return setting;
}

bool isLoopback(const std::string& host) {
  return host == "127.0.0.1" || host == "localhost" || host == "::1";
}

Json runView(const ViewArguments& arguments, const Progress& progress) {
  viewer::ViewerInput input = inputOf(arguments);
  input.setting = settingOf(arguments, input);
  if (!isLoopback(arguments.server.host))
    say(fmt::format("--host {}: other machines can reach the viewer; whoever has its address, which is sent "
                    "unencrypted, can write snapshots and the script",
                    arguments.server.host));
  viewer::Viewer viewer(std::move(input), progress);
  progress("opened", 1);
  const viewer::Server server(viewer, arguments.server);
  say(server.url());
  say("open this address in a browser; Ctrl-C ends the viewer");
  for (int turn = 1; interruptingSignal() == 0; ++turn) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    if (turn % 20 == 0) viewer.tidy();
  }
  // The server waits for requests under way; clients that never finish theirs get five seconds.
  std::thread([] {
    std::this_thread::sleep_for(std::chrono::seconds(5));
    std::_Exit(0);
  }).detach();
  return {{"url", server.url()}};
}

} // namespace

void addViewCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<ViewArguments>();
  CLI::App* command =
      app.add_subcommand("view", "look at models in a browser: move camera, lamps and warps by hand");
  command->footer("Example: surflect view vase.srf\n"
                  "         surflect view examples/vase.toml --capture examples/vase -o snapshots/\n"
                  "From another machine: ssh -L 8080:127.0.0.1:8080 HOST surflect view vase.srf --port 8080");
  command
      ->add_option("target", arguments->targets,
                   "models to compare, a script to edit, a capture, or a folder of models")
      ->required();
  command
      ->add_option("--capture", arguments->capture, "photographs to compare with, and to show beside a pixel")
      ->check(notEmpty());
  addAllowOutside(*command, arguments->outside);
  command->add_option("--environments", arguments->environments, "folder of .exr and .hdr maps to light with")
      ->check(notEmpty());
  command->add_option("-o,--output", arguments->snapshots, "folder for snapshots and films")
      ->capture_default_str()
      ->check(notEmpty());
  command->add_option("--port", arguments->server.port, "port of the page; default: any that is free")
      ->check(wholeIn(1, 65535));
  command->add_option("--host", arguments->server.host, "address to listen on")->capture_default_str();
  addSimd(*command);
  arguments->options.add(*command, MethodOptions::Kind::render, [arguments] {
    return arguments->targets.empty() ? nullptr : methodAt(arguments->targets.front());
  });
  setWork(*command, work, "nothing was lost",
          [arguments](const Progress& progress) { return runView(*arguments, progress); });
}

} // namespace surflect
