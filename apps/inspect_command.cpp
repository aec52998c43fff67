#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/pack_report.h"
#include "apps/terminal.h"
#include "render/evaluation/contact_sheet.h"
#include "render/methods.h"
#include "render/scene/script.h"
#include "render/stage/stage_file.h"
#include "srf/image/image_file.h"
#include "srf/image/png.h"
#include "srf/model/manifest.h"
#include "srf/model/model.h"
#include "srf/model/pack_folder.h"
#include "srf/proxy/impostor.h"
#include "surfel/base/error.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/bounds.h"
#include "warp/gltf.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <vector>

namespace surflect {

namespace {

Json describe(const capture::Capture& capture) {
  size_t test = 0;
  for (const auto& frame : capture.frames) test += frame.split == capture::Split::test;
  return {{"views", capture.views.size()},
          {"lights", capture.lights.size()},
          {"training_frames", capture.frames.size() - test},
          {"test_frames", test},
          {"geometry", capture.geometry.string()}};
}

Json describe(const model::Model& model) {
  uint64_t bytes = 0, blocks = 0;
  for (const codec::ViewFile& file : model.files) {
    bytes += std::filesystem::file_size(file.path());
    blocks += file.blockCount();
  }
  const Eigen::AlignedBox3d box = boundsOf(placesOnObject(model.cloud));
  const auto corner = [](const Vec3<double>& p) { return Json::array({p.x(), p.y(), p.z()}); };
  const double apart = model::pixelsBetween(model.cloud, model.rig);
  size_t unseen = 0;
  for (size_t i = 0; i < model.cloud.size(); ++i) {
    const auto visibility = model.visibility.of(i);
    if (model.cloud.coverage[i] == 0) continue; // beside the object
    unseen += std::ranges::none_of(visibility, [](uint8_t fade) { return fade > 0; });
  }
  const std::string warning = model.grid ? "" : sparseSurfels(model.cloud.size(), apart);
  if (!warning.empty()) say(warning);
  return {{"surfels", model.cloud.size()},       {"unseen_surfels", unseen},
          {"pixels_between_surfels", apart},     {"grid_step", model.grid ? model.grid->step : 0},
          {"views", model.rig.views.size()},     {"lights", model.rig.lights.size()},
          {"full_product", model.isFullProduct}, {"blocks", blocks},
          {"reflectance_bytes", bytes},          {"white", model.white},
          {"tolerance", model.tolerance},        {"box", {corner(box.min()), corner(box.max())}}};
}

struct InspectArguments {
  CaptureArgument input;
  std::string overlay;
  proxy::ImpostorOptions impostor;
  size_t maxFrames = 24;
};

Json drawOverlay(const capture::Capture& capture, const proxy::Impostor& impostor,
                 const InspectArguments& arguments, const Progress& progress) {
  const evaluation::WhiteSurface surface(impostor.mesh);
  const auto frames = evaluation::spreadFrames(capture, arguments.maxFrames);
  const evaluation::ContactSheet sheet = evaluation::contactSheet(capture, frames, surface, progress);
  image::writePng(arguments.overlay, sheet.image, 8, image::PngColors::srgb);
  Json tiles = Json::array();
  for (const evaluation::Overlay& overlay : sheet.overlays) {
    Json& tile = tiles.emplace_back(Json{{"camera", overlay.camera}, {"light", overlay.light}});
    if (overlay.maskIou) tile["mask_iou"] = *overlay.maskIou;
    tile["shading_correlation"] = overlay.shadingCorrelation;
    tile["back_share"] = overlay.backShare;
  }
  say(fmt::format("{}: {} of {} photographs", arguments.overlay, frames.size(), capture.frames.size()));
  return {{"path", arguments.overlay}, {"geometry", nameOf(impostor.origin)}, {"frames", tiles}};
}

// Returns the report after printing it for people, a line each.
Json told(Json report) {
  for (const auto& [key, value] : report.items()) say(fmt::format("{:<20} {}", key, value.dump()));
  return report;
}

// Contents of a model of any method other than surfels.
Json describe(const method::Renderer& renderer) {
  const method::Description& model = renderer.describe();
  Json json = {{"method", model.method}, {"views", model.rig.views.size()}, {"aovs", model.aovs}};
  for (const auto& [name, count] : model.counts) json[name] = count;
  json["bytes"] = method::modelBytes(model.folder);
  for (const method::Option& option : renderer.options())
    json["options"][option.name] = option.standard ? option.standard->text() : "";
  return json;
}

// Whether a folder holds a model other than surfels.
bool isLightField(const std::filesystem::path& folder) {
  std::error_code failure;
  if (!std::filesystem::exists(folder / model::kManifestFile, failure)) return false;
  const std::string format = model::formatOf(folder);
  return !format.empty() && format != model::kSurfelFormat;
}

// ---------------------------------------------------------------------------------------------------------
// Single files.

Json describePicture(const std::filesystem::path& path) {
  const image::PictureHeader header = image::readPictureHeader(path);
  image::decodePicture(path); // a file that is cut off has a good header
  Json json = {{"file", "a picture"},
               {"size", {header.size.width, header.size.height}},
               {"samples", header.bits == 0 ? "floating point" : fmt::format("{} bits", header.bits)},
               {"alpha", header.hasAlpha}};
  if (header.orientation != 1) json["exif_orientation"] = header.orientation;
  return json;
}

Json describeMesh(const char* kind, const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  const auto corner = [](const Vec3<double>& p) { return Json::array({p.x(), p.y(), p.z()}); };
  Json json = {{"file", mesh.triangles.empty() ? "points without triangles" : kind},
               {"vertices", mesh.positions.size()},
               {"triangles", mesh.triangles.size()}};
  if (!box.isEmpty()) json["box"] = {corner(box.min()), corner(box.max())};
  return json;
}

Json describeToml(const std::filesystem::path& path) {
  std::string asScript;
  try {
    const scene::Script script = scene::readScript(path);
    Json json = {{"file", "a script"}, {"lights", script.lights.size()}, {"warps", script.warps.size()}};
    if (!script.model.empty()) json["model"] = script.model.string();
    if (!script.objects.empty()) json["objects"] = script.objects.size();
    if (script.frames) json["frames"] = {script.frames->first, script.frames->last};
    return json;
  } catch (const Error& error) {
    asScript = error.what();
  }
  try {
    const stage::Stage stage = stage::readStage(path);
    return {{"file", "a stage"}, {"objects", stage.objects.size()}};
  } catch (const Error& error) {
    throw Error(fmt::format("neither a script ({}) nor a stage ({})", asScript, error.what()));
  }
}

// Contents of a picture, a mesh, or a TOML file that is a script or a stage; nothing for a folder and for a
// file of another extension. Throws Error if the file cannot be read as what its extension says.
std::optional<Json> describeFile(const std::filesystem::path& path, const Progress& progress) {
  std::error_code unknown; // reported when it is read
  if (!std::filesystem::is_regular_file(path, unknown)) return std::nullopt;
  const std::string extension = lowerCase(path.extension().string());
  if (image::isPictureName(path)) return describePicture(path);
  if (extension == ".ply" || extension == ".obj")
    return describeMesh("a mesh", readMeshAsStored(path, {}, progress));
  if (extension == ".glb" || extension == ".gltf")
    return describeMesh("a mesh in glTF, whose y axis points up", warp::readGltfMesh(path).mesh.mesh);
  if (extension == ".toml") return describeToml(path);
  return std::nullopt;
}

// ---------------------------------------------------------------------------------------------------------

// Tells that too few lights a view leave the lights of a capture with several views unchecked.
std::optional<std::string> noteOnUncheckedLights(const capture::Capture& capture) {
  if (capture.lights.empty() || capture.views.size() < 2) return std::nullopt;
  std::vector<std::set<size_t>> lights(capture.views.size());
  for (const capture::Frame& frame : capture.frames)
    if (frame.light) lights[frame.view].insert(*frame.light);
  size_t most = 0;
  for (const auto& of : lights) most = std::max(most, of.size());
  if (most >= validation::kLightsForAlbedo) return std::nullopt;
  return fmt::format(
      "the lights were not checked: found {} a view at most, expected {}; the halves of --overlay's "
      "sheet show whether photographs and mesh are lit alike",
      most, validation::kLightsForAlbedo);
}

Json runInspect(const InspectArguments& arguments, const Progress& progress) {
  if (isLightField(arguments.input.path)) {
    if (!arguments.overlay.empty())
      throw Error("a model has no photographs: --overlay draws over a capture").in(arguments.input.path);
    return told(describe(*method::openRenderer(arguments.input.path, {}, progress)));
  }
  const bool packed = model::isFinished(arguments.input.path) || model::isUnfinished(arguments.input.path);
  if (packed && !arguments.overlay.empty())
    throw Error("a model has no photographs: --overlay draws over a capture").in(arguments.input.path);
  if (packed) return told(describe(model::openModel(arguments.input.path, progress)));
  if (auto file = describeFile(arguments.input.path, progress)) {
    if (!arguments.overlay.empty() || !arguments.impostor.mesh.empty() || arguments.impostor.relief)
      throw UsageError(Error("is a single file: --overlay, --mesh and --relief are for captures")
                           .in(arguments.input.path));
    return told(*std::move(file));
  }

  if (!arguments.overlay.empty()) requireReplaceable(arguments.overlay);
  const capture::Capture capture = arguments.input.read();
  Json report = told(describe(capture));
  // Lights that no frame names do not count: the checks tell fixed light by an empty list.
  const capture::Capture used = capture::subset(capture, [](const capture::Frame&) { return true; });
  std::vector<validation::Finding> findings;
  const auto take = [&](std::span<const validation::Finding> found) {
    announce(found);
    findings.insert(findings.end(), found.begin(), found.end());
    report["findings"] = jsonOf(findings);
  };
  validation::checkBeforeGeometry(used, {}, take, progress);
  const bool isGeometryGiven =
      !arguments.impostor.mesh.empty() || !capture.geometry.empty() || arguments.impostor.relief;
  const auto concluded = [&] {
    const bool hasGeometry = isGeometryGiven || !arguments.overlay.empty();
    if (findings.empty())
      say(hasGeometry ? "no fault was found"
                      : "no fault was found; --overlay checks cameras against a hull, too");
    if (const auto note = noteOnUncheckedLights(used)) say(*note);
    return report;
  };
  if (!isGeometryGiven && arguments.overlay.empty()) {
    if (const auto note = proxy::noteOnUnusedMeshes(capture)) say(*note);
    return concluded();
  }
  const auto training = capture::subset(
      capture, [](const capture::Frame& frame) { return frame.split == capture::Split::train; });
  const proxy::Impostor impostor = proxy::impostorOf(training, arguments.impostor, progress);
  for (const std::string& note : impostor.notes) say(note);
  if (!impostor.notes.empty()) report["mesh_notes"] = impostor.notes;
  take(validation::checkCapture(used, impostor.mesh, {}, progress));
  if (!arguments.overlay.empty()) report["overlay"] = drawOverlay(capture, impostor, arguments, progress);
  return concluded();
}

} // namespace

void addInspectCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<InspectArguments>();
  CLI::App* command =
      app.add_subcommand("inspect", "list what a capture, a model or a file holds, and check a capture");
  command->footer("Example: surflect inspect vase.srf\n"
                  "         surflect inspect examples/vase --overlay sheet.png");
  command
      ->add_option("path", arguments->input.path,
                   "a capture, a packed model, or a picture, mesh, script or stage")
      ->required();
  addAllowOutside(*command, arguments->input.outside);
  CLI::Option* overlay =
      command
          ->add_option("--overlay", arguments->overlay,
                       "of a capture: draw the geometry over photographs, and lit as they say, into this PNG")
          ->check(notEmpty());
  CLI::Option* mesh = command->add_option("--mesh", arguments->impostor.mesh,
                                          "geometry (PLY or OBJ) instead of the capture's");
  command->add_flag("--relief", arguments->impostor.relief, "the geometry that pack --relief makes")
      ->excludes(mesh);
  command->add_option("--max-frames", arguments->maxFrames, "photographs on the sheet, at most")
      ->needs(overlay)
      ->capture_default_str()
      ->check(CLI::Range(1, 400));
  setWork(*command, work, "nothing was kept",
          [arguments](const Progress& progress) { return runInspect(*arguments, progress); });
}

} // namespace surflect
