#include "render/surfels/outgoing_radiance.h"

#include "render/surfels/develop.h"
#include "tests/render/films.h"

#include <gtest/gtest.h>

namespace surflect::surfels {
namespace {

class OutgoingFromSphere : public studio::PackedSphere<2000> {};

// Splatted radiance of the visible surfels is the frame of an orthographic camera, to the bit.
TEST_F(OutgoingFromSphere, IsWhatADistantCameraSees) {
  const auto twist = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(50), {0, 0, 0});
  auto distant = camera;
  distant.lens.model = capture::Lens::Model::orthographic;
  distant.lens.focalX = distant.lens.focalY = studio::pictureSize / 2.5;
  FrameOptions options;
  options.surfelsPerQuery = 1;
  FrameWorkspace workspace(model(), size_t{1} << 26);
  const scene::Scene scene{*twist, distant, {scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}}};
  const image::Image frame = renderFrame(model(), scene, options, workspace).color;

  const DrawnSurfels drawn = drawnSurfels(model(), model().cloud.size());
  const OutgoingRadiance radiance(model(), drawn, scene, options, workspace);
  const splat::SplatRaster raster = look(distant, model().cloud, radiance.deformed());
  const shading::Shaded shaded = radiance.towards(capture::Viewpoint(distant).towards({}), raster.visible);
  EXPECT_GT(raster.visible.size(), 500u);
  EXPECT_EQ(developRadiance(raster, shaded, {}).values, frame.values);
}

TEST_F(OutgoingFromSphere, ALevelOfDetailHasTheRadianceOfItsSurfels) {
  const DrawnSurfels all = drawnSurfels(model(), model().cloud.size()), few = drawnSurfels(model(), 600);
  EXPECT_EQ(all.cloud.size(), model().cloud.size());
  ASSERT_LE(few.cloud.size(), 600u);
  ASSERT_GT(few.cloud.size(), 250u); // each level has half the surfels of the one before
  const FrameOptions options;
  FrameWorkspace workspace(model(), size_t{1} << 26);
  const auto still = studio::noWarp();
  const scene::Scene scene{*still, camera, {scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}}};
  const OutgoingRadiance ofAll(model(), all, scene, options, workspace),
      ofFew(model(), few, scene, options, workspace);
  const Direction3<ObjectSpace, double> viewer(0, 0, 1);
  std::vector<uint32_t> entries;
  for (uint32_t i = 0; i < few.cloud.size(); ++i) {
    entries.push_back(i);
    EXPECT_EQ(few.cloud.p0[i], model().cloud.p0[few.surfels[i]]);
    EXPECT_GT(few.cloud.radius[i], model().cloud.radius[few.surfels[i]]);
  }
  EXPECT_EQ(ofFew.towards(viewer, entries).radiance, ofAll.towards(viewer, few.surfels).radiance);
}

} // namespace
} // namespace surflect::surfels
