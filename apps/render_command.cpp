#include "apps/command.h"
#include "apps/display_client.h"
#include "apps/film_quality.h"
#include "apps/frame_range.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "render/evaluation/diagnostics.h"
#include "render/film/film_writer.h"
#include "render/film/maps.h"
#include "render/film/shot_renderer.h"
#include "render/film/standard_attributes.h"
#include "render/film/video.h"
#include "render/scene/turntable.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"
#include "surfel/base/version.h"
#include "surfel/math/simd.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>

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

// Identity of everything that determines a film's pixels.
std::string filmIdentity(const scene::Script& script, const method::Description& model,
                         const film::ShotRenderer& shot, const film::Finish& finish, double scale) {
  std::string identity =
      fmt::format("surflect {} script {} {} scale {}", kVersion, hex(script.hash), model.identity, scale);
  for (const scene::Environment& environment : shot.environments())
    identity += " environment " + hex(environment.hash);
  return identity + finish.identity();
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

std::filesystem::path previewPath(std::filesystem::path picture) { return picture.replace_extension(".png"); }

// "frame.0001.normal.png" beside "frame.0001.exr"
std::filesystem::path mapPath(std::filesystem::path picture, const std::string& map) {
  return picture.replace_extension('.' + map + ".png");
}

// All files of a frame, its picture last.
std::vector<std::filesystem::path> frameFiles(const scene::Output& output,
                                              const std::filesystem::path& picture) {
  std::vector<std::filesystem::path> files;
  for (const std::string& map : output.maps) files.push_back(mapPath(picture, map));
  if (output.png) files.push_back(previewPath(picture));
  files.push_back(picture);
  return files;
}

// Whether a whole frame is there that was rendered so, with its preview and maps if they are asked for. Reads
// all pixels, since a file may have been cut short after its header. Under a budget of time any setting will
// do: the frame's identity begins with `identity` and ends with it.
bool isRendered(const std::filesystem::path& path, const scene::Output& output, const std::string& identity,
                bool anySetting) {
  if (!std::filesystem::exists(path)) return false;
  try {
    const image::ExrFile file(path);
    const auto found = file.attribute("surflect.identity");
    if (found != identity && !(anySetting && found && found->starts_with(identity))) return false;
    std::vector<image::ChannelSet> all;
    for (const std::string& channel : file.channels()) all.push_back({channel});
    file.read(all);
    std::vector<std::filesystem::path> others = frameFiles(output, path);
    others.pop_back();
    return std::ranges::all_of(others, [&](const std::filesystem::path& other) {
      const image::Image image = image::readPng(other).image;
      return image.width == file.width() && image.height == file.height();
    });
  } catch (const Error&) {
    return false;
  }
}

// Folders of the frames. Throws Error if a frame cannot be written: its folder cannot be created or written
// to, or its name is taken by something other than a file.
std::set<std::filesystem::path> writableFolders(const scene::Output& output, const RenderArguments& arguments,
                                                const FrameRange& range) {
  std::set<std::filesystem::path> folders;
  for (int frame = range.first; frame <= range.last; frame += arguments.every) {
    const auto path = scene::framePath(output, arguments.output, frame);
    folders.insert(path.parent_path());
    for (const auto& file : frameFiles(output, path)) requireReplaceable(file);
  }
  if (arguments.makesVideo(output)) {
    const auto path = std::filesystem::path(arguments.output) / output.video;
    folders.insert(path.parent_path());
    requireReplaceable(path);
  }
  for (const auto& folder : folders) requireCreatable(folder);
  return folders;
}

// Removes temporaries of these frames left by a killed run.
void removeLitter(const scene::Script& script, const RenderArguments& arguments) {
  std::map<std::filesystem::path, std::set<std::string>> targets; // by folder
  for (int frame = script.frames->first; frame <= script.frames->last; ++frame) {
    const auto path = scene::framePath(*script.output, arguments.output, frame);
    targets[path.parent_path()].insert(previewPath(path).filename().string());
    for (const auto& target : frameFiles(*script.output, path))
      targets[path.parent_path()].insert(target.filename().string());
  }
  if (!script.output->video.empty()) {
    const auto video = std::filesystem::path(arguments.output) / script.output->video;
    targets[video.parent_path()].insert(video.filename().string());
  }
  for (const auto& [folder, names] : targets)
    removeAbandoned(folder, [&](const std::string& target) { return names.contains(target); });
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
  FrameRange range;
  std::set<std::filesystem::path> folders; // of the frames
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

// The script of a model that is rendered without one.
scene::Script turntableOf(const std::filesystem::path& model, const method::Renderer& renderer) {
  const method::Description& described = renderer.describe();
  const std::string text = scene::turntableScript(
      {std::filesystem::absolute(model).string(), described.rig, described.points, described.isBaked});
  return scene::parseScript(text, model / "turntable.toml");
}

OpenFilm opened(const RenderArguments& arguments, const Progress& progress) {
  OpenFilm film;
  const auto open = [&](const scene::ScriptHead& head) {
    const std::filesystem::path& model = head.objects.empty() ? head.model : head.objects.front().model;
    const method::Setting setting = arguments.options.settingFor(method::methodOfModel(model));
    return head.objects.empty() ? method::openRenderer(model, setting, progress)
                                : method::openScene(head.objects, setting, progress);
  };
  if (std::filesystem::is_directory(arguments.script)) {
    if (!arguments.model.empty()) throw UsageError(Error("is for a script").at("--model"));
    film.renderer = open({.model = arguments.script});
    film.script = turntableOf(arguments.script, *film.renderer);
    film.range = parseRange(arguments.frames, *film.script.frames);
    film.folders = writableFolders(*film.script.output, arguments, film.range);
    film.finish = std::make_unique<const film::Finish>(*film.script.output, film.script.path);
    return film;
  }
  const scene::ScriptHead head = scene::readScriptHead(arguments.script, arguments.model);
  // Original coordinates need the model's origin. Any other script is checked before the model is opened.
  const bool isEarly = head.coordinates == scene::Coordinates::model;
  if (isEarly) film.script = scene::readScript(arguments.script);
  for (const std::string& cost : costsOf(head.objects.size(), film.script.lights)) say(cost);
  film.range = parseRange(arguments.frames, head.frames);
  film.folders = writableFolders(head.output, arguments, film.range);
  requireEncoder(head.output, arguments);
  film.finish = std::make_unique<const film::Finish>(head.output, arguments.script);
  film.renderer = open(head);
  if (!isEarly) {
    film.script = scene::readScript(arguments.script, film.renderer->describe().rig.origin);
    for (const std::string& cost : costsOf(0, film.script.lights)) say(cost);
  }
  film.script.model = head.model;
  film.script.objects = head.objects;
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

// Encodes frames that are on disk.
std::filesystem::path writeVideo(const scene::Script& script, const RenderArguments& arguments,
                                 const FrameRange& range, const film::DisplayOptions& display,
                                 const Progress& progress) {
  const std::filesystem::path file = std::filesystem::path(arguments.output) / script.output->video;
  std::unique_ptr<film::VideoWriter> video;
  for (int frame = range.first; frame <= range.last; frame += arguments.every) {
    progress("video", static_cast<double>(frame - range.first) / (range.last - range.first + 1));
    const method::FrameLayers picture =
        film::readFrame(scene::framePath(*script.output, arguments.output, frame));
    if (!video)
      video = std::make_unique<film::VideoWriter>(file, film::videoFormat(file, display.isTransparent),
                                                  picture.color.width, picture.color.height,
                                                  script.frames->fps / arguments.every);
    film::DisplayOptions shown = display;
    if (film::videoFormat(file, display.isTransparent) == film::VideoFormat::h264)
      shown.isTransparent = false;
    shown.bits = film::bitsOf(film::videoFormat(file, display.isTransparent));
    video->add(film::shownColor(picture, shown));
  }
  video->finish();
  progress("video", 1);
  return file;
}

// Throws Error for a map that frames of the model cannot give.
void requireMaps(const scene::Script& script, const method::Description& model) {
  for (const std::string& map : script.output->maps) {
    const auto refuse = [&](const std::string& why) {
      throw Error::mismatch("another map: " + why, '"' + map + '"').at("output.maps").in(script.path);
    };
    const std::string layer = map == "normal" ? "normal" : "depth";
    if (map == "albedo") {
      if (model.isBaked) refuse("a model of photographs under fixed light has no albedo");
    } else if (std::ranges::find(model.aovs, layer) == model.aovs.end()) {
      refuse(fmt::format("frames of {} have no {}", model.method, layer));
    }
  }
}

// Renders the layers that maps are made of, and makes the maps. They show the object sharp and without the
// ground's shadow: a frame with either has layers of its own for them.
class MapMaker {
public:
  MapMaker(const scene::Script& script, const method::Description& model)
      : asked_(script.output->aov), maps_(script.output->maps), hasGround_(script.ground), rendered_(asked_) {
    range_.middle = assume<Point3<ObjectSpace, double>>(model.middle.raw());
    double radius = 0;
    for (const auto& point : model.points)
      radius = std::max(radius, (point.raw().cast<double>() - model.middle.raw()).norm());
    range_.radius = std::max(radius, 1e-9);
    addLayer("normal", "normal");
    addLayer("height", "depth");
  }

  // Layers to render with the frame.
  const std::vector<std::string>& aovs(const film::ShotRenderer& shot, int frame) const {
    return showsObject(shot, frame) ? rendered_ : asked_;
  }

  // Leaves only those layers in the frame that are asked for.
  std::vector<film::MapFile> make(film::ShotRenderer& shot, int frame, double scale,
                                  const std::filesystem::path& picture, method::FrameLayers& layers) const {
    std::vector<film::MapFile> files;
    const auto add = [&](const method::FrameLayers& object) {
      for (const std::string& map : maps_)
        files.push_back({mapPath(picture, map), made(map, shot, frame, scale, object)});
    };
    if (maps_.empty()) return files;
    if (showsObject(shot, frame))
      add(layers);
    else
      add(shot.renderObject(frame, scale, rendered_));
    std::erase_if(layers.aovs,
                  [&](const auto& layer) { return std::ranges::find(asked_, layer.first) == asked_.end(); });
    return files;
  }

  void report(Json& report) const {
    if (std::ranges::find(maps_, "height") != maps_.end())
      report["height"] = {{"black", -range_.radius}, {"white", range_.radius}};
  }

private:
  // Whether the frame is of the object alone, and sharp.
  bool showsObject(const film::ShotRenderer& shot, int frame) const {
    return !hasGround_ && shot.samples(frame) == 1;
  }
  void addLayer(const char* map, const char* layer) {
    if (std::ranges::find(maps_, map) != maps_.end() &&
        std::ranges::find(rendered_, layer) == rendered_.end())
      rendered_.push_back(layer);
  }
  image::PngSamples made(const std::string& map, film::ShotRenderer& shot, int frame, double scale,
                         const method::FrameLayers& layers) const {
    if (map == "albedo") return film::albedoMap(shot.renderAlbedo(frame, scale).color);
    const capture::Camera<ObjectSpace> camera = shot.camera(frame, scale);
    return map == "normal" ? film::normalMap(layers.color, layers.aovs.at("normal"), camera)
                           : film::heightMap(layers.color, layers.aovs.at("depth"), range_, camera);
  }

  const std::vector<std::string> asked_, maps_;
  const bool hasGround_;
  std::vector<std::string> rendered_; // AOVs
  film::HeightRange range_;
};

Json runRender(const RenderArguments& arguments, const Progress& progress) {
  OpenFilm openFilm = opened(arguments, progress);
  const auto& [renderer, script, range, folders, finish] = openFilm;
  const method::Description& model = renderer->describe();
  FilmQuality quality(arguments.quality, arguments.options.settingFor(method::methodOf(model.method)),
                      *renderer);
  scene::requireShot(script);
  requireAovs(script, model);
  requireMaps(script, model);
  film::ShotRenderer shot(script, *renderer, progress);
  for (const scene::Environment& environment : shot.environments())
    for (const std::string& remark : remarksOn(environment)) say(remark);
  for (const auto& folder : folders) createFolder(folder);
  removeLitter(script, arguments);

  if (const auto misfit =
          evaluation::misplacedRestMesh(script, scene::shotTime(script, range.first), model.points))
    say(*misfit);

  const std::string filmsIdentity = filmIdentity(script, model, shot, *finish, arguments.scale);
  const std::string identity = filmsIdentity + quality.identity();
  Json report = {
      {"model", model.folder.string()}, {"environments", Json::array()}, {"frames", Json::array()}};
  for (const auto& [name, count] : model.counts) report[name] = count;
  for (size_t i = 0; i < shot.environments().size(); ++i)
    report["environments"].push_back(environmentJson(shot.environments()[i], shot.environmentReports()[i]));
  const capture::Lens lens = shot.camera(range.first, arguments.scale).lens;
  film::DisplayOptions display = finish->optionsFor(lens.width, lens.height);
  bool isExposed = false; // display's white is known
  const auto expose = [&] {
    quality.setBase();
    display.white = 1 / shot.previewExposure();
    isExposed = true;
  };
  size_t kept = 0;
  bool saidEmpty = false, saidSteps = false;
  FilmTrust trust;
  const MapMaker maps(script, model);
  maps.report(report);
  std::optional<DisplayClient> viewer;
  if (!arguments.display.empty())
    viewer.emplace(displayAddress(arguments.display), script.path.filename().string(),
                   [](const std::string& line) { say(line); });
  event("film", {{"first", range.first},
                 {"last", range.last},
                 {"every", arguments.every},
                 {"size", {lens.width, lens.height}}});
  const Stopwatch film;
  film::FilmWriter writer(isAlone() ? film::FilmWriter::Thread::callers : film::FilmWriter::Thread::own,
                          progress);
  try {
    for (int frame = range.first; frame <= range.last; frame += arguments.every) {
      progress("render", static_cast<double>(frame - range.first) / (range.last - range.first + 1));
      const auto path = scene::framePath(*script.output, arguments.output, frame);
      if (arguments.resume &&
          isRendered(path, *script.output, identity, arguments.quality.budgetMs.has_value())) {
        ++kept;
        event("frame", {{"frame", frame}, {"file", path.string()}, {"kept", true}});
        continue;
      }
      film::FrameFiles files{.picture = path};
      const control::Choice choice = quality.choose(shot, *script.frames, frame, arguments.scale);
      const capture::Camera<ObjectSpace> camera = shot.camera(frame, arguments.scale);
      files.attributes = film::frameAttributes(camera, script, frame);
      files.attributes.merge(
          image::ExrAttributes{{"surflect.identity", filmsIdentity + quality.identity(choice.setting)},
                               {"surflect.script", hex(script.hash)},
                               {"surflect.camera", describe(camera)}});
      const auto stops = scene::exposureAt(script, scene::shotTime(script, frame));
      if (!choice.setting.empty()) files.attributes["surflect.setting"] = method::textOf(choice.setting);
      const Stopwatch watch;
      shot.reuse(writer.spare());
      method::FrameLayers picture = shot.render(frame, arguments.scale, maps.aovs(shot, frame));
      if (viewer) viewer->show(film::overShadow(picture));
      if (picture.report.remark && !saidEmpty) {
        say(fmt::format("{}: frame {}: {}", arguments.script, frame, *picture.report.remark));
        saidEmpty = true;
      }
      if (!saidSteps) {
        const std::optional<std::string> steps = stepsOf(shot, frame, arguments.scale);
        if (steps) say(fmt::format("{}: frame {}: {}", arguments.script, frame, *steps));
        saidSteps = steps.has_value();
      }
      files.maps = maps.make(shot, frame, arguments.scale, path, picture);
      trust.add(frame, picture);
      Json entry = frameJson(picture.report);
      entry["frame"] = frame;
      entry["file"] = path.string();
      if (stops) entry["exposure_stops"] = *stops;
      entry["total_seconds"] = watch.seconds();
      if (script.output->png) {
        files.preview = previewPath(path);
        if (!isExposed) expose();
        files.display = display;
      }
      for (const film::MapFile& map : files.maps) entry["maps"].push_back(map.path.string());
      quality.report(shot, frame, arguments.scale, choice, picture.color, entry);
      files.written = [frame, path, rendering = watch.seconds()](double writing) {
        event("frame", {{"frame", frame}, {"file", path.string()}, {"seconds", rendering + writing}});
      };
      report["frames"].push_back(std::move(entry));
      writer.write(std::move(files), std::move(picture));
    }
  } catch (const Error&) {
    writer.finish(); // reports a failure of an earlier frame first
    throw;
  }
  const std::vector<double> writing = writer.finish();
  viewer.reset(); // waits for the last frame to be shown
  addSeconds(report, writing, film.seconds());
  quality.report(report);
  progress("render", 1);
  if (arguments.makesVideo(*script.output)) {
    if (!isExposed) expose();
    report["video"] = writeVideo(script, arguments, range, display, progress).string();
  }
  if (isExposed && !script.exposure) {
    const double stops = -std::log2(display.white);
    report["automatic_exposure_stops"] = stops;
    say(exposureSentence(stops));
  }
  const MemoryUse memory = memoryUse();
  report["memory_peak_bytes"] = memory.peakBytes;
  report["memory_anonymous_bytes"] = memory.anonymousBytes;
  if (trust.isKnown()) {
    report["trust"] = trust.json();
    say(trust.sentence());
  }
  say(summary(report["frames"].size(), kept, film.seconds(), arguments.output) + quality.summary());
  if (report.contains("video")) {
    const auto video = report["video"].get<std::string>();
    const bool isOverBlack = display.isTransparent && video.ends_with(".mp4");
    say(video + ": the film" +
        (isOverBlack ? fmt::format(" over black{}, as an MP4 has no alpha; output.background is another, a "
                                   ".mov keeps alpha",
                                   script.ground ? ", on which the ground's shadow is not seen" : "")
                     : ""));
  }
  return report;
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
