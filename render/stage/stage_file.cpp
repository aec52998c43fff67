#include "render/stage/stage_file.h"

#include "render/script_fields.h"
#include "render/stage/rig.h"
#include "surfel/file.h"
#include "surfel/hash.h"
#include "surfel/nearest_name.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>

namespace surflect {

struct MaterialTables {
  std::unique_ptr<const LossTable> mirror;
  std::map<double, std::unique_ptr<const DielectricLosses>> glass; // by eta
  std::map<double, std::unique_ptr<const CoatTransmission>> coat;
  std::vector<std::unique_ptr<const MerlTable>> measured;
};

namespace {

constexpr int kMostSide = 16384, kMostViews = 100'000, kMostLights = 4096, kMostSegments = 2048,
              kMostBoxSegments = 512, kMostSamples = 1'000'000;
constexpr size_t kMostTriangles = size_t{1} << 25;
constexpr double kMostValues = 0x1p29; // of one view: floats of all its lights, which are in memory twice

double numberIn(const Entry& entry, double least, double most) {
  const double number = asNumber(entry);
  if (!(number >= least && number <= most)) throw mismatch(entry, fmt::format("{} to {}", least, most));
  return number;
}

double positive(const Entry& entry) {
  const double number = asNumber(entry);
  if (!(number >= 1e-9 && number <= 1e9)) throw mismatch(entry, "a number above 0, in 1e-9..1e9");
  return number;
}

int integerOr(const Section& section, std::string_view key, int least, int most, int otherwise) {
  const auto entry = section.find(key);
  return entry ? asInteger(*entry, least, most) : otherwise;
}

Vec3<double> asVector(const Entry& entry) {
  const auto parts = asArray(entry, "an array of 3 numbers");
  if (parts.size() != 3) throw mismatch(entry, "an array of 3 numbers");
  return {numberIn(parts[0], -1e9, 1e9), numberIn(parts[1], -1e9, 1e9), numberIn(parts[2], -1e9, 1e9)};
}

Point3<AcquisitionSpace, double> pointOr0(const Section& section, std::string_view key) {
  const auto entry = section.find(key);
  return assume<Point3<AcquisitionSpace, double>>(entry ? asVector(*entry) : Vec3<double>(0, 0, 0));
}

// [r, g, b], each in the range.
Rgb asColor(const Entry& entry, double least, double most) {
  const auto parts = asArray(entry, "an array of 3 numbers");
  if (parts.size() != 3) throw mismatch(entry, "an array of 3 numbers");
  const auto channel = [&](size_t i) { return static_cast<float>(numberIn(parts[i], least, most)); };
  return {channel(0), channel(1), channel(2)};
}

Rgb fractionsOr(const Section& section, std::string_view key, const Rgb& otherwise) {
  const auto entry = section.find(key);
  return entry ? asColor(*entry, 0, 1) : otherwise;
}

double fraction(const Section& section, std::string_view key) { return numberIn(section.require(key), 0, 1); }

// One number, or that along the tangent and that across.
Roughness asRoughness(const Entry& entry) {
  try {
    const double both = asNumber(entry);
    return {numberIn(entry, 0, 1), both};
  } catch (const Error&) {
    const auto parts = asArray(entry, "a number in 0..1, or two: along the tangent and across");
    if (parts.size() != 2) throw mismatch(entry, "a number in 0..1, or two: along the tangent and across");
    return {numberIn(parts[0], 0, 1), numberIn(parts[1], 0, 1)};
  }
}

// What materials share is made when the first of them asks for it.
class MaterialReader {
public:
  void read(const Entry& entry) {
    const Keys types = {"lambert", "rough_diffuse", "conductor", "dielectric",
                        "ward",    "measured",      "clear_coat"};
    const std::vector<Keys> keys = {{"albedo", "texture", "repeat"},
                                    {"albedo", "roughness", "texture", "repeat"},
                                    {"color", "grazing_tint", "alpha"},
                                    {"eta", "alpha", "absorption"},
                                    {"diffuse", "specular", "alpha", "texture", "repeat"},
                                    {"file"},
                                    {"eta", "alpha", "base"}};
    const size_t type = typeOf(entry, types);
    Keys known = keys[type];
    known.insert(known.end(), {"name", "type"});
    const Section section(entry, known);
    const Entry nameEntry = section.require("name");
    const std::string name = asText(nameEntry);
    if (materials_.contains(name)) throw mismatch(nameEntry, "a name that no other material has");
    const std::array<Material (MaterialReader::*)(const Section&, const Entry&), 7> readers = {
        &MaterialReader::lambert,    &MaterialReader::roughDiffuse, &MaterialReader::conductor,
        &MaterialReader::dielectric, &MaterialReader::ward,         &MaterialReader::measured,
        &MaterialReader::clearCoat};
    const Material material = (this->*readers[type])(section, entry);
    const auto base = section.find("base");
    materials_.emplace(name, Named{material, base ? named(*base).texture : texture(section)});
  }

  struct Named {
    Material material;
    std::shared_ptr<const Texture> texture; // may be none
  };
  // The material that the entry names.
  const Named& named(const Entry& entry) const {
    const std::string name = asText(entry);
    if (const auto found = materials_.find(name); found != materials_.end()) return found->second;
    Keys known;
    for (const auto& [other, material] : materials_) known.push_back(other);
    if (known.empty()) throw mismatch(entry, "a material, but the file has none before this");
    throw mismatch(entry, "a material; the nearest known one is " + std::string(nearestName(name, known)));
  }

  std::shared_ptr<const MaterialTables> tables() const { return tables_; }
  const std::vector<std::filesystem::path>& files() const { return files_; }

private:
  // Before there are tables, and so before there is a roughness that asks for them.
  static void check(const Entry& table, const Material& smooth) {
    at(table, [&] { requireValid(smooth); });
  }

  Material lambert(const Section& s, const Entry&) { return Lambert{asColor(s.require("albedo"), 0, 1)}; }
  Material roughDiffuse(const Section& s, const Entry&) {
    return RoughDiffuse{asColor(s.require("albedo"), 0, 1), fraction(s, "roughness")};
  }
  Material conductor(const Section& s, const Entry&) {
    Conductor metal{asColor(s.require("color"), 0, 1), fractionsOr(s, "grazing_tint", {1, 1, 1}),
                    asRoughness(s.require("alpha"))};
    if (!isSpecular(metal)) {
      if (!tables_->mirror) tables_->mirror = std::make_unique<const LossTable>(mirrorLossTable());
      metal.mirrorLoss = tables_->mirror.get();
    }
    return metal;
  }
  Material dielectric(const Section& s, const Entry& table) {
    Dielectric glass{asNumber(s.require("eta"))};
    if (const auto absorption = s.find("absorption")) glass.absorption = asColor(*absorption, 0, 1e9);
    check(table, glass);
    if (const auto alpha = s.find("alpha")) glass.alpha = numberIn(*alpha, 0, 1);
    if (!isSpecular(glass)) {
      auto& losses = tables_->glass[glass.eta];
      if (!losses) losses = std::make_unique<const DielectricLosses>(glass.eta);
      glass.losses = losses.get();
    }
    return glass;
  }
  Material ward(const Section& s, const Entry& table) {
    const Ward gloss{asColor(s.require("diffuse"), 0, 1), asColor(s.require("specular"), 0, 1),
                     asRoughness(s.require("alpha"))};
    check(table, gloss);
    return gloss;
  }
  Material measured(const Section& s, const Entry&) {
    files_.push_back(asPath(s.require("file")));
    tables_->measured.push_back(std::make_unique<const MerlTable>(files_.back()));
    return Measured{tables_->measured.back().get()};
  }
  Material clearCoat(const Section& s, const Entry& table) {
    const Entry base = s.require("base");
    ClearCoat coat;
    coat.eta = asNumber(s.require("eta"));
    std::visit(
        [&]<class Base>(const Base& material) {
          if constexpr (std::is_constructible_v<CoatBase, Base>)
            coat.base = material;
          else
            throw mismatch(base, "a material that can be coated: neither a dielectric nor a coat");
        },
        named(base).material);
    check(table, coat);
    if (const auto alpha = s.find("alpha")) coat.alpha = numberIn(*alpha, 0, 1);
    if (coat.alpha >= kSmooth) {
      auto& transmission = tables_->coat[coat.eta];
      if (!transmission) transmission = std::make_unique<const CoatTransmission>(coat.eta);
      coat.transmission = transmission.get();
    }
    return coat;
  }

  std::shared_ptr<const Texture> texture(const Section& s) {
    const auto picture = s.find("texture"), repeat = s.find("repeat");
    if (!picture) return repeat ? throw mismatch(*repeat, "a texture beside it") : nullptr;
    constexpr int most = 10000;
    std::array<int, 2> times{1, 1};
    if (repeat) {
      const auto parts = asArray(*repeat, "[across, up]");
      if (parts.size() != 2) throw mismatch(*repeat, "[across, up]");
      times = {asInteger(parts[0], 1, most), asInteger(parts[1], 1, most)};
    }
    files_.push_back(asPath(*picture));
    return std::make_shared<const Texture>(files_.back(), times[0], times[1]);
  }

  std::map<std::string, Named, std::less<>> materials_;
  std::shared_ptr<MaterialTables> tables_ = std::make_shared<MaterialTables>();
  std::vector<std::filesystem::path> files_;
};

struct ShapeKind {
  std::string_view type;
  Keys keys;
  Surface (*read)(const Section&);
};

int segmentsOr(const Section& s) { return integerOr(s, "segments", 3, kMostSegments, 256); }

const std::vector<ShapeKind>& shapeKinds() {
  static const std::vector<ShapeKind> kinds = {
      {"sphere",
       {"center", "radius", "segments"},
       [](const Section& s) {
         return sphere(pointOr0(s, "center"), positive(s.require("radius")), segmentsOr(s));
       }},
      {"bumpy_sphere",
       {"center", "radius", "segments", "amplitude", "frequency"},
       [](const Section& s) {
         return bumpySphere(pointOr0(s, "center"), positive(s.require("radius")),
                            numberIn(s.require("amplitude"), 0, 0.9),
                            numberIn(s.require("frequency"), 0, 1000), segmentsOr(s));
       }},
      {"cylinder",
       {"center", "radius", "height", "segments"},
       [](const Section& s) {
         return cylinder(pointOr0(s, "center"), positive(s.require("radius")), positive(s.require("height")),
                         segmentsOr(s));
       }},
      {"box",
       {"center", "size", "segments"},
       [](const Section& s) {
         const Entry size = s.require("size");
         const Vec3<double> sides = asVector(size);
         if (!(sides.minCoeff() >= 1e-9)) throw mismatch(size, "three lengths above 0");
         return box(pointOr0(s, "center"), sides, integerOr(s, "segments", 1, kMostBoxSegments, 32));
       }},
      {"mesh", {"file", "smooth"}, [](const Section& s) {
         const auto smooth = s.find("smooth");
         return readSurface(asPath(s.require("file")), smooth ? asBoolean(*smooth) : true);
       }}};
  return kinds;
}

StageObject asObject(const Entry& entry, const MaterialReader& materials,
                     std::vector<std::filesystem::path>& files) {
  Keys types;
  for (const ShapeKind& kind : shapeKinds()) types.push_back(kind.type);
  const ShapeKind& kind = shapeKinds()[typeOf(entry, types)];
  Keys known = kind.keys;
  known.insert(known.end(), {"type", "material"});
  const Section section(entry, known);
  const Entry name = section.require("material");
  const auto& [material, texture] = materials.named(name);
  if (const auto file = section.find("file")) files.push_back(asPath(*file));
  StageObject object{kind.read(section), material, texture};
  if (texture && object.surface.textureCoordinates.empty())
    throw mismatch(name, "a material without texture: meshes of files have no texture coordinates here");
  return object;
}

struct CameraKind {
  Lens lens;
  double distance;
};

CameraKind asCameraKind(const Entry& entry) {
  const Section s(entry, {"model", "size", "distance", "fov_deg", "height"});
  const Entry size = s.require("size");
  const auto sides = asArray(size, "[width, height]");
  if (sides.size() != 2) throw mismatch(size, "[width, height]");
  Lens lens;
  lens.width = asInteger(sides[0], 1, kMostSide);
  lens.height = asInteger(sides[1], 1, kMostSide);
  lens.centerX = lens.width / 2.0;
  lens.centerY = lens.height / 2.0;
  const Entry model = s.require("model");
  if (const std::string name = asText(model); name == "orthographic")
    lens.model = Lens::Model::orthographic;
  else if (name != "pinhole")
    throw mismatch(model, "pinhole or orthographic");
  const bool isPinhole = lens.model == Lens::Model::pinhole;
  if (const auto other = s.find(isPinhole ? "height" : "fov_deg"))
    throw mismatch(*other, isPinhole ? "fov_deg for a pinhole" : "height for an orthographic camera");
  lens.focalX = lens.focalY =
      isPinhole ? lens.centerY /
                      std::tan(Angle::fromDegrees(numberIn(s.require("fov_deg"), 0.001, 179)).radians() / 2)
                : lens.height / positive(s.require("height"));
  return {lens, positive(s.require("distance"))};
}

// Directions for training, and how many of `all` they are: those of the test follow, between the others.
struct Placement {
  std::vector<RigDirection> all;
  size_t training;
};

// That of the test starts at another azimuth, so that it does not repeat the training's.
Placement withTest(std::vector<RigDirection> training, int test, double lowest, double highest) {
  Placement placement{std::move(training), 0};
  placement.training = placement.all.size();
  for (const auto& direction : spiral(test, lowest, highest, Angle::fromDegrees(50)))
    placement.all.push_back(direction);
  return placement;
}

Placement asViews(const Entry& entry) {
  const Section s(entry, {"turntable", "elevations_deg", "count", "test"});
  const int test = integerOr(s, "test", 0, kMostViews, 0);
  if (const auto count = s.find("count")) {
    for (const char* key : {"turntable", "elevations_deg"})
      if (const auto other = s.find(key)) throw mismatch(*other, "no such key beside count");
    return withTest(spiral(asInteger(*count, 1, kMostViews), -1, 1, Angle()), test, -1, 1);
  }
  const int steps = asInteger(s.require("turntable"), 1, kMostViews);
  const Entry list = s.require("elevations_deg");
  std::vector<Angle> elevations;
  double lowest = 1, highest = -1;
  for (const Entry& element : asArray(list, "a list of angles")) {
    elevations.push_back(Angle::fromDegrees(numberIn(element, -90, 90)));
    lowest = std::min(lowest, std::sin(elevations.back().radians()));
    highest = std::max(highest, std::sin(elevations.back().radians()));
  }
  if (elevations.empty() || elevations.size() > static_cast<size_t>(kMostViews / steps))
    throw mismatch(list, fmt::format("one elevation or more, and at most {} views", kMostViews));
  return withTest(turntable(steps, elevations), test, lowest, highest);
}

void addLights(const Entry& entry, const Point3<AcquisitionSpace, double>& center, Stage& stage) {
  const Section s(entry, {"count", "test", "irradiance", "distance", "radius_deg"});
  const Placement placement = withTest(spiral(asInteger(s.require("count"), 1, kMostLights), -1, 1, Angle()),
                                       integerOr(s, "test", 0, kMostLights, 0), -1, 1);
  stage.trainingLights = placement.training;
  const Rgb irradiance = asColor(s.require("irradiance"), 1e-3, 1e6);
  const auto distance = s.find("distance"), radius = s.find("radius_deg");
  if (distance && radius) throw mismatch(*radius, "no such key beside distance: point lights have no extent");
  if (radius) stage.trace.lightRadius = Angle::fromDegrees(numberIn(*radius, 0.001, 89));
  for (const RigDirection& direction : placement.all) {
    Light light;
    light.name = light.identity = fmt::format("L{:02}", stage.lights.size());
    if (distance) {
      const double d = positive(*distance);
      light.kind = PointLight{center + d * direction, scaled(d * d, irradiance)};
    } else {
      light.kind = DirectionalLight{direction, irradiance};
    }
    stage.lights.push_back(std::move(light));
  }
}

uint64_t hashOf(std::string_view text) { return contentHash(std::as_bytes(std::span(text))); }

Stage asStage(const Entry& root) {
  const Section s(
      root, {"transport", "samples", "seed", "center", "camera", "views", "lights", "material", "object"});
  Stage stage;
  stage.trace.samples = integerOr(s, "samples", 1, kMostSamples, stage.trace.samples);
  stage.trace.seed = static_cast<uint64_t>(integerOr(s, "seed", 0, 1 << 30, 1));
  if (const auto transport = s.find("transport")) {
    const std::string name = asText(*transport);
    if (name != "local" && name != "full") throw mismatch(*transport, "local or full");
    stage.trace.transport = name == "local" ? Transport::local : Transport::full;
  }
  const auto center = pointOr0(s, "center");
  const CameraKind camera = asCameraKind(s.require("camera"));
  const Placement views = asViews(s.require("views"));
  stage.trainingViews = views.training;
  for (const RigDirection& direction : views.all)
    stage.views.push_back({fmt::format("C{:03}", stage.views.size()),
                           cameraAbout(center, direction, camera.distance, camera.lens)});
  addLights(s.require("lights"), center, stage);
  const double values =
      3.0 * camera.lens.width * camera.lens.height * static_cast<double>(stage.lights.size());
  if (values > kMostValues)
    throw Error::mismatch(fmt::format("at most {:.3g} pixels under all lights", kMostValues / 3),
                          fmt::format("{:.3g}", values / 3))
        .at("camera.size");

  MaterialReader materials;
  for (const Entry& entry : asArray(s.require("material"), "tables under [[material]]"))
    materials.read(entry);
  std::vector<std::filesystem::path> files;
  size_t triangles = 0;
  for (const Entry& entry : asArray(s.require("object"), "tables under [[object]]")) {
    stage.objects.push_back(asObject(entry, materials, files));
    triangles += stage.objects.back().surface.mesh.triangles.size();
    if (triangles > kMostTriangles)
      throw Error::mismatch(fmt::format("at most {} triangles in all", kMostTriangles), "more")
          .at(entry.field);
  }
  if (stage.objects.empty()) throw mismatch(s.require("object"), "one object or more");
  stage.tables = materials.tables();
  files.insert(files.end(), materials.files().begin(), materials.files().end());
  for (const auto& file : files) {
    const std::array both = {stage.hash, hashOf(readFile(file))};
    stage.hash = contentHash(std::as_bytes(std::span(both)));
  }
  return stage;
}

} // namespace

Stage parseStage(std::string_view text, const std::filesystem::path& path) {
  try {
    const ScriptDocument document(text, path);
    Stage stage = asStage(document.root());
    stage.file = path;
    const std::array both = {stage.hash, hashOf(text)};
    stage.hash = contentHash(std::as_bytes(std::span(both)));
    return stage;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

Stage readStage(const std::filesystem::path& path) {
  constexpr uint64_t most = uint64_t{1} << 24;
  return parseStage(readFile(path, most), path);
}

} // namespace surflect
