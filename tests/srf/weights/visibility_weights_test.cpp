#include "srf/weights/visibility_weights.h"

#include "srf/weights/fades.h"
#include "srf/weights/ulr.h"
#include "surfel/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace surflect::weights {
namespace {

void addSquare(TriangleMesh& mesh, float halfWidth, float z) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const auto& [x, y] : {std::pair{-1.f, -1.f}, {1.f, -1.f}, {1.f, 1.f}, {-1.f, 1.f}})
    mesh.positions.emplace_back(halfWidth * x, halfWidth * y, z);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

// A camera at `position` that looks at the origin.
capture::Camera<AcquisitionSpace> cameraAt(const Vec3<double>& position) {
  const Vec3<double> z = position.normalized(), x = Vec3<double>(0.3, 1, 0).cross(z).normalized();
  Mat3<double> axes; // columns: camera axes in the world
  axes << x, z.cross(x), z;
  const capture::Lens lens{
      .width = 200, .height = 200, .focalX = 180, .focalY = 180, .centerX = 100, .centerY = 100};
  return {lens, Rigid<CameraSpace, AcquisitionSpace>(axes.transpose(), -(axes.transpose() * position))};
}

// A floor with a square above it: visible regions end along smooth edges on the floor.
class FloorUnderSquare : public ::testing::Test {
protected:
  static constexpr float kSpacing = 0.05f;

  FloorUnderSquare() {
    addSquare(floor, 1, 0);
    scene = floor;
    addSquare(scene, 0.3f, 0.6f);
    cloud = sampleSurfels(floor, kSpacing);
    for (int i = 0; i < 6; ++i) {
      const double azimuth = 1.0472 * i + 0.2;
      views.push_back(cameraAt({1.8 * std::cos(azimuth), 1.8 * std::sin(azimuth), 3}));
    }
  }

  // Camera weights at a point of the floor, seen along `view`.
  std::map<uint32_t, float> weightsAt(const SmoothedVisibility& visibility, const Point3<AcquisitionSpace>& p,
                                      const Direction3<AcquisitionSpace>& view) const {
    const Normal3<AcquisitionSpace> up(0, 0, 1);
    std::vector<float> open(views.size());
    visibility.at(p, up, open);
    NearestCandidates nearest(3);
    for (uint32_t i = 0; i < views.size(); ++i) {
      const capture::Viewpoint viewpoint(views[i]);
      const double fade = visibilityWeight(views[i], viewpoint, p, up, open[i]);
      nearest.offer({i, anglePenalty(viewpoint.towards(p.cast<double>()).cast<float>(), view) /
                            static_cast<float>(fade)});
    }
    std::map<uint32_t, float> weights;
    for (const auto& [index, weight] : ulrWeights(nearest)) weights[index] = weight;
    return weights;
  }

  template <class WeightsAt> static double largestJump(const WeightsAt& weightsAt, size_t steps) {
    double largest = 0;
    auto before = weightsAt(0.0);
    for (size_t i = 1; i <= steps; ++i) {
      auto now = weightsAt(static_cast<double>(i) / static_cast<double>(steps));
      for (const auto& weights : {now, before})
        for (const auto& [index, weight] : weights)
          largest = std::max(largest, static_cast<double>(std::abs(now[index] - before[index])));
      before = std::move(now);
    }
    return largest;
  }

  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints() const {
    return {views.begin(), views.end()};
  }

  TriangleMesh floor, scene;
  SurfelCloud cloud;
  std::vector<capture::Camera<AcquisitionSpace>> views;
};

TEST_F(FloorUnderSquare, LineOfSightEndsWhereGeometrySaysSo) {
  const auto free = lineOfSight(cloud, viewpoints(), RayCaster<AcquisitionSpace>(scene), {});
  for (size_t i = 0; i < cloud.size(); ++i)
    for (size_t view = 0; view < views.size(); ++view) {
      const Vec3<double> p = cloud.p0[i].cast<double>().raw(), c = views[view].center().raw();
      const Vec3<double> crossing = p + (c - p) * 0.6 / c[2]; // intersection with the plane of the square
      if (std::abs(std::max(std::abs(crossing[0]), std::abs(crossing[1])) - 0.3) < 0.01)
        continue; // rays start slightly above the floor
      const bool hidden = std::abs(crossing[0]) < 0.3 && std::abs(crossing[1]) < 0.3;
      EXPECT_EQ(free[i * views.size() + view], hidden ? 0 : 1);
    }
}

TEST_F(FloorUnderSquare, HiddenSurfelsAreNeverAskedAndOpenOnesFully) {
  const auto fades = visibilityWeights(cloud, views, RayCaster<AcquisitionSpace>(scene), {});
  const auto free = lineOfSight(cloud, viewpoints(), RayCaster<AcquisitionSpace>(scene), {});
  size_t hidden = 0;
  for (size_t i = 0; i < cloud.size(); ++i)
    for (size_t view = 0; view < views.size(); ++view)
      if (!free[i * views.size() + view]) {
        ++hidden;
        EXPECT_LE(VisibilityWeights::decode(fades.of(i)[view]), 0.03); // at the corners of the shadow
      }
  EXPECT_GT(hidden, 100u);
  const Vec3<float> corner(-0.95f, -0.95f, 0); // far from every shadow
  for (size_t i = 0; i < cloud.size(); ++i) {
    if ((cloud.p0[i].raw() - corner).norm() > 0.1f) continue;
    for (const uint8_t fade : fades.of(i)) EXPECT_EQ(fade, 255);
  }
}

TEST_F(FloorUnderSquare, HalvingTheStepHalvesTheLargestWeightChangeAlongTheSurface) {
  const RayCaster<AcquisitionSpace> caster(scene);
  const SmoothedVisibility visibility(cloud, viewpoints(), lineOfSight(cloud, viewpoints(), caster, {}),
                                      4 * kSpacing);
  const Direction3<AcquisitionSpace> view =
      assume<Direction3<AcquisitionSpace>>(Vec3<float>(0.1f, 0.2f, 1).normalized());
  for (const float y : {-0.31f, 0.02f, 0.4f}) {
    const auto walk = [&](double s) {
      return weightsAt(visibility, {static_cast<float>(1.6 * s - 0.8), y, 0}, view);
    };
    const double jump = largestJump(walk, 16000);
    EXPECT_GT(jump, 1e-4); // weights do change
    EXPECT_LE(largestJump(walk, 32000), 0.55 * jump) << "y = " << y;
  }
}

TEST_F(FloorUnderSquare, HalvingTheStepHalvesTheLargestWeightChangeAlongACameraPath) {
  const RayCaster<AcquisitionSpace> caster(scene);
  const SmoothedVisibility visibility(cloud, viewpoints(), lineOfSight(cloud, viewpoints(), caster, {}),
                                      4 * kSpacing);
  for (const float x : {-0.5f, 0.03f, 0.35f}) {
    const Point3<AcquisitionSpace> p(x, 0.1f, 0);
    const auto path = [&](double s) {
      const double azimuth = 6.2831853 * s;
      const Point3<AcquisitionSpace, double> eye(2 * std::cos(azimuth), 2 * std::sin(azimuth), 2.5);
      return weightsAt(visibility, p, normalized(eye - p.cast<double>()).cast<float>());
    };
    EXPECT_LE(largestJump(path, 32000), 0.55 * largestJump(path, 16000)) << "x = " << x;
  }
}

TEST(GrazingAndBorderFades, FallToZeroWhereTheViewEnds) {
  EXPECT_EQ(grazingFade(0), 0);
  EXPECT_EQ(grazingFade(-0.5), 0);
  EXPECT_EQ(grazingFade(1), 1);
  const capture::Lens lens{.width = 100, .height = 50};
  EXPECT_EQ(borderFade(lens, {0, 25}), 0);
  EXPECT_EQ(borderFade(lens, {50, 50.5}), 0);
  EXPECT_EQ(borderFade(lens, {50, 25}), 1);
}

TEST(StoredFades, ComeBackWithinThreePercentDownToAMillionth) {
  EXPECT_EQ(VisibilityWeights::encode(0), 0);
  EXPECT_EQ(VisibilityWeights::decode(255), 1.f);
  for (double fade = 1e-6; fade <= 1; fade *= 1.01)
    EXPECT_NEAR(VisibilityWeights::decode(VisibilityWeights::encode(fade)), fade, 0.028 * fade);
}

// Quantisation to bytes: the jump of a weight between neighbouring values, for a camera at one degree.
TEST(StoredFades, NeighbouringValuesMoveAWeightByLittle) {
  const float near = static_cast<float>(1 - std::cos(0.0175)), others[] = {0.1f, 0.12f, 0.15f, 0.2f};
  float before = 0, largest = 0;
  for (int value = 0; value <= 255; ++value) {
    NearestCandidates nearest(3);
    nearest.offer({0, near / VisibilityWeights::decode(static_cast<uint8_t>(value))});
    for (uint32_t i = 0; i < 4; ++i) nearest.offer({i + 1, others[i]});
    float weight = 0;
    for (const auto& blended : ulrWeights(nearest))
      if (blended.index == 0) weight = blended.weight;
    largest = std::max(largest, std::abs(weight - before));
    before = weight;
  }
  EXPECT_LT(largest, 0.07f); // 0.9 if fades were stored linearly; between surfels a fade falls by many steps
}

} // namespace
} // namespace surflect::weights
