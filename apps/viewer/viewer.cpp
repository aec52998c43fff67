#include "apps/viewer/viewer.h"

#include "render/evaluation/evaluate.h"
#include "render/film/frame_file.h"
#include "render/film/standard_attributes.h"
#include "render/film/video.h"
#include "render/methods.h"
#include "render/scene/turntable.h"
#include "srf/image/resize.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"
#include "surfel/base/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

namespace surflect::viewer {

namespace {

using Clock = std::chrono::steady_clock;
constexpr double kPreviewSeconds = 0.05; // budget of renderers that choose their own detail
constexpr int kThumbnail = 96;           // pixels

double orOne(double white) { return white > 0 ? white : 1; }

Json vectorJson(const Vec3<double>& v) { return {v.x(), v.y(), v.z()}; }

// JSON text in ASCII, which headers need.
std::string dumped(const Json& json) { return json.dump(-1, ' ', true, Json::error_handler_t::replace); }

Answer failed(int status, const std::string& problem) { return {status, dumped({{"error", problem}})}; }

// The value that an EXR file holds of a number: rounded to a half float.
float asInFile(float value) {
  int exponent = 0;
  const float mantissa = std::frexp(value, &exponent); // 0.5..1
  const int bits = std::max(exponent, -13) - 11;       // of the last place of 11 bits
  return mantissa == 0 ? value : std::ldexp(std::nearbyint(std::ldexp(value, -bits)), bits);
}

// The setting of a picture while something moves: the preset `preview`, and even fewer surfels and queries.
// Pictures are small then, and shown enlarged.
method::Setting movingSetting(method::Setting given, std::span<const method::Option> rows) {
  for (const auto& [name, value] : {std::pair{"surfel_size", 1.4}, {"patch", 16.0}})
    if (std::ranges::find(rows, name, &method::Option::name) != rows.end()) given.try_emplace(name, value);
  return method::withPreset(std::move(given), method::Preset::preview, rows);
}

// A path as one word of a shell's command.
std::string shellWord(const std::string& path) {
  const bool isPlain = std::ranges::all_of(
      path, [](unsigned char c) { return std::isalnum(c) || std::strchr("/._-+,:@%", c); });
  if (isPlain) return path;
  std::string word = "'";
  for (const char c : path) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

// Throws Error for a film larger than pages may ask for.
void requireModestSize(const scene::Script& script) {
  const scene::Output& output = *script.output;
  if (int64_t{output.width} * output.height > kMostPixels)
    throw Error::mismatch(fmt::format("at most {} pixels; render makes larger ones", kMostPixels),
                          sizeText(output.width, output.height))
        .at("output.size");
}

// The captured camera through which the script looks. Throws Malformed if it is another.
std::string cameraOf(const FrameRequest& request) {
  const Json camera = request.values.value("camera", Json());
  if (!camera.is_object() || !camera.contains("from") || !camera["from"].is_string())
    throw Malformed(Error("a photograph needs a captured camera: camera.from").at("doc.camera"));
  return camera["from"].get<std::string>();
}

// The header X-Picture of a finished picture.
std::string pictureText(const FrameRequest& request, double renderSeconds, double encodeSeconds, double white,
                        const Json& more = Json::object()) {
  Json picture = {{"number", request.number},
                  {"renderSeconds", renderSeconds},
                  {"encodeSeconds", encodeSeconds},
                  {"white", white},
                  {"quality", request.isPreview ? "preview" : "full"},
                  {"remark", nullptr},
                  {"decibels", nullptr}};
  picture.update(more);
  return dumped(picture);
}

// A setting whose frames take over stages of the last one, where the method can.
method::Setting withReuse(method::Setting setting, const std::filesystem::path& model) {
  if (std::ranges::count(method::methodOfModel(model).renderOptions, "reuse", &method::Option::name) > 0)
    setting.emplace("reuse", method::kOn);
  return setting;
}

} // namespace

Viewer::Viewer(ViewerInput input, const Progress& progress)
    : input_(std::move(input)), list_(openStartList(input_, progress)) {
  std::vector<session::Session::Open> openers;
  for (const std::filesystem::path& model : input_.models)
    openers.emplace_back([model, setting = withReuse(input_.setting, model)](const Progress& opening) {
      return method::openRenderer(model, setting, opening);
    });
  session_ = std::make_unique<session::Session>(std::move(openers), untilTheEnd());
}

Progress Viewer::untilTheEnd() {
  return {[this](std::string_view stage, double fraction) { events_.progress(stage, fraction); },
          [this] { return isEnding_.load(); }};
}

Viewer::~Viewer() { end(); }

void Viewer::end() {
  isEnding_ = true;
  events_.end();
}

// --- Tabs and events

void Viewer::tidy() {
  for (const size_t model : tabs_.unwatched(input_.models.size())) session_->close(model);
  const std::lock_guard lock(mutex_);
  if (!recordingTab_.empty() && !tabs_.isOpen(recordingTab_)) isStopped_ = true;
}

Answer Viewer::events(const std::string& tab, uint64_t after) {
  if (!tabs_.admit(tab)) return failed(429, fmt::format("at most {} pages at a time", kMostTabs));
  Json events = events_.after(after, std::chrono::seconds(20));
  tabs_.admit(tab); // it has been there all the while
  return {200, dumped(events)};
}

Answer Viewer::answer(const std::string& tab, const std::string& route, const std::string& body) {
  if (!tabs_.admit(tab)) return failed(429, fmt::format("at most {} pages at a time", kMostTabs));
  try {
    if (route == "/start") return {200, dumped(start())};
    const Json json = parsedBody(body);
    if (json.contains("model")) tabs_.look(tab, modelAt(json));
    if (route == "/frame") return frame(tab, frameRequest(json, list_.models.size()));
    if (route == "/probe") return {200, dumped(probe(tab, json))};
    if (route == "/thumbnail") return thumbnail(json);
    if (route == "/snapshot") return {200, dumped(snapshot(tab, frameRequest(json, list_.models.size())))};
    if (route == "/record") return {200, dumped(record(tab, json))};
    if (route == "/stop") {
      const std::lock_guard lock(mutex_);
      if (recordingTab_ == tab) isStopped_ = true;
      return {200, "{}"};
    }
    if (route == "/leave") {
      tabs_.leave(tab);
      tidy();
      return {200, "{}"};
    }
    if (route == "/values") {
      const size_t model = json.contains("model") ? modelAt(json) : 0;
      return {200, dumped(valuesOf(json.value("doc", Json()), model,
                                   wholeAt(json, "frame", -1'000'000, 2'000'000)))};
    }
    if (route == "/text") return {200, dumped({{"text", list_.document->edited(json.value("doc", Json()))}})};
    if (route == "/save") return save(json);
    return failed(404, "no such request");
  } catch (const Malformed& error) {
    return failed(400, error.what());
  } catch (const session::Superseded& error) {
    return failed(409, error.what());
  } catch (const Cancelled&) {
    return failed(isEnding_ ? 503 : 409, isEnding_ ? "the viewer ends" : "stopped");
  } catch (const Error& error) {
    return failed(422, error.what());
  } catch (const std::bad_alloc&) {
    return failed(500, "out of memory");
  } catch (const std::exception& error) {
    return failed(500, error.what());
  }
}

// --- The page's start

Json Viewer::start() const {
  Json models = Json::array(), environments = Json::array();
  for (const auto& model : list_.models) models.push_back(model->json);
  for (const auto& [name, image] : list_.environments)
    environments.push_back({{"name", name}, {"image", image}});
  return {
      {"version", kVersion},
      {"snapshots", input_.snapshots.string()},
      {"canRecord", film::canEncodeVideo()},
      {"isScript", !input_.script.empty()},
      {"scriptPath", list_.document->path().string()},
      {"doc", list_.document->values()},
      {"saves", list_.document->saves()},
      {"text", list_.document->text()},
      {"environments", environments},
      {"models", models},
      {"limits",
       {{"lights", kMostLights}, {"handles", kMostHandles}, {"side", kLargestSide}, {"tabs", kMostTabs}}}};
}

size_t Viewer::modelAt(const Json& body) const {
  return static_cast<size_t>(wholeAt(body, "model", 0, static_cast<int>(list_.models.size()) - 1));
}

void Viewer::requireModel(size_t model) const {
  if (list_.models[model]->method == "capture")
    throw Malformed(Error("is a capture, of which photographs alone can be shown").at("model"));
}

// Options of the command line, and those that the page has changed.
method::Setting Viewer::settingOf(const FrameRequest& request, const DescribedModel& model) const {
  method::Setting setting;
  for (const method::Option& option : model.options)
    if (const auto chosen = input_.setting.find(option.name); chosen != input_.setting.end())
      setting.insert(*chosen);
  const method::Options known{model.method, model.options};
  for (auto& [name, value] : viewer::settingOf(request.options, known)) setting[name] = value;
  method::requireSetting(known, setting);
  return setting;
}

Photographs& Viewer::photographs(size_t model) const {
  if (!list_.photographs[model])
    throw Malformed(
        Error("no photographs of this model are known: --capture names those of its own rig").at("show"));
  return *list_.photographs[model];
}

// --- Pictures

DisplayOptions Viewer::displayOf(const FrameRequest& request, const std::string& text,
                                 const image::Image& color) {
  const auto script = list_.document->script(text);
  const scene::Finish& given = script->output->finish;
  DisplayOptions display = request.display;
  display.white = request.white.value_or(orOne(film::whiteOf(color)));
  if (script->exposure) display.exposureStops = 0, display.white = 1; // the colours are exposed already
  if (given == scene::Finish()) return display;
  std::shared_ptr<const film::Finish> finish;
  {
    const std::lock_guard lock(finishing_);
    if (!finish_ || finish_->given() != given || !finish_->isCurrent())
      finish_ = std::make_shared<const film::Finish>(*script->output, script->path);
    finish = finish_;
  }
  const DisplayOptions scripted = finish->optionsFor(color.width, color.height);
  if (given.tone != Tone::none) display.tone = given.tone, display.ocio = scripted.ocio;
  if (scripted.isTransparent) return display;
  display.background = scripted.background, display.backdrop = scripted.backdrop;
  return display;
}

void Viewer::withShot(const std::string& client, const FrameRequest& request, const std::string& text,
                      bool isOwnSize, const std::function<void(film::ShotRenderer&)>& work) {
  requireModel(request.model);
  const DescribedModel& model = *list_.models[request.model];
  scene::Script script = *list_.document->script(text);
  if (!isOwnSize) {
    script.output->width = request.width;
    script.output->height = request.height;
  }
  const method::Setting given = settingOf(request, model);
  const method::Setting setting = request.isPreview ? movingSetting(given, model.options) : given;
  session_->run(client, request.model, request.isPreview ? session::Urgency::preview : session::Urgency::full,
                [&](method::Renderer& renderer, const Progress& progress) {
                  renderer.set(setting);
                  const bool mayChoose = request.isPreview && !given.contains("level");
                  renderer.keepBudget(mayChoose ? std::optional(kPreviewSeconds) : std::nullopt);
                  film::ShotRenderer shot(script, renderer, environments_.read(script, progress), progress,
                                          model.heldOut);
                  work(shot);
                });
}

Viewer::Rendered Viewer::render(const std::string& client, const FrameRequest& request,
                                const std::string& text, const std::vector<std::string>& aovs, bool isOwnSize,
                                Part part) {
  for (const std::string& aov : aovs)
    if (std::ranges::find(list_.models[request.model]->aovs, aov) == list_.models[request.model]->aovs.end())
      throw Error::mismatch("one that the model has", '"' + aov + '"').at("aov");
  Rendered rendered;
  withShot(client, request, text, isOwnSize, [&](film::ShotRenderer& shot) {
    const Stopwatch drawing;
    const bool isSharp = request.isPreview && !isOwnSize; // snapshots and films are whole
    rendered.layers = part == Part::object ? shot.renderObject(request.frame, 1, aovs)
                      : isSharp            ? shot.renderSharp(request.frame, 1, aovs)
                                           : shot.render(request.frame, 1, aovs);
    rendered.camera = shot.camera(request.frame, 1);
    rendered.seconds = drawing.seconds();
  });
  return rendered;
}

void Viewer::exposeAsShot(const FrameRequest& request, DisplayOptions& display) const {
  const Json camera = request.values.value("camera", Json());
  if (!camera.is_object() || !camera.contains("exposure")) return;
  const auto script = list_.document->script(list_.document->edited(request.values));
  const auto stops = scene::exposureAt(*script, scene::shotTime(*script, request.frame));
  if (stops) display.exposureStops = *stops, display.white = 1;
}

Answer Viewer::frame(const std::string& tab, const FrameRequest& request) {
  if (request.show == "photograph") return photograph(request);
  if (request.show == "match" || request.show == "error") return comparison(tab, request);
  const bool isColor = request.show == "color";
  const std::string text = list_.document->edited(request.values);
  const Rendered rendered =
      render(tab, request, text, isColor ? std::vector<std::string>{} : std::vector{request.show}, false);
  const Stopwatch encoding;
  const method::FrameLayers& layers = rendered.layers;
  const DisplayOptions display = displayOf(request, text, layers.color);
  const DescribedModel& model = *list_.models[request.model];
  const DisplayPicture shown = isColor ? shownColor(layers, display)
                                       : shownAov(layers, request.show, model.middle, model.radius, display);
  Answer answer{200, jpegBytes(shown, request.isPreview ? JpegQuality::moving : JpegQuality::still),
                "image/jpeg"};
  Json more = {{"remark", layers.report.remark ? Json(*layers.report.remark) : Json()}};
  for (const auto& [count, name] :
       {std::pair{"level", "level"}, {"images_read", "imagesRead"}, {"images_uploaded", "imagesUploaded"}})
    if (const auto found = layers.report.counts.find(count); found != layers.report.counts.end())
      more[name] = found->second;
  answer.picture = pictureText(request, rendered.seconds, encoding.seconds(), display.white, more);
  return answer;
}

Answer Viewer::photograph(const FrameRequest& request) {
  Photographs& all = photographs(request.model);
  const size_t frame = all.find(cameraOf(request), request.light);
  const Stopwatch reading;
  const Progress progress = untilTheEnd();
  DisplayOptions display = request.display;
  display.white = request.white.value_or(all.whiteOf(frame, progress));
  exposeAsShot(request, display);
  DisplayPicture shown;
  if (request.hasOverlay) {
    const image::Image outlined = all.outlined(frame, {request.width, request.height},
                                               std::exp2(display.exposureStops) / display.white, progress);
    shown = {outlined.width, outlined.height, std::vector<uint8_t>(outlined.values.size()), 3};
    std::ranges::transform(outlined.values, shown.bytes.begin(), [](float srgb) {
      return static_cast<uint8_t>(std::lround(255 * std::clamp(srgb, 0.f, 1.f)));
    });
  } else {
    const auto picture = all.read(frame, progress);
    shown = shownColor(
        image::resampled(*picture, {0, 0, picture->width, picture->height}, request.width, request.height),
        display);
  }
  Answer answer{200, jpegBytes(shown, JpegQuality::still), "image/jpeg"};
  answer.picture = pictureText(request, reading.seconds(), 0, display.white, {{"quality", "full"}});
  return answer;
}

// The model under a photograph's own camera and light, or its difference from the photograph; scored as
// `evaluate` does.
Answer Viewer::comparison(const std::string& tab, const FrameRequest& request) {
  requireModel(request.model);
  Photographs& all = photographs(request.model);
  const Progress progress = untilTheEnd();
  const Photographs::Truth truth = all.truth(all.find(cameraOf(request), request.light), progress);
  const DescribedModel& model = *list_.models[request.model];
  const method::Setting setting = settingOf(request, model);
  const warp::WarpPointer atRest = warp::chainWarp({});
  method::FrameLayers layers;
  const Stopwatch watch;
  session_->run(tab, request.model, session::Urgency::full,
                [&](method::Renderer& renderer, const Progress& working) {
                  renderer.set(setting);
                  renderer.keepBudget(std::nullopt);
                  layers = renderer.render({*atRest, truth.camera, truth.lights}, {}, working);
                });
  const double seconds = watch.seconds();
  const evaluation::Difference difference = evaluation::compare(truth.picture, layers.color, truth.exposure);
  DisplayOptions display = request.display;
  display.white = request.white.value_or(1 / truth.exposure);
  exposeAsShot(request, display);
  const auto sized = [&](const image::Image& image) {
    return image::resampled(image, {0, 0, image.width, image.height}, request.width, request.height);
  };
  const image::Image rendered = sized(layers.color);
  const DisplayPicture shown = request.show == "match" ? shownColor(rendered, display)
                                                       : shownError(sized(truth.picture), rendered, display);
  Answer answer{200, jpegBytes(shown, JpegQuality::still), "image/jpeg"};
  const Json decibels = {
      {"linear", difference.psnrLinear()}, {"srgb", difference.psnrSrgb()}, {"ssim", difference.ssim()}};
  answer.picture =
      pictureText(request, seconds, 0, display.white, {{"quality", "full"}, {"decibels", decibels}});
  return answer;
}

// --- A pixel

Json Viewer::probe(const std::string& tab, const Json& body) {
  FrameRequest request = frameRequest(body, list_.models.size());
  requireModel(request.model);
  request.isPreview = false;
  const capture::Pixel pixel{numberAt(body, "x", 0, request.width), numberAt(body, "y", 0, request.height)};
  const DescribedModel& model = *list_.models[request.model];
  const std::string text = list_.document->edited(request.values);
  const std::string state =
      dumped({text, request.model, request.frame, request.width, request.height, request.options});
  std::shared_ptr<const Probed> probed;
  {
    const std::lock_guard lock(mutex_);
    probed = probed_;
  }
  if (!probed || probed->state != state) {
    std::vector<std::string> aovs;
    for (const char* const aov : {"depth", "normal", "rest", "position"})
      if (std::ranges::find(model.aovs, aov) != model.aovs.end()) aovs.push_back(aov);
    probed =
        std::make_shared<const Probed>(Probed{state, render(tab, request, text, aovs, false, Part::object)});
    const std::lock_guard lock(mutex_);
    probed_ = probed;
  }
  const method::FrameLayers& layers = probed->rendered.layers;
  const int x = std::min(static_cast<int>(pixel.x), request.width - 1),
            y = std::min(static_cast<int>(pixel.y), request.height - 1);
  const auto color = layers.color.at(x, y);
  const float alpha = color[3];
  Json answer = {{"color", Json::array()}, {"aovs", Json::object()}, {"photographs", Json::array()}};
  for (size_t c = 0; c < 4; ++c)
    answer["color"].push_back(asInFile(c < 3 ? std::max(color[c], 0.f) : color[c]));
  for (const auto& [name, image] : layers.aovs) {
    const auto values = image.at(x, y);
    if (!(alpha > 0)) {
      answer["aovs"][name] = nullptr;
    } else if (values.size() == 1) {
      answer["aovs"][name] = std::isfinite(values[0]) ? Json(values[0]) : Json();
    } else {
      answer["aovs"][name] = {values[0] / alpha, values[1] / alpha, values[2] / alpha};
    }
  }
  if (!(alpha > 0)) return answer;
  if (body.contains("before") && answer["aovs"].contains("rest")) {
    const auto script = list_.document->script(text);
    const size_t before =
        static_cast<size_t>(wholeAt(body, "before", 0, static_cast<int>(script->warps.size())));
    const Json& rest = answer["aovs"]["rest"];
    const Vec3<double> place(rest[0], rest[1], rest[2]);
    const auto afterWarps = [&](size_t count) {
      scene::Script first = *script;
      first.warps.resize(std::min(count, first.warps.size()));
      return vectorJson(scene::warpAt(first, scene::shotTime(first, request.frame))->position(place));
    };
    answer["before"] = afterWarps(before);
    answer["after"] = afterWarps(before + 1);
  }
  method::PhotographBlend blend;
  withShot(tab, request, text, false,
           [&](film::ShotRenderer& shot) { blend = shot.blendedAt(request.frame, 1, pixel); });
  for (const method::BlendedPhotograph& each : blend.photographs)
    answer["photographs"].push_back({{"camera", each.view},
                                     {"light", each.light},
                                     {"weight", each.weight},
                                     {"x", each.place.x},
                                     {"y", each.place.y}});
  answer["tables"] = blend.tables;
  return answer;
}

Answer Viewer::thumbnail(const Json& body) {
  Photographs& all = photographs(modelAt(body));
  const Progress progress = untilTheEnd();
  const size_t frame = all.find(textAt(body, "camera"), textAt(body, "light"));
  const auto picture = all.read(frame, progress);
  const int side = std::min({kThumbnail, picture->width, picture->height});
  const auto begin = [&](const char* key, int size) {
    const double middle = numberAt(body, key, -1e6, 1e6);
    return std::clamp(static_cast<int>(std::floor(middle)) - side / 2, 0, size - side);
  };
  const int x = begin("x", picture->width), y = begin("y", picture->height);
  DisplayOptions display;
  const bool isKnown = body.contains("white") && !body["white"].is_null();
  display.white = isKnown ? numberAt(body, "white", 1e-12, 1e12) : all.whiteOf(frame, progress);
  const image::Image part = image::resampled(*picture, {x, y, x + side, y + side}, kThumbnail, kThumbnail);
  return {200, jpegBytes(shownColor(part, display), JpegQuality::still), "image/jpeg"};
}

Json Viewer::valuesOf(const Json& values, size_t number, int frame) const {
  const DescribedModel& model = *list_.models[number];
  const auto script = list_.document->script(list_.document->edited(values));
  const warp::ShotTime time = scene::shotTime(*script, frame);
  Json at = valuesAt(values, time);
  capture::Camera<ObjectSpace> camera;
  if (const auto* named = std::get_if<scene::NamedCamera>(&*script->camera)) {
    std::vector<capture::View> views = model.rig.views;
    views.insert(views.end(), model.heldOut.begin(), model.heldOut.end());
    const auto view = std::ranges::find(views, named->from, &capture::View::identity);
    if (view == views.end())
      throw Error::mismatch("a camera of the model", '"' + named->from + '"').at("camera.from");
    camera = scene::inObjectSpace(view->camera);
  } else {
    camera = scene::cameraAt(*script, time);
  }
  const Mat3<double> rotation = camera.cameraFromWorld.rotation();
  const Vec3<double> forward = -rotation.row(2).transpose(), position = camera.center().raw();
  const double distance = std::max(forward.dot(model.middle.raw() - position), 0.1 * model.radius);
  const Vec3<double> lookAt = position + distance * forward;
  const double tangent = 0.5 * camera.lens.height / camera.lens.focalY;
  return {{"camera",
           {{"position", vectorJson(position)},
            {"look_at", vectorJson(lookAt)},
            {"forward", vectorJson(forward)},
            {"up", vectorJson(rotation.row(1).transpose())},
            {"fov_deg", 2 * Angle::fromRadians(std::atan(tangent)).degrees()}}},
          {"light", at.value("light", Json::array())},
          {"warp", at.value("warp", Json::array())}};
}

// --- Files

Json Viewer::withKnownCamera(const FrameRequest& request) const {
  Json values = request.values;
  const DescribedModel& model = *list_.models[request.model];
  const Json camera = values.value("camera", Json());
  if (!camera.is_object() || !camera.contains("from")) return values;
  const auto isNamed = [&](const capture::View& view) { return camera["from"] == view.identity; };
  if (std::ranges::none_of(model.heldOut, isNamed)) return values;
  values["camera"] = valuesOf(values, request.model, request.frame)["camera"];
  values["camera"].erase("forward");
  if (camera.contains("exposure")) values["camera"]["exposure"] = camera["exposure"];
  return values;
}

Answer Viewer::save(const Json& body) {
  const Json values = body.value("doc", Json());
  const size_t saves = list_.document->saves();
  if (body.contains("saves") && body["saves"] != saves) {
    const std::string problem = "another page has saved the script since; saving again overwrites its edits";
    return {422, dumped({{"error", problem}, {"saves", saves}})};
  }
  if (values.is_object() && values.contains("camera") && values["camera"].is_object() &&
      values["camera"].contains("from")) {
    const Json& from = values["camera"]["from"];
    for (const auto& model : list_.models)
      for (const capture::View& view : model->heldOut)
        if (from == view.identity)
          throw Error::mismatch("a camera of the model: a held-out one is known to the capture alone",
                                from.dump())
              .at("camera.from");
  }
  const size_t changed = list_.document->save(values);
  return {200, dumped({{"path", list_.document->path().string()},
                       {"changed", changed},
                       {"saves", list_.document->saves()}})};
}

// "vase" of vase.srf.
std::string Viewer::stemOf(size_t model) const {
  return std::filesystem::path(list_.models[model]->name).stem().string();
}

std::filesystem::path Viewer::freeName(const std::string& stem) {
  createFolder(input_.snapshots);
  for (int number = 1; number < 10'000; ++number) {
    const std::filesystem::path path = input_.snapshots / fmt::format("{}_{:04}", stem, number);
    const auto isFree = [&](const char* extension) {
      return !std::filesystem::exists(path.string() + extension);
    };
    if (isFree(".exr") && isFree(".png") && isFree(".toml") && isFree(".mp4")) return path;
  }
  throw Error("holds 9999 snapshots of this model").in(input_.snapshots);
}

Json Viewer::snapshot(const std::string& tab, const FrameRequest& asked) {
  FrameRequest request = asked;
  request.isPreview = false;
  requireModel(request.model);
  const DescribedModel& model = *list_.models[request.model];
  Json values = withKnownCamera(request);
  std::vector<std::string> aovs;
  for (const std::string& aov : list_.document->script(list_.document->edited(request.values))->output->aov)
    if (std::ranges::find(model.aovs, aov) != model.aovs.end()) aovs.push_back(aov);
  if (std::ranges::find(model.aovs, request.show) != model.aovs.end() &&
      std::ranges::find(aovs, request.show) == aovs.end())
    aovs.push_back(request.show);
  if (values.contains("output") && values["output"].is_object()) values["output"]["aov"] = aovs;
  const std::string text = list_.document->movable(values, input_.models[request.model]);
  requireModestSize(*list_.document->script(text));
  const Rendered rendered = render(tab + " snapshot", request, text, aovs, true);
  const std::lock_guard lock(naming_);
  const std::string path = freeName(fmt::format("{}_frame{}", stemOf(request.model), request.frame)).string();
  DisplayOptions display = displayOf(request, text, rendered.layers.color);
  const auto script = list_.document->script(text);
  display.isTransparent = std::holds_alternative<std::monostate>(script->output->finish.background);
  writeFileAtomically(path + ".png", film::pngBytes(shownColor(rendered.layers, display)));
  film::writeFrame(path + ".exr", rendered.layers,
                   film::frameAttributes(rendered.camera, *script, request.frame));
  writeFileAtomically(path + ".toml", std::string_view(text));
  std::string command =
      fmt::format("surflect render {} -o frames/ --frames {}", shellWord(path + ".toml"), request.frame);
  for (const auto& [name, value] : settingOf(request, model))
    command += ' ' + method::flagOf(name) + ' ' + value.text();
  return {{"files", {path + ".exr", path + ".png", path + ".toml"}}, {"command", command}};
}

Json Viewer::record(const std::string& tab, const Json& body) {
  FrameRequest request = frameRequest(body, list_.models.size());
  request.isPreview = false;
  requireModel(request.model);
  if (!film::canEncodeVideo()) throw Error("ffmpeg is not installed");
  const int first = wholeAt(body, "first", -1'000'000, 2'000'000);
  const int last = wholeAt(body, "last", first, first + 100'000);
  const std::string text = list_.document->movable(withKnownCamera(request), input_.models[request.model]);
  const auto script = list_.document->script(text);
  requireModestSize(*script);
  {
    const std::lock_guard lock(mutex_);
    if (!recordingTab_.empty()) throw Error("a film is being recorded already");
    recordingTab_ = tab;
    isStopped_ = false;
  }
  const auto hasStopped = [&] {
    const std::lock_guard lock(mutex_);
    return isStopped_ || isEnding_;
  };
  const std::shared_ptr<void> ended(nullptr, [this](void*) {
    const std::lock_guard lock(mutex_);
    recordingTab_.clear();
  });
  std::unique_lock naming(naming_);
  const std::filesystem::path file = freeName(stemOf(request.model) + "_film").string() + ".mp4";
  film::VideoWriter film(file, film::VideoFormat::h264, script->output->width, script->output->height,
                         script->frames->fps);
  naming.unlock();
  const Stopwatch watch;
  std::optional<double> white = request.white; // of the first frame, so that the film does not pump
  int done = 0;
  for (int frame = first; frame <= last && !hasStopped(); ++frame) {
    request.frame = frame;
    const Rendered rendered = render(tab + " film", request, text, {}, true);
    if (!white) white = orOne(film::whiteOf(rendered.layers.color));
    request.white = white;
    film.add(shownColor(rendered.layers, displayOf(request, text, rendered.layers.color)));
    const double share = static_cast<double>(++done) / (last - first + 1);
    events_.add({{"kind", "progress"},
                 {"stage", "film"},
                 {"fraction", share},
                 {"secondsLeft", watch.seconds() * (1 - share) / share}});
  }
  if (done == 0) throw Error("stopped before the first frame");
  film.finish();
  writeFileAtomically(std::filesystem::path(file).replace_extension(".toml"), std::string_view(text));
  return {{"file", file.string()}, {"frames", done}};
}

} // namespace surflect::viewer
