#include "srf/model/interpolation_selection.h"

#include "tests/support/synthetic_capture.h"

namespace surflect::model {
namespace {

using namespace studio;

TEST(InterpolationSelection, HighlightsAreWeightedByPairs) {
  const PackedStudio packed(Studio{.cameras = 30, .gloss = 1});
  const auto& [choice, foreshortened, leftOut] = packed.report.interpolation;
  EXPECT_EQ(choice.kind, weights::Interpolation::kriging);
  EXPECT_LE(choice.halfScale, 0.4f);
  ASSERT_TRUE(leftOut);
  EXPECT_GT(leftOut->chosenDb, leftOut->separateDb + 1);
  EXPECT_EQ(packed.model.interpolation, choice);
  EXPECT_TRUE(foreshortened);
}

// A matte sphere, whose foreshortened photographs are exact under any weights.
TEST(InterpolationSelection, AMatteSphereKeepsSeparateWeights) {
  const PackedStudio packed(Studio{});
  const auto& [choice, foreshortened, leftOut] = packed.report.interpolation;
  EXPECT_EQ(choice.kind, weights::Interpolation::separate);
  EXPECT_TRUE(foreshortened);
  ASSERT_TRUE(leftOut);
  EXPECT_EQ(leftOut->chosenDb, leftOut->separateDb);
  EXPECT_GT(leftOut->separateDb, 30);
}

// Single photographs are left out of a capture with gaps.
TEST(InterpolationSelection, ACaptureWithGapsIsWeightedByPairsToo) {
  Studio studio = gappyStudio();
  studio.cameras = 30;
  studio.gloss = 1;
  const PackedStudio packed(studio, 500);
  const auto& [choice, foreshortened, leftOut] = packed.report.interpolation;
  EXPECT_FALSE(packed.model.isFullProduct);
  EXPECT_EQ(choice.kind, weights::Interpolation::kriging);
  ASSERT_TRUE(leftOut);
  EXPECT_GT(leftOut->chosenDb, leftOut->separateDb + 1);
  EXPECT_EQ(packed.model.lightBlend.foreshortened, foreshortened);
}

TEST(InterpolationSelection, TooFewCamerasOrLightsAreWeightedApart) {
  for (const Studio& few : {Studio{.cameras = 3}, Studio{.lights = 3}, Studio{.lights = 0}}) {
    const PackedStudio packed(few, 500);
    EXPECT_EQ(packed.report.interpolation.choice, weights::InterpolationChoice{});
    EXPECT_FALSE(packed.report.interpolation.leftOut);
  }
}

} // namespace
} // namespace surflect::model
