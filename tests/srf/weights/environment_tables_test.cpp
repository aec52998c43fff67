#include "srf/weights/environment_tables.h"

#include "tests/srf/shading/queries.h"

#include <gtest/gtest.h>

namespace surflect::weights {
namespace {

using Shows = EnvironmentTables::Shows;

// A sphere with random tables. The surfel, its normal and some of the cameras that see it and lights.
class EnvironmentTablesOfSphere : public studio::ProductQueries {
protected:
  EnvironmentTablesOfSphere() {
    studio::giveTables(model, random);
    for (size_t tilt = 0; tilt < model.shared->tilts.size(); ++tilt) model.shared->tilts[tilt] = {0, 0};
    normal = model.cloud.p0[kSurfel].raw().normalized();
    for (uint32_t view = 0; view < model.rig.views.size(); ++view) {
      const Vec3<double> towards =
          studio::towardsViewer(model.rig.views[view], model.cloud.p0[kSurfel].cast<double>()).raw();
      (towards.dot(normal.cast<double>()) > 0.3 ? facing : behind).push_back(view);
    }
    std::ranges::fill(model.visibility.values, uint8_t{255});
    for (uint32_t light = 0; light < model.rig.lights.size(); ++light)
      if (capture::towardsLight(model.rig.lights[light], model.cloud.p0[kSurfel].cast<double>())
              .raw()
              .dot(normal.cast<double>()) > 0.3)
        lit.push_back(light);
  }

  // Tables at the surfel, seen along its normal and lit from there.
  EnvironmentTables begun() const {
    EnvironmentTables tables(model);
    const auto along = assume<Direction3<AcquisitionSpace>>(normal);
    tables.moveTo(kSurfel, along);
    tables.add(along, {1, 2, 3});
    return tables;
  }
  static Rgb shownBy(EnvironmentTables& tables, const std::vector<uint32_t>& background = {}) {
    tables.lookUp();
    return tables.correctionAt(kSurfel, [&](uint32_t view) {
      return std::ranges::count(background, view) > 0 ? Shows::background : Shows::object;
    });
  }
  static void expectNear(const Rgb& got, const Rgb& wanted) {
    EXPECT_NEAR(got.r, wanted.r, 1e-6);
    EXPECT_NEAR(got.g, wanted.g, 1e-6);
    EXPECT_NEAR(got.b, wanted.b, 1e-6);
  }

  static constexpr uint32_t kSurfel = 7;
  Vec3<float> normal;
  std::vector<uint32_t> facing, behind; // cameras
  std::vector<uint32_t> lit;            // captured lights
};

// Where a view shows background, its weight passes to the others: it takes nothing away.
TEST_F(EnvironmentTablesOfSphere, AViewOfBackgroundIsLeftOutAsItIsOfThePhotographs) {
  ASSERT_GE(facing.size(), 2u);
  ASSERT_FALSE(lit.empty());
  EnvironmentTables two = begun(), one = begun();
  two.addView(facing[0], 0.6f);
  two.takeAway(lit[0], 0.6f * Rgb{1, 1, 0.5f});
  two.addView(facing[1], 0.4f);
  two.takeAway(lit[0], 0.4f * Rgb{1, 1, 0.5f});
  one.addView(facing[0], 1);
  one.takeAway(lit[0], {1, 1, 0.5f});
  const Rgb alone = shownBy(one), both = shownBy(two), first = shownBy(two, {facing[1]});
  expectNear(first, alone);
  EXPECT_GT(std::abs(both.g - alone.g), 1e-3);
  EXPECT_EQ(shownBy(two, facing), Rgb{});
}

TEST_F(EnvironmentTablesOfSphere, AViewThatIsHiddenIsNotCorrected) {
  model.visibility.values[kSurfel * model.rig.views.size() + facing[0]] = 0;
  EnvironmentTables tables = begun();
  tables.addView(facing[0], 1);
  tables.takeAway(lit[0], {1, 1, 1});
  EXPECT_EQ(shownBy(tables), Rgb{});
}

// Tables are uncertain along the surface, and know nothing of its back.
TEST_F(EnvironmentTablesOfSphere, AViewFromBehindIsNotCorrected) {
  const auto back = std::ranges::find_if(behind, [&](uint32_t view) {
    return studio::towardsViewer(model.rig.views[view], model.cloud.p0[kSurfel].cast<double>())
               .raw()
               .dot(normal.cast<double>()) < 0;
  });
  ASSERT_NE(back, behind.end());
  EnvironmentTables tables = begun();
  tables.addView(*back, 1);
  tables.takeAway(lit[0], {1, 1, 1});
  EXPECT_EQ(shownBy(tables), Rgb{});
}

// A captured light without green has shown none that could be taken away.
TEST_F(EnvironmentTablesOfSphere, NothingIsTakenAwayInAChannelInWhichTheLightIsDark) {
  model.rig.lights[lit[0]].kind = capture::DirectionalLight{
      assume<Direction3<AcquisitionSpace, double>>(Vec3<double>(normal.cast<double>())), {1, 0, 1}};
  EnvironmentTables with = begun(), without = begun();
  with.addView(facing[0], 1);
  with.takeAway(lit[0], {1, 1, 1});
  without.addView(facing[0], 1);
  const Rgb got = shownBy(with), all = shownBy(without);
  EXPECT_EQ(got.g, all.g);
  EXPECT_LT(got.r, all.r - 1e-3f);
}

} // namespace
} // namespace surflect::weights
