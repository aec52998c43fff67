#include "render/lightfield/slf/unseen_regions.h"

#include <gtest/gtest.h>

#include <vector>

namespace surflect::slf {
namespace {

// Regions in a row: neighbours share two vertices.
std::vector<Chart> row(uint32_t count) {
  std::vector<Chart> charts(count);
  for (uint32_t i = 0; i < count; ++i) charts[i].vertices = {2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3};
  return charts;
}

MeanRadiance mean(float value) { return {Vec3<float>::Constant(value), Vec3<float>::Constant(2 * value)}; }

TEST(UnseenRegions, AreFilledStepByStepFromTheirNeighbours) {
  std::vector<MeanRadiance> means(5);
  means[0] = mean(1);
  means[4] = mean(5);
  fillUnseenRegions(row(5), means);
  EXPECT_EQ(means[1], mean(1));
  EXPECT_EQ(means[2], mean(3));
  EXPECT_EQ(means[3], mean(5));
}

TEST(UnseenRegions, SharedVerticesWeighNeighbours) {
  std::vector<Chart> charts(3);
  charts[0].vertices = {0, 1, 2};
  charts[1].vertices = {3};
  charts[2].vertices = {0, 1, 2, 3};
  std::vector<MeanRadiance> means = {mean(1), mean(5), {}};
  fillUnseenRegions(charts, means);
  EXPECT_EQ(means[2], mean(2));
}

TEST(UnseenRegions, SeenRegionsKeepTheirRadianceAndIsolatedOnesStayWithout) {
  std::vector<Chart> charts = row(3);
  charts[2].vertices = {100, 101, 102};
  std::vector<MeanRadiance> means = {mean(1), mean(7), {}};
  fillUnseenRegions(charts, means);
  EXPECT_EQ(means[0], mean(1));
  EXPECT_EQ(means[1], mean(7));
  EXPECT_TRUE(means[2].empty());
}

} // namespace
} // namespace surflect::slf
