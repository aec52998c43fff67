#include "render/lightfield/spherical/frame_plan.h"

#include <unordered_set>

namespace surflect::spherical {

FramePlan planFrame(const DirectionTree& tree, const Window& window, const Look& look) {
  FramePlan plan;
  for (const LevelShare& share : levelShares(look.detail, tree.levels()))
    for (const Pencil& pencil : visiblePencils(tree, share.level, window))
      appendTriangles(tree, pencil, share.weight, look.interpolated, plan.triangles);
  std::unordered_set<ImageNumber> known;
  for (const WeightedTriangle& triangle : plan.triangles)
    if (const ImageNumber image = imageOf(triangle.pencil); known.insert(image).second)
      plan.images.push_back(image);
  return plan;
}

} // namespace surflect::spherical
