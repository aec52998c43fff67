#include "render/lightfield/lumigraph/depth_geometry.h"

#include "srf/capture/silhouette.h"
#include "surfel/geometry/simplify.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"

#include <random>

namespace surflect::lumigraph {
namespace {

TEST(DepthGeometry, TheFringeCoversMostOfWhatSimplifiedGeometryMisses) {
  const TriangleMesh object = bumpySphere(0.3, 96), coarse = simplified(object, 199);
  const RayCaster<AcquisitionSpace> whole(object), simple(coarse), fringe(fringeAround(object, coarse));
  std::mt19937 random(1);
  size_t covered = 0, missedBySimple = 0, missed = 0;
  for (int n = 0; n < 10; ++n) {
    const auto camera = randomCamera(random, 96);
    const image::Image truth = capture::silhouette(camera, whole),
                       inner = capture::silhouette(camera, simple),
                       outer = capture::silhouette(camera, fringe);
    for (size_t i = 0; i < truth.values.size(); ++i) {
      if (truth.values[i] == 0) continue;
      ++covered;
      missedBySimple += inner.values[i] == 0;
      missed += inner.values[i] == 0 && outer.values[i] == 0;
    }
  }
  EXPECT_GT(static_cast<double>(missedBySimple), 0.005 * static_cast<double>(covered));
  EXPECT_LE(2 * missed, missedBySimple);
}

TEST(DepthGeometry, TheFringeOfTheObjectItselfIsTheObject) {
  const TriangleMesh object = bumpySphere(0.3);
  const TriangleMesh fringe = fringeAround(object, object);
  for (size_t i = 0; i < object.positions.size(); ++i)
    EXPECT_LE(length(fringe.positions[i] - object.positions[i]), 1e-5f);
}

} // namespace
} // namespace surflect::lumigraph
