#include "apps/command.h"
#include "apps/display_client.h"
#include "apps/film_files.h"
#include "apps/film_quality.h"
#include "apps/frame_range.h"
#include "apps/method_options.h"
#include "apps/open_shot.h"
#include "apps/terminal.h"
#include "render/evaluation/diagnostics.h"
#include "render/film/film_writer.h"
#include "render/film/frame_maps.h"
#include "render/film/shot_renderer.h"
#include "render/film/standard_attributes.h"
#include "render/film/video.h"
#include "surfel/base/error.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"
#include "surfel/math/simd.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <utility>

namespace surflect {

namespace {

struct RenderArguments {
  std::string script, model, output, frames; // script: or a model
  MethodOptions options;
  QualityOptions quality;
  double scale = 1;
  int every = 1;
  bool resume = false, noVideo = false;
  std::string display; // address of an image viewer; empty: none

  bool makesVideo(const scene::Output& written) const { return !written.video.empty() && !noVideo; }
};

Json frameJson(const method::FrameReport& frame) {
  Json json = {{"seconds", frame.seconds}};
  json.update(countsJson(frame.counts));
  return json;
}

Json environmentJson(const scene::Environment& environment, const method::EnvironmentReport& prepared) {
  return {{"image", environment.image.string()},
          {"texel_lights", environment.map->lights.size()},
          {"replaced_texels", environment.map->replaced},
          {"clamped_texels", environment.map->clamped},
          {"lights", prepared.lights},
          {"key_lights", prepared.keyLights},
          {"tabulated", prepared.tabulated},
          {"seconds", environment.seconds + prepared.seconds}};
}

// Returns one line for each kind of sample that was changed in an environment.
std::vector<std::string> remarksOn(const scene::Environment& environment) {
  const std::string image = environment.image.string();
  const weights::EnvironmentMap& map = *environment.map;
  std::vector<std::string> remarks;
  if (map.replaced > 0)
    remarks.push_back(fmt::format("{}: {} with samples below 0 or not a number, which are taken for 0", image,
                                  counted(map.replaced, "texel")));
  if (map.clamped > 0)
    remarks.push_back(fmt::format("{}: {} with infinite samples, which are taken for 65504, the largest "
                                  "half float",
                                  image, counted(map.clamped, "texel")));
  return remarks;
}

// Lens and pose as numbers: focal lengths and centre in pixels, then the rows of the matrix camera from
// object.
std::string describe(const capture::Camera<ObjectSpace>& camera) {
  const capture::Lens& lens = camera.lens;
  std::string text = fmt::format("focal {:.9g} {:.9g} center {:.9g} {:.9g} camera_from_object", lens.focalX,
                                 lens.focalY, lens.centerX, lens.centerY);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      text += fmt::format(" {:.9g}", camera.cameraFromWorld.rotation()(row, column));
    text += fmt::format(" {:.9g}", camera.cameraFromWorld.translation()[row]);
  }
  return text;
}

double sum(const Json& frames, const char* stage) {
  double total = 0;
  for (const Json& frame : frames) total += frame["seconds"].value(stage, 0.0);
  return total;
}

// Adds seconds to the report: writing per frame; sums over all frames of rendering, AOVs and writing, which
// partly overlaps with rendering the next frame; and the film's wall-clock time.
void addSeconds(Json& report, const std::vector<double>& writing, double film) {
  Json& frames = report["frames"];
  double rendering = 0;
  for (size_t i = 0; i < writing.size(); ++i) {
    const double seconds = frames[i]["total_seconds"].get<double>();
    rendering += seconds;
    frames[i]["seconds"]["write"] = writing[i];
    frames[i]["total_seconds"] = seconds + writing[i];
  }
  const double aov = sum(frames, "aov");
  report["seconds"] = {
      {"render", rendering - aov}, {"aov", aov}, {"write", sum(frames, "write")}, {"film", film}};
}

std::string summary(size_t rendered, size_t kept, double seconds, const std::filesystem::path& folder) {
  const std::string current =
      fmt::format("{} {} up to date", kept, kept == 1 ? "was" : "were"); // with --resume
  if (rendered == 0) return fmt::format("rendered no frames to {}: {}", (folder / "").string(), current);
  return fmt::format("rendered {} ({:.1f} per second) to {}{}", counted(rendered, "frame"),
                     static_cast<double>(rendered) / seconds, (folder / "").string(),
                     kept > 0 ? "; " + current : "");
}

// Says that the samples of a blurred frame show apart, if they do.
std::optional<std::string> stepsOf(const film::ShotRenderer& shot, int frame, double scale) {
  const int samples = shot.samples(frame);
  const film::ShotRenderer::BlurSteps steps = shot.blurSteps(frame, scale);
  if (samples >= steps.needed) return std::nullopt;
  std::vector<std::string> blurs;
  for (const auto& [name, pixels] : {std::pair{"motion", steps.motion}, {"defocus", steps.defocus}})
    if (pixels > 0) blurs.push_back(fmt::format("{} of up to {:.0f} pixels", name, pixels));
  return fmt::format("steps show: {} by {}; {} samples have none above {} pixels ([output] samples)",
                     fmt::join(blurs, " and "), counted(static_cast<size_t>(samples), "sample"), steps.needed,
                     film::ShotRenderer::kSeenStep);
}

// How much of a film is to be trusted, and its worst frame.
class FilmTrust {
public:
  // Does nothing without the AOV predicted_error.
  void add(int frame, const method::FrameLayers& layers) {
    const auto error = layers.aovs.find("predicted_error");
    if (error == layers.aovs.end()) return;
    const evaluation::Trust trust =
        evaluation::trustIn(layers.color, error->second, film::whiteOf(layers.color));
    film_ += trust;
    if (!worst_ || trust.share() < worst_->second.share()) worst_ = {frame, trust};
  }
  bool isKnown() const { return worst_.has_value(); }
  std::string sentence() const {
    return fmt::format(
        "predicted error: at most {:.0f}/255 of white in {:.0f} % of the object's pixels (fewest: frame "
        "{}, {:.0f} %); cameras and lights nearer to captured ones lower it",
        255 * evaluation::kTrustedError, 100 * film_.share(), worst_->first, 100 * worst_->second.share());
  }
  Json json() const {
    return {{"error_of_white", evaluation::kTrustedError},
            {"share", film_.share()},
            {"worst_frame", worst_->first},
            {"worst_share", worst_->second.share()}};
  }

private:
  evaluation::Trust film_;
  std::optional<std::pair<int, evaluation::Trust>> worst_;
};

// Returns whether `--threads 1` was given.
bool isAlone() {
  return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) == 1;
}

// What many objects or lights of a script cost, each in one line.
std::vector<std::string> costsOf(size_t objects, const std::vector<scene::LightMotion>& lights) {
  constexpr size_t kMany = 100;
  std::vector<std::string> costs;
  if (objects > kMany)
    costs.push_back(fmt::format("{} objects: opening them takes as long, and a frame as much memory, as one "
                                "model with the triangles of all",
                                objects));
  const auto lamps = static_cast<size_t>(std::ranges::count_if(lights, [](const scene::LightMotion& light) {
    return !std::holds_alternative<scene::EnvironmentLightMotion>(light);
  }));
  if (lamps > kMany)
    costs.push_back(fmt::format("{} lights: each is looked up at every visible surfel, so that the time of a "
                                "frame grows with their number; an environment map merges its lights",
                                lamps));
  return costs;
}

// A film's renderer and its script, which is checked before the model is opened where it can be.
struct OpenFilm {
  std::unique_ptr<method::Renderer> renderer;
  scene::Script script;
  FilmPlace place;
  std::filesystem::path video;             // empty: none
  std::set<std::filesystem::path> folders; // of frames and video
  std::unique_ptr<const film::Finish> finish;
};

// Throws Error if a video is wanted that cannot be encoded here.
void requireEncoder(const scene::Output& output, const RenderArguments& arguments) {
  if (!arguments.makesVideo(output) || film::canEncodeVideo()) return;
  throw Error(
      "needs ffmpeg, which is not installed (apt install ffmpeg); --no-video renders the frames alone")
      .at("output.video")
      .in(arguments.script);
}

OpenFilm opened(const RenderArguments& arguments, const Progress& progress) {
  OpenFilm film;
  size_t toldLights = 0;
  const auto check = [&](const scene::ScriptHead& head, const scene::Script& script) {
    for (const std::string& cost : costsOf(head.objects.size(), script.lights)) say(cost);
    toldLights = script.lights.size();
    film.place = {arguments.output, parseRange(arguments.frames, head.frames), arguments.every};
    if (arguments.makesVideo(head.output)) film.video = videoPath(head.output, head.frames, film.place);
    film.folders = writableFolders(head.output, film.place, film.video);
    requireEncoder(head.output, arguments);
    film.finish = std::make_unique<const film::Finish>(head.output, arguments.script);
  };
  const auto open = [&](const scene::ScriptHead& head) -> const method::Description& {
    const std::filesystem::path& model = head.objects.empty() ? head.model : head.objects.front().model;
    const method::Setting setting = arguments.options.settingFor(method::methodOfModel(model));
    film.renderer = head.objects.empty() ? method::openRenderer(model, setting, progress)
                                         : method::openScene(head.objects, setting, progress);
    return film.renderer->describe();
  };
  film.script = openShot({arguments.script, arguments.model}, check, open);
  if (toldLights == 0)
    for (const std::string& cost : costsOf(0, film.script.lights)) say(cost);
  return film;
}

// Throws Error for an AOV that the model's frames cannot have.
void requireAovs(const scene::Script& script, const method::Description& model) {
  for (const std::string& aov : script.output->aov)
    if (std::ranges::find(model.aovs, aov) == model.aovs.end())
      throw Error::mismatch(model.aovs.empty() ? fmt::format("none: frames of {} have none", model.method)
                                               : fmt::format("one of {}", fmt::join(model.aovs, ", ")),
                            '"' + aov + '"')
          .at("output.aov")
          .in(script.path);
}

// Exposure of the pictures for screens, in words.
std::string exposureSentence(double stops) {
  return fmt::format(
      "PNG and video are exposed by {0:+.3f} stops, so that the film's brightest part is white; "
      "[camera] exposure = {0:.3f} fixes it, in the EXR too",
      stops == 0 ? 0 : stops); // no -0
}

// A film while it is rendered, and what its frames have told.
class FilmRun {
public:
  // The arguments must outlive the object. `identity` is that of the film, without quality.
  FilmRun(const RenderArguments& arguments, const OpenFilm& film, FilmQuality& quality,
          const film::FrameMaps& maps, film::ShotRenderer& shot, std::string identity,
          const Progress& progress)
      : arguments_(arguments), film_(film), quality_(quality), maps_(maps), shot_(shot),
        identity_(std::move(identity)), progress_(progress) {
    const method::Description& model = film.renderer->describe();
    report_ = {{"model", model.folder.string()}, {"environments", Json::array()}, {"frames", Json::array()}};
    for (const auto& [name, count] : model.counts) report_[name] = count;
    for (size_t i = 0; i < shot.environments().size(); ++i)
      report_["environments"].push_back(
          environmentJson(shot.environments()[i], shot.environmentReports()[i]));
    if (std::ranges::find(output().maps, "height") != output().maps.end())
      report_["height"] = {{"black", -maps.heights().radius}, {"white", maps.heights().radius}};
    const capture::Lens lens = shot.camera(film.place.range.first, arguments.scale).lens;
    display_ = film.finish->optionsFor(lens.width, lens.height);
    if (!arguments.display.empty())
      viewer_.emplace(displayAddress(arguments.display), script().path.filename().string(),
                      [](const std::string& line) { say(line); });
    event("film", {{"first", film.place.range.first},
                   {"last", film.place.range.last},
                   {"every", arguments.every},
                   {"size", {lens.width, lens.height}}});
  }

  void render() {
    film::FilmWriter writer(isAlone() ? film::FilmWriter::Thread::callers : film::FilmWriter::Thread::own,
                            progress_);
    const std::vector<int> frames = film_.place.frames();
    try {
      for (size_t i = 0; i < frames.size(); ++i) {
        progress_("render", static_cast<double>(i) / static_cast<double>(frames.size()));
        if (!keep(frames[i])) render(frames[i], writer);
      }
    } catch (const Error&) {
      writer.finish(); // reports a failure of an earlier frame first
      throw;
    }
    const std::vector<double> writing = writer.finish();
    viewer_.reset(); // waits for the last frame to be shown
    addSeconds(report_, writing, watch_.seconds());
    quality_.report(report_);
    progress_("render", 1);
  }

  // Encodes the frames that are on disk.
  void encode() {
    if (film_.video.empty()) return;
    if (!isExposed_) expose();
    std::vector<std::filesystem::path> frames;
    for (const int frame : film_.place.frames()) frames.push_back(pathOf(frame));
    film::writeVideo(film_.video, frames, script().frames->fps / arguments_.every, display_, progress_);
    report_["video"] = film_.video.string();
    event("video", {{"file", film_.video.string()}});
  }

  // Says how the film came out. Returns its report.
  Json finished() {
    if (isExposed_ && !script().exposure) {
      const double stops = -std::log2(display_.white);
      report_["automatic_exposure_stops"] = stops;
      say(exposureSentence(stops));
    }
    const MemoryUse memory = memoryUse();
    report_["memory_peak_bytes"] = memory.peakBytes;
    report_["memory_anonymous_bytes"] = memory.anonymousBytes;
    if (trust_.isKnown()) {
      report_["trust"] = trust_.json();
      say(trust_.sentence());
    }
    const size_t rendered = report_["frames"].size();
    say(summary(rendered, kept_, watch_.seconds(), arguments_.output) + quality_.summary());
    if (!film_.video.empty())
      say(videoSentence());
    else if (const auto stale = staleVideo(); rendered > 0 && stale)
      say(stale->string() + ": of an earlier run, since --no-video leaves it as it is");
    return std::move(report_);
  }

private:
  const scene::Script& script() const { return film_.script; }
  const scene::Output& output() const { return *film_.script.output; }
  std::filesystem::path pathOf(int frame) const {
    return scene::framePath(output(), film_.place.folder, frame);
  }

  void expose() {
    quality_.setBase();
    display_.white = 1 / shot_.previewExposure();
    isExposed_ = true;
  }

  // A frame and its files, for an event.
  Json filesOf(int frame) const {
    const auto picture = pathOf(frame);
    Json files = {{"frame", frame}, {"file", picture.string()}};
    if (output().png) files["preview"] = previewPath(picture).string();
    for (const std::string& map : output().maps) files["maps"].push_back(mapPath(picture, map).string());
    return files;
  }

  // Whether the frame is there, and is to stay.
  bool keep(int frame) {
    const bool anySetting = arguments_.quality.budgetMs.has_value();
    if (!arguments_.resume ||
        !isRendered(pathOf(frame), output(), identity_ + quality_.identity(), anySetting))
      return false;
    ++kept_;
    Json kept = filesOf(frame);
    kept["kept"] = true;
    event("frame", kept);
    return true;
  }

  image::ExrAttributes attributesOf(int frame, const method::Setting& setting) const {
    const capture::Camera<ObjectSpace> camera = shot_.camera(frame, arguments_.scale);
    image::ExrAttributes attributes = film::frameAttributes(camera, script(), frame);
    attributes["surflect.identity"] = identity_ + quality_.identity(setting);
    attributes["surflect.script"] = hex(script().hash);
    attributes["surflect.camera"] = describe(camera);
    if (!setting.empty()) attributes["surflect.setting"] = method::textOf(setting);
    return attributes;
  }

  std::optional<double> exposureOf(int frame) const {
    return scene::exposureAt(script(), scene::shotTime(script(), frame));
  }

  void render(int frame, film::FilmWriter& writer) {
    film::FrameFiles files{.picture = pathOf(frame)};
    const control::Choice choice = quality_.choose(shot_, *script().frames, frame, arguments_.scale);
    files.attributes = attributesOf(frame, choice.setting);
    const Stopwatch watch;
    shot_.reuse(writer.spare());
    method::FrameLayers picture = shot_.render(frame, arguments_.scale, maps_.aovs(shot_, frame));
    if (viewer_) viewer_->show(film::overShadow(picture));
    if (picture.report.remark) sayOnce(saidEmpty_, frame, *picture.report.remark);
    if (const auto steps = saidSteps_ ? std::nullopt : stepsOf(shot_, frame, arguments_.scale))
      sayOnce(saidSteps_, frame, *steps);
    film::FrameMaps::Made maps = maps_.make(shot_, frame, arguments_.scale, picture);
    if (maps.beyond)
      sayOnce(
          saidHeights_, frame,
          fmt::format("the height map clips heights of up to {0:.4g}: it holds those of the object at rest, "
                      "-{1:.4g} to {1:.4g}",
                      *maps.beyond, maps_.heights().radius));
    for (size_t i = 0; i < maps.maps.size(); ++i)
      files.maps.push_back({mapPath(files.picture, output().maps[i]), std::move(maps.maps[i])});
    trust_.add(frame, picture);
    Json entry = frameJson(picture.report);
    entry["frame"] = frame;
    entry["file"] = files.picture.string();
    if (const auto stops = exposureOf(frame)) entry["exposure_stops"] = *stops;
    entry["total_seconds"] = watch.seconds();
    if (output().png) {
      files.preview = previewPath(files.picture);
      if (!isExposed_) expose();
      files.display = display_;
    }
    for (const film::MapFile& map : files.maps) entry["maps"].push_back(map.path.string());
    quality_.report(shot_, frame, arguments_.scale, choice, picture.color, entry);
    files.written = [all = filesOf(frame), rendering = watch.seconds()](double writing) {
      Json written = all;
      written["seconds"] = rendering + writing;
      event("frame", written);
    };
    report_["frames"].push_back(std::move(entry));
    writer.write(std::move(files), std::move(picture));
  }

  void sayOnce(bool& isSaid, int frame, const std::string& line) const {
    if (!std::exchange(isSaid, true)) say(fmt::format("{}: frame {}: {}", arguments_.script, frame, line));
  }

  std::string videoSentence() const {
    const bool isOverBlack = display_.isTransparent && film_.video.extension() == ".mp4";
    std::string sentence = film_.video.string() + ": the film";
    if (film_.place.isPart(*script().frames))
      sentence += fmt::format(" of {}", counted(film_.place.frames().size(), "frame"));
    if (isOverBlack)
      sentence += fmt::format(" over black{}, as an MP4 has no alpha; output.background is another, a .mov "
                              "keeps alpha",
                              script().ground ? ", on which the ground's shadow is not seen" : "");
    return sentence;
  }

  // A video that frames of this run are no longer in.
  std::optional<std::filesystem::path> staleVideo() const {
    if (output().video.empty()) return std::nullopt;
    std::filesystem::path path = videoPath(output(), *script().frames, film_.place);
    return std::filesystem::exists(path) ? std::optional(path) : std::nullopt;
  }

  const RenderArguments& arguments_;
  const OpenFilm& film_;
  FilmQuality& quality_;
  const film::FrameMaps& maps_;
  film::ShotRenderer& shot_;
  const std::string identity_;
  const Progress& progress_;
  const Stopwatch watch_;
  film::DisplayOptions display_;
  bool isExposed_ = false; // display_'s white is known
  std::optional<DisplayClient> viewer_;
  FilmTrust trust_;
  Json report_;
  size_t kept_ = 0;
  bool saidEmpty_ = false, saidSteps_ = false, saidHeights_ = false;
};

Json runRender(const RenderArguments& arguments, const Progress& progress) {
  const OpenFilm film = opened(arguments, progress);
  const scene::Script& script = film.script;
  const method::Description& model = film.renderer->describe();
  FilmQuality quality(arguments.quality, arguments.options.settingFor(method::methodOf(model.method)),
                      *film.renderer);
  scene::requireShot(script);
  requireAovs(script, model);
  const film::FrameMaps maps(script, model);
  film::ShotRenderer shot(script, *film.renderer, progress);
  for (const scene::Environment& environment : shot.environments())
    for (const std::string& remark : remarksOn(environment)) say(remark);
  for (const auto& folder : film.folders) createFolder(folder);
  removeLitter(script, film.place.folder);
  const warp::ShotTime first = scene::shotTime(script, film.place.range.first);
  if (const auto misfit = evaluation::misplacedRestMesh(script, first, model.points)) say(*misfit);
  FilmRun run(arguments, film, quality, maps, shot,
              filmIdentity(script, model, shot, *film.finish, arguments.scale), progress);
  run.render();
  run.encode();
  return run.finished();
}

} // namespace

void addRenderCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "render a film: the frames of a script, or a turn-table");
  command->footer("Example: surflect render examples/vase.toml -o frames/ --frames 1-12 --scale 0.5\n"
                  "         surflect render vase.srf -o frames/ --preset preview");
  command
      ->add_option("script", arguments->script,
                   "TOML: model, camera, lights and warps over time; or a model, which a camera goes round")
      ->required();
  command->add_option("-o,--output", arguments->output, "folder for the frames")
      ->required()
      ->check(notEmpty());
  command->add_option("--model", arguments->model, "another model than the script's")->check(notEmpty());
  command->add_option("--frames", arguments->frames, "a frame A, or frames A-B; default: all");
  command->add_option("--every", arguments->every, "render every N-th of these frames")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  command->add_option("--scale", arguments->scale, "factor on width and height")
      ->capture_default_str()
      ->check(finiteIn(0.01, 8));
  command->add_flag("--resume", arguments->resume,
                    "keep frames that this script and model have rendered before");
  command->add_flag("--no-video", arguments->noVideo, "frames alone, without the script's output.video");
  command
      ->add_option("--display", arguments->display,
                   "HOST:PORT of the image viewer tev, which shows frames while they are rendered; default "
                   "port: 14158")
      ->check([](const std::string& text) {
        try {
          displayAddress(text);
          return std::string();
        } catch (const Error& error) {
          return std::string(error.what());
        }
      });
  addQualityOptions(*command, arguments->quality);
  addSimd(*command);
  arguments->options.add(*command, MethodOptions::Kind::render, [arguments] {
    return methodAt(arguments->model.empty() ? arguments->script : arguments->model);
  });
  setWork(*command, work, "with --resume, the same command goes on from here",
          [arguments](const Progress& progress) { return runRender(*arguments, progress); });
}

} // namespace surflect
