#include "tests/stability/tiny_light_fields.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/build.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/reference.h"
#include "render/lightfield/lfm/tile.h"
#include "render/lightfield/lumigraph/build.h"
#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "render/lightfield/lumigraph/reconstruction.h"
#include "render/lightfield/lumigraph/reference.h"
#include "render/lightfield/olf/build.h"
#include "render/lightfield/olf/opacity_file.h"
#include "render/lightfield/olf/opacity_map_build.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "render/lightfield/olf/reference.h"
#include "render/lightfield/slf/build.h"
#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/reference.h"
#include "render/lightfield/spherical/build.h"
#include "render/lightfield/spherical/pencil_weights.h"
#include "render/lightfield/spherical/reference.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "render/methods.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <sstream>
#include <utility>

namespace surflect::stability {
namespace {

constexpr int kPhotograph = 24; // pixels along a side
constexpr int kPencilImage = 16;
constexpr int kLargePencilImage = 64; // of which kTightMb holds few
constexpr size_t kTightMb = 2;
constexpr size_t kLevels = 2;
constexpr double kBrightest = 0.9; // of studio::fixedRadiance()

// An object that is photographed as a sphere of radius 1, and the mesh that stands for it.
struct Object {
  std::string name;
  TriangleMesh mesh;
  int cameras;
  float opacity;
  Vec3<double> middle;
};

TriangleMesh moved(TriangleMesh mesh, const Vec3<double>& shift) {
  for (auto& p : mesh.positions)
    p = assume<Point3<AcquisitionSpace>>(Vec3<double>(p.raw().cast<double>() + shift));
  return mesh;
}

// A sphere with a triangle beside it, one inside of it, and one without area; few vertices are seen by more
// than a view.
TriangleMesh oddMesh() {
  using slf::testing::meshOf, slf::testing::together;
  TriangleMesh mesh = slf::testing::bumpySphere(4, 6);
  mesh = together(std::move(mesh), meshOf({{1.02, -0.4, 0}, {1.02, 0.4, 0.1}, {1.1, 0, 0.7}}, {{0, 1, 2}}));
  mesh = together(std::move(mesh), meshOf({{-0.1, 0, 0}, {0.2, 0, 0}, {0, 0.3, 0.1}}, {{0, 1, 2}}));
  return together(std::move(mesh), meshOf({{0, 0, 1.1}, {0, 0.25, 1.1}, {0, 0.5, 1.1}}, {{0, 1, 2}}));
}

std::vector<Object> objects() {
  const Vec3<double> here = Vec3<double>::Zero(), far(512, -256, 1024);
  return {{"ball", slf::testing::bumpySphere(5, 8, 0.1), 12, 1, here},
          {"odd", oddMesh(), 4, 0.6f, here},
          {"far", moved(slf::testing::bumpySphere(4, 7), far), 9, 1, far}};
}

std::string objText(const TriangleMesh& mesh) {
  std::ostringstream text;
  text.precision(9);
  for (const auto& p : mesh.positions) text << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& [a, b, c] : mesh.triangles) text << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
  return text.str();
}

// Views of an object, photographed into a folder.
lightfield::Views photographed(const Object& object, const std::filesystem::path& folder) {
  capture::Capture capture = studio::photograph(
      {.cameras = object.cameras, .lights = 0, .size = kPhotograph, .opacity = object.opacity}, folder);
  for (capture::View& view : capture.views) {
    const auto& pose = view.camera.cameraFromWorld;
    view.camera.cameraFromWorld = {pose.rotation(), pose.translation() - pose.rotation() * object.middle};
  }
  capture.geometry = "mesh.obj";
  image::writeBytes(folder / "mesh.obj", objText(object.mesh));
  capture::writeCapture(capture, folder);
  lightfield::Views views(folder, {.plainPinholes = true});
  views.replaceMesh(object.mesh);
  return views;
}

std::string wrongSum(const char* name, double sum) {
  return std::abs(sum - 1) <= 1e-5 ? "" : std::string(name) + " sum to " + std::to_string(sum);
}

lightfield::LightFieldFolder opened(const std::filesystem::path& folder, const char* format, int version) {
  return lightfield::LightFieldFolder(folder, format, version);
}

// A renderer with a setting for all of its frames.
Subject subjectOf(const std::filesystem::path& folder, const method::Setting& setting) {
  Subject subject;
  subject.renderer = method::openRenderer(folder, setting);
  subject.setting = method::forFrames(subject.renderer->options(), setting);
  return subject;
}

// ---------------------------------------------------------------------------------------------------------
// Surface light fields

void buildSlf(const lightfield::Views& views, const std::filesystem::path& folder) {
  slf::build(views, {.regions = 8, .texels = 600, .directions = 18, .tolerance = 0}, folder);
}

Subject slfSubject(const std::filesystem::path& folder, const method::Setting& options) {
  Subject subject = subjectOf(folder, options);
  const auto field = std::make_shared<const slf::OpenedField>(slf::openField(folder));
  const auto reference = std::make_shared<const slf::Reference>(field->field, *field->textures);
  subject.mesh = field->field.mesh;
  const bool isExact = !options.contains("basis");
  subject.plain = [=](const LightFieldCamera& camera, const method::Setting&) {
    return isExact ? std::optional(reference->render(camera).color) : std::nullopt;
  };
  subject.wrongWeights = [=](const Vec3<double>&, Dice& dice) -> std::string {
    const auto& meshes = field->field.directionMeshes;
    const slf::DirectionMesh& mesh = meshes[static_cast<size_t>(dice.below(static_cast<int>(meshes.size())))];
    double sum = 0;
    for (const double weight : mesh.weightsAt(assume<slf::Direction>(dice.unit())).weights) sum += weight;
    return wrongSum("hat functions", sum);
  };
  subject.brightest = kBrightest;
  return subject;
}

// ---------------------------------------------------------------------------------------------------------
// Lumigraphs

Subject lumigraphSubject(const std::filesystem::path& folder) {
  Subject subject = subjectOf(folder, {});
  const auto field = std::make_shared<const lumigraph::Lumigraph>(
      lumigraph::readLumigraph(opened(folder, lumigraph::kFormat, lumigraph::kVersion)));
  const auto reference = std::make_shared<const lumigraph::Reference>(*field);
  subject.mesh = slf::testing::together(field->geometry.mesh, field->geometry.fringe);
  subject.plain = [=](const LightFieldCamera& camera, const method::Setting&) {
    return std::optional(reference->render(camera));
  };
  subject.wrongWeights = [=](const Vec3<double>& viewer, Dice& dice) -> std::string {
    const auto& positions = field->geometry.mesh.positions;
    const auto p =
        positions[static_cast<size_t>(dice.below(static_cast<int>(positions.size())))].cast<double>();
    const auto taps = lumigraph::tapsAt(field->slabs, field->overlap, p, assume<lumigraph::Point>(viewer));
    double sum = 0;
    for (const lumigraph::Tap& tap : taps) sum += tap.weight;
    return p.raw() == viewer ? "" : wrongSum("weights of nodes", sum);
  };
  subject.brightest = kBrightest;
  return subject;
}

// ---------------------------------------------------------------------------------------------------------
// Light field maps

// Value of a setting, if it names the option.
std::optional<size_t> countOf(const method::Setting& setting, const char* name) {
  const auto found = setting.find(name);
  if (found == setting.end()) return std::nullopt;
  return static_cast<size_t>(found->second.number());
}

enum class Storage { plain, codebooks, blocks };
constexpr double kBlockRounding = 0.02; // of radiance: drivers round S3TC blocks in their own ways

void buildLfm(const lightfield::Views& views, const std::filesystem::path& folder, lfm::Factorization method,
              Storage storage) {
  lfm::BuildReport report;
  lfm::LightFieldMaps maps =
      lfm::build(views, {.method = method, .terms = 3, .samples = 5, .viewSize = 8}, report);
  if (storage == Storage::codebooks) maps = lfm::withCodebooks(maps, {.ratio = 3});
  if (storage == Storage::blocks) maps = lfm::encoded(std::move(maps));
  lfm::writeMaps(maps, views.capture(), folder);
}

Subject lfmSubject(const std::filesystem::path& folder, const std::string& passes, Storage storage) {
  Subject subject = subjectOf(folder, {{"passes", passes}});
  if (storage == Storage::blocks) subject.tolerance = kBlockRounding;
  const auto reference = std::make_shared<const lfm::Reference>(lfm::openMaps(folder).maps);
  subject.mesh = opened(folder, lfm::kFormatTag, lfm::kFormatVersion).mesh();
  subject.plain = [=](const LightFieldCamera& camera,
                      const method::Setting& setting) -> std::optional<image::Image> {
    if (passes == "clamped") return std::nullopt;
    return reference->render(camera, countOf(setting, "terms"));
  };
  return subject;
}

// ---------------------------------------------------------------------------------------------------------
// Spherical light fields

struct SphericalImages {
  explicit SphericalImages(const std::filesystem::path& folder)
      : mesh(opened(folder, spherical::kFormat, spherical::kVersion).mesh()), surface(mesh),
        file(opened(folder, spherical::kFormat, spherical::kVersion)), tree(file.shape().levels) {
    for (spherical::ImageNumber image = 0; image < file.shape().images(); ++image)
      images.push_back(file.read(image));
  }
  TriangleMesh mesh;
  RayCaster<AcquisitionSpace> surface;
  spherical::SphericalFile file;
  spherical::DirectionTree tree;
  std::vector<spherical::PencilImage> images;
};

Subject sphericalSubject(const std::filesystem::path& folder, const method::Setting& options) {
  Subject subject = subjectOf(folder, options);
  const auto field = std::make_shared<const SphericalImages>(folder);
  subject.mesh = field->mesh;
  const auto isOn = [](const method::Setting& setting, const char* name) {
    const auto found = setting.find(name);
    return found == setting.end() || found->second == method::Value(method::kOn);
  };
  subject.plain = [=](const LightFieldCamera& camera, const method::Setting& setting) {
    const auto level = setting.find("level");
    const auto shown = [&](const spherical::Pencil& pencil) {
      const spherical::ImageNumber image = spherical::imageOf(pencil);
      return spherical::ShownImage{image, &field->images[image]};
    };
    const spherical::Look look{level == setting.end() ? kLevels - 1. : level->second.number(), 0,
                               isOn(setting, "depth"), isOn(setting, "interpolated")};
    return std::optional(
        spherical::renderReference(field->tree, field->file.shape(), shown, camera, look, field->surface)
            .color);
  };
  subject.wrongWeights = [=](const Vec3<double>&, Dice& dice) -> std::string {
    double sum = 0;
    const Vec3<double> direction = dice.unit();
    for (const auto& level : spherical::levelShares(dice.within(-1, kLevels), kLevels))
      for (const auto& share :
           spherical::pencilShares(field->tree, level.level, direction, dice.below(2) == 0))
        sum += level.weight * share.weight;
    return wrongSum("weights of pencils", sum);
  };
  subject.brightest = kBrightest;
  subject.hasNearPlane = [=](const method::Setting& setting) { return isOn(setting, "depth"); };
  return subject;
}

// ---------------------------------------------------------------------------------------------------------
// Opacity light fields

struct OpenedOpacity {
  explicit OpenedOpacity(const std::filesystem::path& folder)
      : field(olf::readField(opened(folder, olf::kFormat, olf::kVersion))), blender(field) {}
  olf::OpacityField field;
  olf::ViewBlender blender;
};

Subject opacitySubject(const std::filesystem::path& folder, olf::Order order) {
  Subject subject = subjectOf(folder, {{"order", std::string(olf::nameOf(order))}});
  subject.gaps = order == olf::Order::bsp ? 1 : 0; // where a cut triangle meets one that is whole
  const auto opacity = std::make_shared<const OpenedOpacity>(folder);
  subject.mesh = opacity->field.mesh;
  subject.plain = [=](const LightFieldCamera& camera, const method::Setting&) {
    olf::Composite& composite = order == olf::Order::bsp ? olf::over : olf::inFrontOf;
    return std::optional(olf::referencePicture(opacity->field, opacity->blender, camera, composite).color);
  };
  subject.wrongWeights = [=](const Vec3<double>& viewer, Dice&) -> std::string {
    for (const olf::TriangleBlend& blend : opacity->blender.blends(viewer))
      for (const auto& weights : blend.weights) {
        double sum = 0;
        for (size_t k = 0; k < blend.count; ++k) {
          if (!(weights[k] >= 0)) return "a view has the weight " + std::to_string(weights[k]);
          sum += static_cast<double>(weights[k]);
        }
        if (std::string wrong = wrongSum("weights of views", sum); !wrong.empty()) return wrong;
      }
    return "";
  };
  subject.brightest = kBrightest;
  return subject;
}

void buildOlfm(lightfield::Views& views, const std::filesystem::path& folder, Storage storage) {
  olf::MapBuildReport report;
  olf::OpacityMaps maps = olf::buildMaps(views, {.terms = 2, .samples = 5, .viewSize = 8}, report);
  if (storage == Storage::codebooks) maps.maps = lfm::withCodebooks(maps.maps, {.ratio = 3, .means = true});
  if (storage == Storage::blocks) maps.maps = lfm::encoded(std::move(maps.maps));
  olf::writeMaps(maps, views.capture(), folder);
}

Subject olfmSubject(const std::filesystem::path& folder, olf::Order order, Storage storage) {
  Subject subject = subjectOf(folder, {{"order", std::string(olf::nameOf(order))}});
  if (storage == Storage::blocks) subject.tolerance = kBlockRounding;
  const auto maps = std::make_shared<const olf::OpacityMaps>(
      olf::readMaps(opened(folder, olf::kMapFormat, olf::kMapVersion)));
  subject.mesh = maps->maps.mesh;
  subject.plain = [=](const LightFieldCamera& camera,
                      const method::Setting& setting) -> std::optional<image::Image> {
    const olf::ReferencePicture picture = olf::referencePicture(*maps, camera, countOf(setting, "terms"));
    const std::optional<size_t> layers = countOf(setting, "layers");
    if (layers && picture.mostLayers > *layers) return std::nullopt;
    return picture.color;
  };
  return subject;
}

} // namespace

std::vector<SubjectName> tinyLightFields(const std::filesystem::path& folder) {
  std::vector<SubjectName> subjects;
  for (const Object& object : objects()) {
    const std::filesystem::path place = folder / object.name;
    const auto views = std::make_shared<std::optional<lightfield::Views>>();
    // A renderer of a field, which is built where it is not there yet.
    const auto add = [&](const std::string& kind, const std::string& options, const auto& build,
                         const auto& open) {
      subjects.push_back({object.name + ", " + kind + ", " + options, [=] {
                            if (!*views) views->emplace(photographed(object, place / "capture"));
                            if (!std::filesystem::exists(place / kind)) build(**views, place / kind);
                            return open(place / kind);
                          }});
    };
    const auto addSlf = [&](const char* name, const method::Setting& options) {
      add("slf", name, buildSlf, [=](const auto& path) { return slfSubject(path, options); });
    };
    addSlf("fused", {});
    addSlf("two stages", {{"stages", "two"}});
    addSlf("three slots", {{"cache_mb", 0}});
    addSlf("gouraud", {{"stages", "two"}, {"basis", "gouraud"}});

    // Simplified geometry has a fringe.
    for (const size_t triangles : {size_t{0}, size_t{16}})
      add(
          triangles > 0 ? "coarse lumigraph" : "lumigraph", "plain",
          [=](const lightfield::Views& of, const auto& path) {
            lumigraph::build(of, {.slabs = {.nodes = 3, .texels = 6000}, .triangles = triangles}, path);
          },
          lumigraphSubject);

    const Storage storage = object.name == "ball"  ? Storage::plain
                            : object.name == "odd" ? Storage::codebooks
                                                   : Storage::blocks;
    for (const auto& [kind, method] :
         {std::pair("lfm", lfm::Factorization::pca), {"lfm by nmf", lfm::Factorization::nmf}})
      for (const auto& [name, passes] :
           {std::pair("one pass", "single"), {"a pass a term", "per_term"}, {"clamped", "clamped"}})
        add(
            kind, name,
            [=](const lightfield::Views& of, const auto& path) { buildLfm(of, path, method, storage); },
            [=](const auto& path) { return lfmSubject(path, passes, storage); });

    const auto addSpherical = [&](const char* kind, int size, const method::Setting& options) {
      add(
          kind, method::textOf(options),
          [=](const lightfield::Views& of, const auto& path) {
            spherical::build(of, {.levels = kLevels, .size = size}, {}, path);
          },
          [=](const auto& path) { return sphericalSubject(path, options); });
    };
    addSpherical("spherical", kPencilImage, {});
    addSpherical("spherical, larger", kLargePencilImage, {{"cache_mb", kTightMb}});

    struct Opacity {
      const char* name;
      olf::Blending method;
      olf::Domain domain;
    };
    for (const Opacity& kind : {Opacity{"vdtm", olf::Blending::vdtm, olf::Domain::sphere},
                                {"vdtm in planes", olf::Blending::vdtm, olf::Domain::plane},
                                {"ulr", olf::Blending::ulr, olf::Domain::sphere}})
      for (const olf::Order order : {olf::Order::list, olf::Order::peel, olf::Order::bsp})
        add(
            kind.name, olf::nameOf(order),
            [=](lightfield::Views& of, const auto& path) {
              olf::build(of, {.method = kind.method, .domain = kind.domain}, path);
            },
            [=](const auto& path) { return opacitySubject(path, order); });

    for (const olf::Order order : {olf::Order::list, olf::Order::peel})
      add(
          "olfm", olf::nameOf(order),
          [=](lightfield::Views& of, const auto& path) { buildOlfm(of, path, storage); },
          [=](const auto& path) { return olfmSubject(path, order, storage); });
  }
  return subjects;
}

} // namespace surflect::stability
