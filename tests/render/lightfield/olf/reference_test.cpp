#include "render/lightfield/olf/reference.h"

#include "tests/render/lightfield/olf/painted_field.h"

#include <cmath>
#include <random>
#include <set>

namespace surflect::olf {
namespace {

class FromACamera : public ::testing::TestWithParam<std::pair<Blending, Domain>> {};
INSTANTIATE_TEST_SUITE_P(Reference, FromACamera,
                         ::testing::Values(std::pair(Blending::vdtm, Domain::sphere),
                                           std::pair(Blending::vdtm, Domain::plane),
                                           std::pair(Blending::ulr, Domain::sphere)));

// Error of a picture from the place of a camera, against that camera's painted photograph.
struct PaintedError {
  double squares = 0, count = 0;

  void add(const ReferencePicture& picture, size_t view, int x, int y) {
    for (size_t c = 0; c < 4; ++c, ++count) {
      const float alpha = painted(view, x, y, 3), truth = c < 3 ? alpha * painted(view, x, y, c) : alpha;
      squares += std::pow(static_cast<double>(picture.color.at(x, y)[c] - truth), 2);
    }
  }
  double decibels() const { return -10 * std::log10(squares / count); }
};

// Epipole consistency, over pixels of triangles whose corners all hold the view.
TEST_P(FromACamera, ItsPhotographComesBack) {
  const OpacityField field =
      paintedField(lightfield::bumpySphere(0, 24), 60, 48, GetParam().first, GetParam().second);
  const ViewBlender blender(field);
  for (const size_t view : {0u, 13u, 40u}) {
    const ReferencePicture picture = referencePicture(field, blender, field.cameras[view]);
    PaintedError error;
    const RayCaster<AcquisitionSpace> rays(field.mesh);
    const auto worldFromCamera = field.cameras[view].cameraFromWorld.inverse();
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 48; ++x) {
        const auto direction =
            worldFromCamera(capture::rayThrough(field.cameras[view].lens, {x + 0.5, y + 0.5})->direction);
        const auto hit = rays.firstHit(field.cameras[view].center(), direction);
        if (!hit) continue;
        bool isHeld = true;
        for (const uint32_t corner : field.mesh.triangles[hit->triangle]) {
          const auto of = field.visible.of(corner);
          isHeld &= std::ranges::find(of, view) != of.end();
        }
        if (!isHeld) continue;
        error.add(picture, view, x, y);
      }
    EXPECT_GT(error.count, 2500);
    EXPECT_GE(error.decibels(), 76);
  }
}

// A photograph of several layers comes back in all pixels that show the object.
TEST(OpacityReference, APhotographOfManyLayersComesBack) {
  for (const Blending method : {Blending::vdtm, Blending::ulr}) {
    OpacityField field = paintedField(rowOfSpheres(4), 40, 48, method);
    field.visible = {};
    for (uint32_t i = 0; i <= field.mesh.positions.size(); ++i) field.visible.first.push_back(40 * i);
    for (uint32_t i = 0; i < 40 * field.mesh.positions.size(); ++i) field.visible.views.push_back(i % 40);
    const ViewBlender blender(field);
    for (const size_t view : {0u, 13u, 29u}) {
      const ReferencePicture picture = referencePicture(field, blender, field.cameras[view]);
      EXPECT_GE(picture.mostLayers, 2u);
      PaintedError error;
      for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) {
          if (picture.color.at(x, y)[3] == 0) continue;
          error.add(picture, view, x, y);
        }
      EXPECT_GT(error.count, 1200);
      EXPECT_GE(error.decibels(), 76);
    }
  }
}

TEST(OpacityReference, TheOpacityOfLayersIsThatOfTheMostOpaqueAndOpaqueLayersHideTheRest) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(0, 1);
  for (int trial = 0; trial < 1000; ++trial) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    double most = 0;
    for (int layer = 0; layer < 4; ++layer) {
      const double alpha = number(random);
      sum = inFrontOf(sum, alpha * Eigen::Vector4d(0.2, 0.5, 0.8, 1)); // of one colour
      most = std::max(most, alpha);
      EXPECT_LE((sum - most * Eigen::Vector4d(0.2, 0.5, 0.8, 1)).norm(), 1e-12);
      EXPECT_EQ(inFrontOf(sum, sum), sum);
    }
    const Eigen::Vector4d opaque(number(random), 0.3, 0.1, 1);
    EXPECT_EQ(inFrontOf(opaque, sum), opaque);
    EXPECT_LE((inFrontOf(sum, opaque) - over(sum, opaque)).norm(), 1e-12);
  }
}

TEST(OpacityReference, LayersOfOneTexelAreCompositedByTheirAlpha) {
  // Two parallel squares, which face +z; one view along z.
  OpacityField field;
  field.method = Blending::ulr;
  for (const float z : {0.f, -0.5f})
    for (const auto& [x, y] : {std::pair(-0.5f, -0.47f), {0.53f, -0.5f}, {0.5f, 0.54f}, {-0.51f, 0.5f}})
      field.mesh.positions.emplace_back(x, y, z);
  field.mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  field.cameras.push_back(studio::cameraFrom<AcquisitionSpace>({0, 0, 1}, 32));
  field.packed.width = field.packed.height = 1;
  field.packed.views.push_back({{0, 0}, {1, 1}, 1, 1});
  field.packed.texels = {{image::nearestHalf(0.25f), 0, 0, image::nearestHalf(0.5f)}};
  for (uint32_t i = 0; i <= 8; ++i) field.visible.first.push_back(i);
  field.visible.views.assign(8, 0);
  const ReferencePicture picture = referencePicture(field, ViewBlender(field), field.cameras[0]);
  EXPECT_EQ(picture.mostLayers, 2u);
  EXPECT_NEAR(picture.color.at(15, 18)[0], 0.25, 1e-6);
  EXPECT_NEAR(picture.color.at(15, 18)[3], 0.5, 1e-6);
  EXPECT_EQ(picture.color.at(0, 0)[3], 0);
  const ReferencePicture independent = referencePicture(field, ViewBlender(field), field.cameras[0], over);
  EXPECT_NEAR(independent.color.at(15, 18)[0], 0.25 + 0.5 * 0.25, 1e-6);
  EXPECT_NEAR(independent.color.at(15, 18)[3], 0.75, 1e-6);
  // From behind nothing is seen.
  const ReferencePicture back =
      referencePicture(field, ViewBlender(field), studio::cameraFrom<AcquisitionSpace>({0, 0, -1}, 32));
  EXPECT_EQ(back.mostLayers, 0u);
}

} // namespace
} // namespace surflect::olf
