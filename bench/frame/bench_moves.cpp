// Times frames of a surfel model's script in which a lamp moves alone, or the camera, against whole frames,
// in turn, in a workspace that keeps stages. The frames are compared with whole ones, bit by bit, before they
// are timed.
#include "render/scene/script.h"
#include "render/surfels/surfel_method.h"
#include "srf/model/model.h"
#include "surfel/base/error.h"
#include "surfel/math/median.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace surflect::bench {
namespace {

using Json = nlohmann::ordered_json;

struct MoveArguments {
  std::string script;
  int frame = 10, rounds = 8;
  double scale = 1;
  std::vector<std::string> options; // NAME=VALUE
};

surfels::FrameOptions optionsOf(const MoveArguments& arguments) {
  const method::Method& method = surfels::surfelMethod();
  method::Setting setting;
  for (const std::string& text : arguments.options)
    setting[text.substr(0, text.find('='))] =
        method::parseSweep({method.tag, method.renderOptions}, text).values.front();
  return surfels::frameOptions(setting);
}

// The scene of a frame, and what is dragged there by steps of a degree around the object's middle.
class DraggedScene {
public:
  DraggedScene(const MoveArguments& arguments, const model::Model& model)
      : script_(scene::readScript(arguments.script, model.rig.origin)), middle_(model.middle.raw()) {
    const warp::ShotTime time = scene::shotTime(script_, arguments.frame);
    warp_ = scene::warpAt(script_, time);
    camera_ = scene::cameraAt(script_, time);
    const auto scaled = [&](int side) { return static_cast<int>(std::lround(arguments.scale * side)); };
    camera_.lens = capture::resized(camera_.lens, scaled(camera_.lens.width), scaled(camera_.lens.height));
    lights_ = scene::lightsAt(script_, time, scene::readEnvironments(script_, {}));
    lamp_ = static_cast<size_t>(std::ranges::find_if(lights_,
                                                     [](const scene::ShotLight& light) {
                                                       return !std::holds_alternative<scene::ShotEnvironment>(
                                                           light);
                                                     }) -
                                lights_.begin());
    if (lamp_ == lights_.size()) throw Error("has no lamp to move").in(arguments.script);
  }

  scene::Scene at(int lampSteps, int cameraSteps) const {
    scene::Scene scene{*warp_, camera_, lights_};
    const Mat3<double> turn = turned(lampSteps);
    if (auto* point = std::get_if<scene::ShotPointLight>(&scene.lights[lamp_]))
      point->position = assume<Point3<ObjectSpace, double>>(
          Vec3<double>(middle_ + turn * (point->position.raw() - middle_)));
    else if (auto* directional = std::get_if<scene::ShotDirectionalLight>(&scene.lights[lamp_]))
      directional->towards =
          assume<Direction3<ObjectSpace, double>>(Vec3<double>(turn * directional->towards.raw()));
    const Mat3<double> back = turned(-cameraSteps);
    scene.camera.cameraFromWorld =
        scene.camera.cameraFromWorld *
        Rigid<ObjectSpace, ObjectSpace>(back, Vec3<double>(middle_ - back * middle_));
    return scene;
  }

private:
  static Mat3<double> turned(int steps) {
    return Eigen::AngleAxisd(steps * Angle::fromDegrees(1).radians(), Vec3<double>::UnitZ())
        .toRotationMatrix();
  }

  scene::Script script_;
  Vec3<double> middle_;
  warp::WarpPointer warp_;
  capture::Camera<ObjectSpace> camera_;
  std::vector<scene::ShotLight> lights_;
  size_t lamp_ = 0; // the first light that is not an environment
};

// Times of the frames of one kind.
class Row {
public:
  void add(double seconds, const surfels::FrameStats& stats) {
    ms_.push_back(1e3 * seconds);
    for (const auto& [stage, ofStage] : stats.seconds) stages_[stage].push_back(1e3 * ofStage);
  }
  double ms() const { return median(ms_); }
  Json json(const Row& whole) const {
    Json stages;
    for (const auto& [stage, ms] : stages_) stages[stage] = median(ms);
    return {{"ms", ms()}, {"of_whole", ms() / whole.ms()}, {"stage_ms", stages}};
  }

private:
  std::vector<double> ms_;
  std::map<std::string, std::vector<double>> stages_;
};

class MoveBenchmark {
public:
  explicit MoveBenchmark(const MoveArguments& arguments)
      : arguments_(arguments), options_(optionsOf(arguments)),
        model_(model::openModel(scene::readScriptHead(arguments.script).model)), scene_(arguments, model_),
        workspace_(model_, size_t{1} << 30) {}

  Json run() {
    check();
    for (int round = 0; round < arguments_.rounds; ++round) {
      keep(false);
      time("whole", 0, 0);
      keep(true);
      for (const int step : {0, 1}) render(step, 0); // after which plans are kept
      for (const int step : {2, 3}) time("lamp", step, 0);
      for (const int step : {1, 2}) render(3, step); // after which look-ups are kept
      for (const int step : {3, 4}) time("camera", 3, step);
    }
    Json report{{"script", arguments_.script}, {"options", arguments_.options}, {"frame", arguments_.frame}};
    for (const char* name : {"whole", "lamp", "camera"}) report[name] = rows_[name].json(rows_["whole"]);
    return report;
  }

private:
  void keep(bool keeps) {
    workspace_.keepsStages = keeps;
    workspace_.kept = {};
  }
  const image::Image& render(int lampSteps, int cameraSteps) {
    workspace_.layers = surfels::renderFrame(model_, scene_.at(lampSteps, cameraSteps), options_, workspace_);
    return workspace_.layers.color;
  }
  void time(const char* name, int lampSteps, int cameraSteps) {
    const Stopwatch watch;
    render(lampSteps, cameraSteps);
    rows_[name].add(watch.seconds(), workspace_.stats);
  }

  void check() {
    constexpr std::array<std::array<int, 2>, 8> kDrag{
        {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {3, 2}, {3, 3}, {4, 4}}};
    std::vector<image::Image> whole;
    for (const auto& [lamp, camera] : kDrag) whole.push_back(render(lamp, camera));
    keep(true);
    for (size_t i = 0; i < kDrag.size(); ++i)
      if (render(kDrag[i][0], kDrag[i][1]).values != whole[i].values)
        throw Error(fmt::format("frame {} of a drag has other bits than a whole frame", i));
  }

  MoveArguments arguments_;
  surfels::FrameOptions options_;
  model::Model model_;
  DraggedScene scene_;
  surfels::FrameWorkspace workspace_;
  std::map<std::string, Row> rows_;
};

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect;
  bench::MoveArguments arguments;
  CLI::App app("Times frames in which only a lamp or only the camera moves\n"
               "Example: bench_moves examples/vase.toml --set interpolation=separate",
               "bench_moves");
  app.add_option("script", arguments.script, "TOML: model, camera and lights")->required();
  app.add_option("--frame", arguments.frame, "of the script")->capture_default_str();
  app.add_option("--rounds", arguments.rounds, "each times one whole frame, and two of each move")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--scale", arguments.scale, "factor on width and height")->check(CLI::Range(0.01, 8.0));
  app.add_option("--set", arguments.options, "NAME=VALUE of an option")->allow_extra_args(false);
  CLI11_PARSE(app, argc, argv);
  try {
    fmt::print("{}\n", bench::MoveBenchmark(arguments).run().dump(2));
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_moves: {}\n", error.what());
    return 1;
  }
}
