#include "apps/command.h"
#include "apps/model_options.h"
#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/film.h"
#include "render/misfit.h"
#include "render/shot_renderer.h"
#include "srf/image/exr.h"
#include "surfel/error.h"
#include "surfel/file.h"
#include "surfel/folder.h"
#include "surfel/hash.h"
#include "surfel/memory_use.h"
#include "surfel/replaceable.h"
#include "surfel/stopwatch.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <set>

namespace surflect {

namespace {

struct Arguments {
  std::string script, output, frames;
  ModelOptions model;
  double scale = 1;
  int every = 1;
  bool resume = false;
};

struct FrameRange {
  int first, last;
};

// "7" or "3-12", inside the script's frames.
FrameRange parseRange(const std::string& text, const Frames& frames) {
  if (text.empty()) return {frames.first, frames.last};
  const auto complain = [&] {
    return Error::mismatch(fmt::format("A or A-B within {}-{}", frames.first, frames.last), "'" + text + "'")
        .at("--frames");
  };
  const auto number = [&](std::string_view digits) {
    int value = 0;
    const auto [stop, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (status != std::errc() || stop != digits.data() + digits.size()) throw complain();
    return value;
  };
  const size_t dash = text.find('-');
  const FrameRange range{number(std::string_view(text).substr(0, dash)),
                         number(dash == std::string::npos ? text : std::string_view(text).substr(dash + 1))};
  if (range.first > range.last || range.first < frames.first || range.last > frames.last) throw complain();
  return range;
}

Json jsonOf(const FrameStats& stats) {
  Json seconds;
  for (const auto& [stage, time] : stats.seconds) seconds[stage] = time;
  Json json = jsonOf(stats.shading);
  json["surfels"] = {{"drawn", stats.splats.drawn},
                     {"visible", stats.visible},
                     {"unseen", stats.unseen},
                     {"dead", stats.splats.dead},
                     {"not_finite", stats.splats.notFinite},
                     {"back_facing", stats.splats.backFacing},
                     {"too_near", stats.splats.tooNear},
                     {"outside", stats.splats.outside}};
  json["seconds"] = seconds;
  return json;
}

Json jsonOf(const PreparedEnvironment& environment) {
  return {{"image", environment.image.string()},        {"texels", environment.texels},
          {"replaced_texels", environment.replaced},    {"lights", environment.lights.size()},
          {"tabulated", environment.table.has_value()}, {"seconds", environment.seconds}};
}

// What decides the pixels of a frame of this film.
std::string filmIdentity(const Script& script, const Model& model, const ShotRenderer& shot,
                         const Arguments& arguments) {
  const FrameOptions& frame = arguments.model.frame;
  const LightBlend blend = lightBlend(model, frame.shade);
  std::string environments;
  for (const PreparedEnvironment& environment : shot.environments())
    environments += " environment " + hex(environment.hash);
  return environments.insert(
      0,
      fmt::format(
          "surflect {} script {} model {} cameras {} lights {} {}{} pairs {} least-sigma {} simd {} scale {}",
          SURFLECT_VERSION, hex(script.hash), hex(model.identity), frame.shade.cameras, blend.lights,
          nameOf(blend.fit), blend.foreshortened ? " foreshortened" : "", frame.shade.pairs,
          frame.splats.lowPass, frame.splats.simd == Simd::scalar ? "scalar" : "vector", arguments.scale));
}

// Lens and pose as numbers: focal lengths and centre in pixels, then the rows of the matrix camera from
// object.
std::string describe(const Camera<ObjectSpace>& camera) {
  const Lens& lens = camera.lens;
  std::string text = fmt::format("focal {:.9g} {:.9g} center {:.9g} {:.9g} camera_from_object", lens.focalX,
                                 lens.focalY, lens.centerX, lens.centerY);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      text += fmt::format(" {:.9g}", camera.cameraFromWorld.rotation()(row, column));
    text += fmt::format(" {:.9g}", camera.cameraFromWorld.translation()[row]);
  }
  return text;
}

bool isRendered(const std::filesystem::path& path, const std::string& identity) {
  if (!std::filesystem::exists(path)) return false;
  try {
    return ExrFile(path).attribute("surflect.identity") == identity;
  } catch (const Error&) {
    return false;
  }
}

// What an earlier run of these frames left when it was killed.
void removeLitter(const Script& script, const Arguments& arguments) {
  std::map<std::filesystem::path, std::set<std::string>> targets; // by folder
  for (int frame = script.frames->first; frame <= script.frames->last; ++frame)
    for (const char* extension : {".exr", ".png"}) {
      const auto path = framePath(*script.output, arguments.output, frame).replace_extension(extension);
      targets[path.parent_path()].insert(path.filename().string());
    }
  for (const auto& [folder, names] : targets)
    removeAbandoned(folder, [&](const std::string& target) { return names.contains(target); });
}

Json runRender(const Arguments& arguments, const Progress& progress) {
  Script script = readScript(arguments.script);
  requireShot(script);
  const Model model = openModel(script.model, progress);
  if (script.coordinates == Coordinates::original) script = readScript(arguments.script, model.rig.origin);
  const FrameRange range = parseRange(arguments.frames, *script.frames);
  ShotRenderer shot(script, model, arguments.model.frame, arguments.model.cacheBytes(), progress);
  for (const PreparedEnvironment& environment : shot.environments())
    if (environment.replaced > 0)
      say(fmt::format("{}: {} texels with samples below 0 or not finite, which are taken for 0",
                      environment.image.string(), environment.replaced));
  createFolder(arguments.output);
  removeLitter(script, arguments);

  if (const auto misfit = unreached(script, shotTime(script, range.first), model.cloud)) say(*misfit);

  const std::string identity = filmIdentity(script, model, shot, arguments);
  Json report = {{"model", model.folder.string()},
                 {"surfels", model.cloud.size()},
                 {"environments", Json::array()},
                 {"frames", Json::array()}};
  for (const PreparedEnvironment& environment : shot.environments())
    report["environments"].push_back(jsonOf(environment));
  size_t kept = 0;
  bool saidEmpty = false;
  for (int frame = range.first; frame <= range.last; frame += arguments.every) {
    progress("render", static_cast<double>(frame - range.first) / (range.last - range.first + 1));
    const auto path = framePath(*script.output, arguments.output, frame);
    const auto preview = std::filesystem::path(path).replace_extension(".png");
    if (arguments.resume && isRendered(path, identity) &&
        (!script.output->png || std::filesystem::is_regular_file(preview))) {
      ++kept;
      continue;
    }
    requireReplaceable(path);
    if (script.output->png) requireReplaceable(preview);
    const Stopwatch watch;
    FrameStats stats;
    Film film = shot.render(frame, arguments.scale, stats);
    if (const auto misfit = emptied(stats, model.cloud.size()); misfit && !saidEmpty) {
      say(fmt::format("{}: frame {}: {}", arguments.script, frame, *misfit));
      saidEmpty = true;
    }
    const Stopwatch writeWatch;
    std::optional<double> exposure; // of a preview
    if (script.output->png) {
      std::filesystem::remove(preview); // which another script may have left, and resuming would keep
      exposure = shot.previewExposure();
    }
    tbb::parallel_invoke(
        [&] {
          if (exposure) writePreview(preview, film.color, *exposure);
        },
        [&] {
          writeFilm(path, film,
                    {{"surflect.version", SURFLECT_VERSION},
                     {"surflect.identity", identity},
                     {"surflect.script", hex(script.hash)},
                     {"surflect.camera", describe(shot.camera(frame, arguments.scale))},
                     {"surflect.frame", std::to_string(frame)}});
        });
    stats.seconds["write"] = writeWatch.seconds();
    shot.reuse(std::move(film.color));
    Json entry = jsonOf(stats);
    entry["frame"] = frame;
    entry["file"] = path.string();
    entry["total_seconds"] = watch.seconds();
    report["frames"].push_back(std::move(entry));
  }
  progress("render", 1);
  const MemoryUse memory = memoryUse();
  report["memory_peak_bytes"] = memory.peakBytes;
  report["memory_anonymous_bytes"] = memory.anonymousBytes;
  say(fmt::format("{}: {} frames rendered, {} were there already", arguments.output, report["frames"].size(),
                  kept));
  return report;
}

} // namespace

void addRenderCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("render", "render the frames of a script");
  command->footer("Example: surflect render examples/film.toml -o frames/ --frames 1-12 --scale 0.5");
  command->add_option("script", arguments->script, "TOML: model, camera, lights and warps over time")
      ->required();
  command->add_option("-o,--output", arguments->output, "folder for the frames")
      ->required()
      ->check(notEmpty());
  command->add_option("--frames", arguments->frames, "A or A-B; default: all");
  command->add_option("--every", arguments->every, "only each N-th of them")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  command->add_option("--scale", arguments->scale, "of width and height")
      ->capture_default_str()
      ->check(finiteIn(0.01, 8));
  command->add_flag("--resume", arguments->resume,
                    "keep frames that this script and model have rendered before");
  addModelOptions(*command, arguments->model);
  setWork(*command, work, "with --resume, the same command goes on from here",
          [arguments](const Progress& progress) { return runRender(*arguments, progress); });
}

} // namespace surflect
