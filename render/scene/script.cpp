#include "render/scene/script.h"

#include "render/scene/script_fields.h"
#include "srf/image/image_file.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace surflect::scene {

namespace {

warp::Expression asFormula(const Entry& entry) {
  return at(entry, [&] { return warp::Expression(asText(entry), warp::warpVariables); });
}

std::array<int, 3> asThreeIntegers(const Entry& entry, std::string_view expected,
                                   const std::array<int, 3>& least, const std::array<int, 3>& most) {
  const std::vector<Entry> elements = asArray(entry, expected);
  if (elements.size() != 3) throw mismatch(entry, expected);
  return {asInteger(elements[0], least[0], most[0]), asInteger(elements[1], least[1], most[1]),
          asInteger(elements[2], least[2], most[2])};
}

warp::LatticeMotion asLattice(const Section& section) {
  constexpr int most = warp::mostLatticeDivisions;
  warp::LatticeMotion lattice{asPlace(section.require("min")), asPlace(section.require("max")), {}, {}};
  lattice.divisions =
      asThreeIntegers(section.require("divisions"), "three counts", {1, 1, 1}, {most, most, most});
  for (const Entry& entry : asArray(section.require("point"), "tables { at, move }")) {
    const Section point(entry, {"at", "move"});
    const Entry at = point.require("at");
    const auto index = asThreeIntegers(at, "three numbers of a control point", {0, 0, 0}, lattice.divisions);
    const auto same = [&](const warp::LatticeMotion::Point& other) { return other.index == index; };
    if (std::ranges::any_of(lattice.points, same)) throw mismatch(at, "each control point once");
    lattice.points.push_back({index, asTrack3(point.require("move"))});
  }
  return lattice;
}

warp::HandlesMotion asHandles(const Section& section) {
  std::vector<Vec3<double>> rest;
  warp::HandlesMotion motion;
  const Entry handles = section.require("handle");
  for (const Entry& entry : asArray(handles, "tables { rest, to }")) {
    const Section handle(entry, {"rest", "to"});
    const Entry place = handle.require("rest");
    const std::vector<Entry> xyz = asArray(place, "three numbers");
    if (xyz.size() != 3) throw mismatch(place, "three numbers");
    rest.emplace_back(Vec3<double>(asNumber(xyz[0]), asNumber(xyz[1]), asNumber(xyz[2])) - *place.origin);
    motion.targets.push_back(asPlace(handle.require("to")));
  }
  std::optional<double> radius;
  if (const auto entry = section.find("radius")) {
    radius = asNumber(*entry);
    if (!(*radius > 0)) throw mismatch(*entry, "more than 0");
  }
  motion.handles =
      at(handles, [&] { return std::make_shared<const warp::Handles>(std::move(rest), radius); });
  return motion;
}

warp::MeshMotion asMesh(const Section& section) {
  const Entry rest = section.require("rest");
  const auto cache = section.find("cache"), frame = section.find("frame"), time = section.find("time");
  const auto frameTrack = [&] { return frame ? asTrack(*frame) : warp::Track::expression("frame"); };
  if (!cache) {
    if (time) throw mismatch(*time, "no such key without a cache in MDD");
    const auto frames = asPath(section.require("frames"));
    return {std::make_shared<const warp::MeshSequence>(asPath(rest), frames, *rest.origin), frameTrack()};
  }
  if (section.find("frames")) throw mismatch(*cache, "either frames or cache");
  if (!rest.origin->isZero(0))
    throw Error("point caches are single precision, too coarse for original coordinates: use frames")
        .at(cache->field);
  auto sequence =
      std::make_shared<const warp::MeshSequence>(warp::MeshSequence::ofCache(asPath(rest), asPath(*cache)));
  if (sequence->cacheFormat() == warp::PointCache::Format::pc2) {
    if (time) throw mismatch(*time, "frame instead: a PC2 counts frames");
    return {std::move(sequence), frameTrack()};
  }
  if (frame) throw mismatch(*frame, "time instead: an MDD counts seconds");
  return {std::move(sequence), time ? asTrack(*time) : warp::Track::expression("t")};
}

warp::SkeletonMotion asSkeleton(const Section& section) {
  const auto animation = section.find("animation"), time = section.find("time");
  const Entry file = section.require("file");
  if (!file.origin->isZero(0))
    throw Error("glTF is single precision, too coarse for original coordinates: use a mesh or handles")
        .at(file.field);
  return {std::make_shared<const warp::Rig>(asPath(file), animation ? asText(*animation) : ""),
          time ? asTrack(*time) : warp::Track::expression("t")};
}

const std::vector<Kind<warp::WarpMotion>>& warpKinds() {
  static const std::vector<Kind<warp::WarpMotion>> kinds = {
      {"rigid",
       {"axis", "angle_deg", "center", "translate"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::RigidMotion{trackOr(s, "axis", warp::Track3{0, 1, 0}), placeOrOrigin(s, "center"),
                                  trackOr(s, "angle_deg", 0), trackOr(s, "translate", warp::Track3{0, 0, 0})};
       }},
      {"scale",
       {"factor", "center"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::ScaleMotion{asTrack3(s.require("factor")), placeOrOrigin(s, "center")};
       }},
      {"twist",
       {"axis", "center", "angle_deg", "length"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::TwistMotion{asTrack3(s.require("axis")), placeOrOrigin(s, "center"),
                                  asTrack(s.require("angle_deg")), trackOr(s, "length", 1)};
       }},
      {"bend",
       {"axis", "direction", "center", "angle_deg", "length"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::BendMotion{asTrack3(s.require("axis")), asTrack3(s.require("direction")),
                                 placeOrOrigin(s, "center"), asTrack(s.require("angle_deg")),
                                 trackOr(s, "length", 1)};
       }},
      {"taper",
       {"axis", "center", "factor", "length"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::TaperMotion{asTrack3(s.require("axis")), placeOrOrigin(s, "center"),
                                  asTrack(s.require("factor")), trackOr(s, "length", 1)};
       }},
      {"sine",
       {"axis", "direction", "center", "amplitude", "wavelength", "phase_deg"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::SineMotion{asTrack3(s.require("axis")),      asTrack3(s.require("direction")),
                                 placeOrOrigin(s, "center"),       asTrack(s.require("amplitude")),
                                 asTrack(s.require("wavelength")), trackOr(s, "phase_deg", 0)};
       }},
      {"expression",
       {"x", "y", "z"},
       [](const Section& s) -> warp::WarpMotion {
         const Entry x = s.require("x");
         return warp::ExpressionMotion{asFormula(x), asFormula(s.require("y")), asFormula(s.require("z")),
                                       *x.origin};
       }},
      {"lattice",
       {"min", "max", "divisions", "point"},
       [](const Section& s) -> warp::WarpMotion { return asLattice(s); }},
      {"handles", {"handle", "radius"}, [](const Section& s) -> warp::WarpMotion { return asHandles(s); }},
      {"mesh",
       {"rest", "frames", "cache", "frame", "time"},
       [](const Section& s) -> warp::WarpMotion { return asMesh(s); }},
      {"skeleton",
       {"file", "animation", "time"},
       [](const Section& s) -> warp::WarpMotion { return asSkeleton(s); }},
  };
  return kinds;
}

} // namespace

std::vector<warp::WarpMotion> asWarps(const std::optional<Entry>& entry) {
  return asList(entry, warpKinds());
}

namespace {

constexpr uint64_t kLargestScript = uint64_t{1} << 24; // bytes

const warp::Track3 yUp{0, 1, 0}, white{1, 1, 1};

Frames asFrames(const Entry& entry) {
  constexpr int most = 1'000'000;
  const Section section(entry, {"first", "last", "fps"});
  Frames frames;
  frames.first = asInteger(section.require("first"), 0, most);
  frames.last = asInteger(section.require("last"), frames.first, most);
  if (const auto fps = section.find("fps")) {
    frames.fps = asNumber(*fps);
    if (frames.fps < 1e-3 || frames.fps > 1e6) throw mismatch(*fps, "frames per second in 0.001..1000000");
  }
  return frames;
}

// Throws Error for a name outside of the folder of --output: a script that somebody else has written must not
// choose where on the disk it writes.
void requireInside(const Entry& entry, const std::string& name) {
  const std::filesystem::path place = std::filesystem::path(name).lexically_normal();
  if (place.is_absolute() || *place.begin() == "..")
    throw mismatch(entry, "a name inside the folder of --output");
}

Background asBackground(const Entry& entry) {
  constexpr const char* expected =
      "\"transparent\", a colour [red, green, blue] of numbers in 0..1, or a picture's file";
  if (isText(entry)) {
    if (asText(entry) == "transparent") return {};
    if (!image::isPictureName(asText(entry))) throw mismatch(entry, expected);
    return asPath(entry);
  }
  const std::vector<Entry> channels = asArray(entry, expected);
  if (channels.size() != 3) throw mismatch(entry, expected);
  const auto channel = [&](size_t c) { return static_cast<float>(numberIn(channels[c], 0, 1)); };
  return Rgb{channel(0), channel(1), channel(2)};
}

Finish asFinish(const Section& output) {
  Finish finish;
  if (const auto tone = output.find("tone")) {
    const auto found = std::ranges::find(toneNames, asText(*tone));
    if (found == toneNames.end()) throw noneOf(*tone, Keys(toneNames.begin(), toneNames.end()));
    finish.tone = static_cast<Tone>(found - toneNames.begin());
  }
  for (const auto& [key, name] :
       {std::pair{"ocio_display", &finish.ocioDisplay}, {"ocio_view", &finish.ocioView}})
    if (const auto entry = output.find(key)) {
      if (finish.tone != Tone::ocio) throw mismatch(*entry, "no such key without tone = \"ocio\"");
      *name = asText(*entry);
    }
  if (const auto background = output.find("background")) finish.background = asBackground(*background);
  return finish;
}

// An array of these names, none twice; empty without an entry.
std::vector<std::string> namesAmong(const std::optional<Entry>& entry, const Keys& known) {
  std::vector<std::string> names;
  if (!entry) return names;
  for (const Entry& name : asArray(*entry, "an array of names")) {
    const std::string text = asText(name);
    if (std::ranges::find(known, text) == known.end()) throw noneOf(name, known);
    if (std::ranges::find(names, text) != names.end()) throw mismatch(name, "each name once");
    names.push_back(text);
  }
  return names;
}

Output asOutput(const Entry& entry) {
  const Section section(entry, {"size", "path", "png", "aov", "maps", "owner", "samples", "background",
                                "tone", "ocio_display", "ocio_view", "video"});
  Output output;
  const Entry size = section.require("size");
  const std::vector<Entry> sides = asArray(size, "[width, height]");
  if (sides.size() != 2) throw mismatch(size, "[width, height]");
  output.width = asInteger(sides[0], 1, 16384);
  output.height = asInteger(sides[1], 1, 16384);

  const Entry path = section.require("path");
  output.path = asText(path);
  const size_t run = std::count(output.path.begin(), output.path.end(), '#');
  const bool together = output.path.find(std::string(run, '#')) != std::string::npos;
  const bool plain = output.path.find('\0') == std::string::npos;
  if (run < 1 || run > 16 || !together || !plain || !output.path.ends_with(".exr"))
    throw mismatch(path, "a name such as \"frame.####.exr\"");
  requireInside(path, output.path);

  output.finish = asFinish(section);
  if (const auto video = section.find("video")) {
    output.video = asText(*video);
    const std::string name = std::filesystem::path(output.video).filename();
    const bool isNamed = name.size() > 4 && (name.ends_with(".mp4") || name.ends_with(".mov"));
    if (!isNamed || output.video.find('\0') != std::string::npos)
      throw mismatch(*video, "a name such as \"film.mp4\" or \"film.mov\"");
    requireInside(*video, output.video);
  }
  if (const auto png = section.find("png")) output.png = asBoolean(*png);
  if (const auto samples = section.find("samples")) output.samples = asInteger(*samples, 1, mostSamples);
  if (const auto owner = section.find("owner")) output.owner = asText(*owner);
  output.aov = namesAmong(section.find("aov"), Keys(aovNames.begin(), aovNames.end()));
  output.maps = namesAmong(section.find("maps"), Keys(mapNames.begin(), mapNames.end()));
  return output;
}

// Keys that place the camera, and those of its picture, which every camera may have.
constexpr std::array<std::string_view, 7> placingKeys = {"from",    "file", "orbit",  "position",
                                                         "look_at", "up",   "fov_deg"};
constexpr std::array<std::string_view, 4> pictureKeys = {"exposure", "shutter_deg", "aperture",
                                                         "focus_distance"};

Section cameraSection(const Entry& entry) {
  Keys known(placingKeys.begin(), placingKeys.end());
  known.insert(known.end(), pictureKeys.begin(), pictureKeys.end());
  return {entry, known};
}

// Throws Error if another key places the camera, too.
void requireAlone(const Section& section, const Entry& placing) {
  for (const std::string_view key : placingKeys)
    if (const auto other = section.find(key); other && other->node != placing.node)
      throw mismatch(placing, "no " + std::string(key) + " beside it");
}

CameraMotion asCamera(const Section& section) {
  if (const auto from = section.find("from")) {
    requireAlone(section, *from);
    return NamedCamera{asText(*from)};
  }
  if (const auto file = section.find("file")) {
    requireAlone(section, *file);
    return FileCamera{std::make_shared<const CameraPath>(asPath(*file), *file->origin)};
  }
  const auto orbit = section.find("orbit");
  const warp::Track3 up = trackOr(section, "up", yUp);
  if (!orbit)
    return LookAtCamera{asPlace(section.require("position")), asPlace(section.require("look_at")), up,
                        asTrack(section.require("fov_deg"))};

  for (const std::string_view other : {"position", "look_at"})
    if (const auto extra = section.find(other)) throw mismatch(*extra, "no such key beside orbit");
  const Section path(*orbit, {"center", "radius", "azimuth_deg", "elevation_deg"});
  return OrbitCamera{placeOrOrigin(path, "center"),     up,
                     asTrack(path.require("radius")),   asTrack(path.require("azimuth_deg")),
                     trackOr(path, "elevation_deg", 0), asTrack(section.require("fov_deg"))};
}

CameraBlur asBlur(const Section& section) {
  CameraBlur blur{trackOr(section, "shutter_deg", 0), trackOr(section, "aperture", 0), {}};
  if (const auto distance = section.find("focus_distance")) blur.focusDistance = asTrack(*distance);
  return blur;
}

// The camera's `up`, as normal of a ground.
warp::Track3 defaultNormal(const std::optional<CameraMotion>& camera) {
  if (camera) {
    if (const auto* posed = std::get_if<LookAtCamera>(&*camera)) return posed->up;
    if (const auto* orbit = std::get_if<OrbitCamera>(&*camera)) return orbit->up;
  }
  return yUp;
}

GroundMotion asGround(const Entry& entry, const std::optional<CameraMotion>& camera) {
  const Section section(entry, {"point", "normal", "shadow"});
  return {asPlace(section.require("point")), trackOr(section, "normal", defaultNormal(camera)),
          trackOr(section, "shadow", 1)};
}

template <class Value>
std::optional<Value> findChoice(const Section& section, std::string_view key,
                                const std::vector<std::pair<std::string_view, Value>>& choices) {
  const auto entry = section.find(key);
  if (!entry) return std::nullopt;
  const std::string text = asText(*entry);
  Keys names;
  for (const auto& [name, value] : choices) {
    if (text == name) return value;
    names.push_back(name);
  }
  throw noneOf(*entry, names);
}

weights::LightExtrapolation uncoveredOr(const Section& section, weights::LightExtrapolation otherwise) {
  return findChoice<weights::LightExtrapolation>(section, "uncovered",
                                                 {{"extrapolate", weights::LightExtrapolation::clamp},
                                                  {"fade", weights::LightExtrapolation::fade}})
      .value_or(otherwise);
}

LightMotion asEnvironment(const Section& section) {
  EnvironmentLightMotion light;
  light.image = asPath(section.require("image"));
  light.mapping = findChoice<weights::EnvironmentMapping>(
      section, "mapping", {weights::kMappings.begin(), weights::kMappings.end()});
  light.up = trackOr(section, "up", yUp);
  light.rotateDeg = trackOr(section, "rotate_deg", 0);
  light.color = trackOr(section, "color", white);
  light.intensity = trackOr(section, "intensity", 1);
  if (const auto error = section.find("error")) {
    light.error = asNumber(*error);
    if (light.error < 1e-4 || light.error > 1) throw mismatch(*error, "a number in 0.0001..1");
  }
  light.extrapolation = uncoveredOr(section, weights::LightExtrapolation::fade);
  return light;
}

const std::vector<Kind<LightMotion>>& lightKinds() {
  static const std::vector<Kind<LightMotion>> kinds = {
      {"directional",
       {"direction", "color", "intensity", "uncovered"},
       [](const Section& s) -> LightMotion {
         return DirectionalLightMotion{asTrack3(s.require("direction")), trackOr(s, "color", white),
                                       trackOr(s, "intensity", 1),
                                       uncoveredOr(s, weights::LightExtrapolation::clamp)};
       }},
      {"point",
       {"position", "color", "intensity", "uncovered"},
       [](const Section& s) -> LightMotion {
         return PointLightMotion{asPlace(s.require("position")), trackOr(s, "color", white),
                                 trackOr(s, "intensity", 1),
                                 uncoveredOr(s, weights::LightExtrapolation::clamp)};
       }},
      {"environment",
       {"image", "mapping", "up", "rotate_deg", "color", "intensity", "error", "uncovered"},
       asEnvironment},
  };
  return kinds;
}

PlacedModel asPlacedModel(const Entry& entry) {
  const Section section(entry, {"model", "position", "rotate_axis", "rotate_deg", "scale"});
  PlacedModel placed;
  placed.model = asPath(section.require("model")).lexically_normal();
  if (const auto position = section.find("position")) placed.position = asVector(*position);
  if (const auto scale = section.find("scale")) placed.scale = numberIn(*scale, 1e-6, 1e6);
  const auto axisEntry = section.find("rotate_axis"), angle = section.find("rotate_deg");
  if (axisEntry && !angle) throw mismatch(*axisEntry, "rotate_deg beside it");
  if (!angle) return placed;
  const Vec3<double> axis = axisEntry ? asVector(*axisEntry) : Vec3<double>(0, 0, 1);
  if (!(axis.norm() > 1e-9)) throw mismatch(*axisEntry, "a direction other than 0");
  const double radians = Angle::fromDegrees(numberIn(*angle, -360, 360)).radians();
  placed.rotation = Eigen::AngleAxisd(radians, axis.normalized()).toRotationMatrix();
  return placed;
}

std::vector<PlacedModel> asObjects(const Section& root) {
  constexpr size_t kMostObjects = 10'000;
  const auto list = root.find("object");
  if (!list) return {};
  if (const auto model = root.find("model")) throw mismatch(*model, "no model beside [[object]]");
  const std::vector<Entry> tables = asArray(*list, "tables under [[object]]");
  if (tables.empty() || tables.size() > kMostObjects)
    throw mismatch(*list, "1 to " + std::to_string(kMostObjects) + " tables");
  std::vector<PlacedModel> objects;
  for (const Entry& table : tables) objects.push_back(asPlacedModel(table));
  return objects;
}

// Throws Error for unknown keys of the root.
Section rootOf(const ScriptDocument& document) {
  return {document.root(),
          {"model", "object", "coordinates", "frames", "output", "camera", "ground", "light", "warp"}};
}

Coordinates coordinatesOf(const Section& root) {
  return findChoice<Coordinates>(root, "coordinates",
                                 {{"model", Coordinates::model}, {"original", Coordinates::original}})
      .value_or(Coordinates::model);
}

// A script without camera, ground, lights and warps.
Script asScriptOfFrames(const Section& section) {
  Script script;
  script.coordinates = coordinatesOf(section);
  if (const auto model = section.find("model")) script.model = asPath(*model);
  script.objects = asObjects(section);
  if (const auto frames = section.find("frames")) script.frames = asFrames(*frames);
  if (const auto output = section.find("output")) script.output = asOutput(*output);
  return script;
}

Script asScript(const Section& section) {
  Script script = asScriptOfFrames(section);
  if (const auto entry = section.find("camera")) {
    const Section camera = cameraSection(*entry);
    script.camera = asCamera(camera);
    script.blur = asBlur(camera);
    if (const auto exposure = camera.find("exposure")) script.exposure = asTrack(*exposure);
  }
  if (const auto ground = section.find("ground")) script.ground = asGround(*ground, script.camera);
  script.lights = asList(section.find("light"), lightKinds());
  script.warps = asWarps(section.find("warp"));
  return script;
}

void requireShotOf(const Script& script, bool hasCamera) {
  const auto require = [](bool given, const char* field) {
    if (!given) throw Error("missing; a shot needs model, frames, output and camera").at(field);
  };
  require(!script.model.empty() || !script.objects.empty(), "model");
  require(script.frames.has_value(), "frames");
  require(script.output.has_value(), "output");
  require(hasCamera, "camera");
}

} // namespace

Script parseScript(std::string_view text, const std::filesystem::path& path, const Vec3<double>& origin) {
  try {
    ScriptDocument document(text, path);
    const Section root = rootOf(document);
    if (coordinatesOf(root) == Coordinates::original) document.countFrom(origin);
    Script script = asScript(root);
    script.path = path;
    script.hash = contentHash(std::as_bytes(std::span(text)));
    const auto addFiles = [&](uint64_t files) {
      const std::array both = {script.hash, files};
      script.hash = contentHash(std::as_bytes(std::span(both)));
    };
    for (const warp::WarpMotion& warp : script.warps)
      if (const uint64_t files = warp::filesHash(warp)) addFiles(files);
    if (const auto* file = script.camera ? std::get_if<FileCamera>(&*script.camera) : nullptr)
      addFiles(file->path->contentHash());
    return script;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

Script readScript(const std::filesystem::path& path, const Vec3<double>& origin) {
  return parseScript(readFile(path, kLargestScript), path, origin);
}

ScriptHead readScriptHead(const std::filesystem::path& path, const std::filesystem::path& model) {
  const std::string text = readFile(path, kLargestScript);
  try {
    const ScriptDocument document(text, path);
    const Section root = rootOf(document);
    Script script = asScriptOfFrames(root);
    if (!model.empty()) script.model = model, script.objects.clear();
    requireShotOf(script, root.find("camera").has_value());
    return {std::move(script.model), std::move(script.objects), script.coordinates, *script.frames,
            std::move(*script.output)};
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

void requireShot(const Script& script) {
  try {
    requireShotOf(script, script.camera.has_value());
  } catch (Error& error) {
    throw std::move(error).in(script.path);
  }
}

} // namespace surflect::scene
