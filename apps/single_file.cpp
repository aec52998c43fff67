#include "apps/single_file.h"

#include "render/scene/script.h"
#include "render/stage/stage_file.h"
#include "srf/image/image_file.h"
#include "surfel/base/text.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/bounds.h"
#include "warp/gltf.h"

#include <fmt/format.h>

namespace surflect {

namespace {

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

Json describe(const char* kind, const TriangleMesh& mesh) {
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

} // namespace

std::optional<Json> describeFile(const std::filesystem::path& path, const Progress& progress) {
  std::error_code unknown; // reported when it is read
  if (!std::filesystem::is_regular_file(path, unknown)) return std::nullopt;
  const std::string extension = lowerCase(path.extension().string());
  if (image::isPictureName(path)) return describePicture(path);
  if (extension == ".ply" || extension == ".obj")
    return describe("a mesh", readMeshAsStored(path, {}, progress));
  if (extension == ".glb" || extension == ".gltf")
    return describe("a mesh in glTF, whose y axis points up", warp::readGltfMesh(path).mesh.mesh);
  if (extension == ".toml") return describeToml(path);
  return std::nullopt;
}

} // namespace surflect
