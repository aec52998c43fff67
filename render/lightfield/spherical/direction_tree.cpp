#include "render/lightfield/spherical/direction_tree.h"

#include <cassert>
#include <map>
#include <numbers>
#include <utility>

namespace surflect::spherical {

ImageNumber imageOf(Pencil pencil) {
  while (pencil.level > 0 && pencil.index % 4 == 0) pencil = parentOf(pencil);
  if (pencil.level == 0) return pencil.index;
  return static_cast<ImageNumber>(firstImageOf(pencil.level)) + pencil.index / 4 * 3 + pencil.index % 4 - 1;
}

Pencil pencilOf(ImageNumber image) {
  uint32_t level = 0;
  while (image >= imagesUpTo(level)) ++level;
  if (level == 0) return {0, image};
  const auto number = image - static_cast<ImageNumber>(firstImageOf(level));
  return {level, number / 3 * 4 + number % 3 + 1};
}

DirectionTree::DirectionTree(size_t levels) {
  assert(levels >= 1 && levels <= kMostLevels);
  meshes_.push_back(icosahedron());
  while (meshes_.size() < levels) meshes_.push_back(subdivided(meshes_.back()));
  for (LevelMesh& mesh : meshes_) listAround(mesh);
}

Corners DirectionTree::corners(const Pencil& pencil) const {
  const auto& [a, b, c] = vertices(pencil);
  const auto& positions = meshes_[pencil.level].positions;
  return {positions[a], positions[b], positions[c]};
}

std::span<const uint32_t> DirectionTree::around(size_t level, uint32_t vertex) const {
  const LevelMesh& mesh = meshes_[level];
  const uint32_t first = mesh.firstAround[vertex];
  return std::span(mesh.around).subspan(first, mesh.firstAround[vertex + 1] - first);
}

Vec3<double> DirectionTree::middle(const Pencil& pencil) const {
  const auto [a, b, c] = corners(pencil);
  return (a + b + c).normalized();
}

Pencil DirectionTree::find(size_t level, const Vec3<double>& direction) const {
  assert(level < levels());
  Pencil pencil;
  double nearest = -2;
  for (uint32_t face = 0; face < pencilsOf(0); ++face) // a face holds what its middle is nearest to
    if (const double cosine = middle({0, face}).dot(direction.normalized()); cosine > nearest)
      nearest = cosine, pencil.index = face;
  while (pencil.level < level) {
    // Sides of the centre child. Beyond the one that cuts off a corner is that corner's child.
    const Pencil centre{pencil.level + 1, 4 * pencil.index};
    const auto [bc, ca, ab] = corners(centre);
    uint32_t child = 0;
    if (ca.cross(ab).dot(direction) < 0)
      child = 1;
    else if (ab.cross(bc).dot(direction) < 0)
      child = 2;
    else if (bc.cross(ca).dot(direction) < 0)
      child = 3;
    pencil = {centre.level, centre.index + child};
  }
  return pencil;
}

DirectionTree::LevelMesh DirectionTree::icosahedron() {
  const double g = std::numbers::phi;
  LevelMesh mesh;
  for (const auto& [x, y, z] : std::array<std::array<double, 3>, 12>{{{-1, g, 0},
                                                                      {1, g, 0},
                                                                      {-1, -g, 0},
                                                                      {1, -g, 0},
                                                                      {0, -1, g},
                                                                      {0, 1, g},
                                                                      {0, -1, -g},
                                                                      {0, 1, -g},
                                                                      {g, 0, -1},
                                                                      {g, 0, 1},
                                                                      {-g, 0, -1},
                                                                      {-g, 0, 1}}})
    mesh.positions.push_back(Vec3<double>(x, y, z).normalized());
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return mesh;
}

DirectionTree::LevelMesh DirectionTree::subdivided(const LevelMesh& coarse) {
  LevelMesh fine{coarse.positions, {}, {}, {}};
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
  const auto middleOf = [&](uint32_t a, uint32_t b) {
    const auto [place, isNew] =
        middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(fine.positions.size()));
    if (isNew) fine.positions.push_back((coarse.positions[a] + coarse.positions[b]).normalized());
    return place->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const uint32_t ab = middleOf(a, b), bc = middleOf(b, c), ca = middleOf(c, a);
    fine.triangles.push_back({bc, ca, ab});
    fine.triangles.push_back({a, ab, ca});
    fine.triangles.push_back({ab, b, bc});
    fine.triangles.push_back({ca, bc, c});
  }
  return fine;
}

void DirectionTree::listAround(LevelMesh& mesh) {
  mesh.firstAround.assign(mesh.positions.size() + 1, 0);
  for (const auto& triangle : mesh.triangles)
    for (const uint32_t vertex : triangle) ++mesh.firstAround[vertex + 1];
  for (size_t v = 0; v < mesh.positions.size(); ++v) mesh.firstAround[v + 1] += mesh.firstAround[v];
  std::vector<uint32_t> next = mesh.firstAround;
  mesh.around.resize(3 * mesh.triangles.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t]) mesh.around[next[vertex]++] = static_cast<uint32_t>(t);
}

} // namespace surflect::spherical
