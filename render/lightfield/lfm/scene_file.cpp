#include "render/lightfield/lfm/scene_file.h"

#include "render/scene/script_fields.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/math/angle.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>

namespace surflect::lfm {

namespace {

constexpr size_t kMostObjects = 10'000;

Placement asPlacement(const scene::Section& section) {
  Placement placement;
  if (const auto position = section.find("position")) placement.position = scene::asVector(*position);
  if (const auto scale = section.find("scale")) placement.scale = scene::numberIn(*scale, 1e-6, 1e6);
  const auto axisEntry = section.find("rotate_axis"), angle = section.find("rotate_deg");
  if (axisEntry && !angle) throw scene::mismatch(*axisEntry, "rotate_deg beside it");
  if (!angle) return placement;
  const Vec3<double> axis = axisEntry ? scene::asVector(*axisEntry) : Vec3<double>(0, 0, 1);
  if (!(axis.norm() > 1e-9)) throw scene::mismatch(*axisEntry, "a direction other than 0");
  const double radians = Angle::fromDegrees(scene::numberIn(*angle, -360, 360)).radians();
  placement.rotation = Eigen::AngleAxisd(radians, axis.normalized()).toRotationMatrix();
  return placement;
}

// Index of a path, which is added if it is new.
size_t indexOf(std::vector<std::filesystem::path>& paths, const std::filesystem::path& path) {
  const auto found = std::ranges::find(paths, path);
  const auto index = static_cast<size_t>(found - paths.begin());
  if (found == paths.end()) paths.push_back(path);
  return index;
}

} // namespace

SceneFile parseSceneFile(std::string_view text, const std::filesystem::path& path) {
  try {
    const scene::ScriptDocument document(text, path);
    const scene::Section root(document.root(), {"object"});
    const scene::Entry list = root.require("object");
    const std::vector<scene::Entry> tables = scene::asArray(list, "tables under [[object]]");
    if (tables.empty() || tables.size() > kMostObjects)
      throw Error::mismatch("1 to " + std::to_string(kMostObjects) + " tables", std::to_string(tables.size()))
          .at(list.field);
    SceneFile file;
    for (const scene::Entry& table : tables) {
      const scene::Section section(table, {"model", "position", "rotate_axis", "rotate_deg", "scale"});
      const std::filesystem::path model = scene::asPath(section.require("model")).lexically_normal();
      file.objects.push_back({indexOf(file.models, model), asPlacement(section)});
    }
    return file;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

SceneFile readSceneFile(const std::filesystem::path& path) {
  constexpr uint64_t kMostBytes = uint64_t{1} << 24;
  return parseSceneFile(readFile(path, kMostBytes), path);
}

} // namespace surflect::lfm
