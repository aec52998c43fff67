#include "render/lightfield/lumigraph/quota.h"

namespace surflect::lumigraph {
namespace {

// [Azuma 1999, §4.1]
TEST(Quota, OfThePapersSurfaceLightFieldIsATwelfth) {
  EXPECT_EQ(slabQuota(33235488, 2), 2769624u);
  EXPECT_EQ(33235488u / 12, 2769624u);
}

TEST(Quota, WithoutRedundancyIsASixth) { EXPECT_EQ(slabQuota(6 * 1234 + 5, 1), 1234u); }

// [Azuma 1999, §4.2.1]
TEST(Quota, GivesThePapersPictures) {
  EXPECT_EQ(pictureSide(2769624, 7), 238);
  EXPECT_EQ(pictureSide(2769624, 4), 416);
}

// The caption of Fig. 4.9 has 334, whose texels exceed the quota by 0.7 %.
TEST(Quota, GivesOneTexelLessThanThePapersFigure49) { EXPECT_EQ(pictureSide(2769624, 5), 333); }

} // namespace
} // namespace surflect::lumigraph
