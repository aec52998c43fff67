#include "srf/shading/near_pairs.h"

#include "tests/srf/shading/queries.h"

#include <algorithm>

namespace surflect::shading {
namespace {

using namespace studio;

// The rig of a model, without photographs of the given views under the given lights.
ReflectanceField withoutPhotographs(const model::Model& model, std::span<const uint32_t> views,
                                    std::span<const uint32_t> lights) {
  ReflectanceField field;
  field.rig = model.rig;
  field.middle = model.middle;
  field.columns = model.columns;
  for (const uint32_t view : views)
    std::erase_if(field.columns[view],
                  [&](uint32_t light) { return std::ranges::find(lights, light) != lights.end(); });
  return field;
}

// Indices of the six directions nearest to the first.
std::vector<uint32_t> nearFirst(const std::vector<Vec3<double>>& towards) {
  std::vector<uint32_t> nearest(towards.size());
  std::iota(nearest.begin(), nearest.end(), 0u);
  std::ranges::sort(nearest, std::greater(), [&](uint32_t i) { return towards[i].dot(towards[0]); });
  nearest.resize(6);
  return nearest;
}

class NearPairs : public ProductQueries {
protected:
  std::vector<uint32_t> nearViews() const {
    std::vector<Vec3<double>> towards;
    for (const capture::View& view : model.rig.views) towards.push_back(towardsViewer(view, {0, 0, 0}).raw());
    return nearFirst(towards);
  }
  std::vector<uint32_t> nearLights() const {
    std::vector<Vec3<double>> towards;
    for (const capture::Light& light : model.rig.lights)
      towards.push_back(capture::towardsLight(light, {0, 0, 0}).raw());
    return nearFirst(towards);
  }
};

TEST_F(NearPairs, AreThereInAFullProduct) { EXPECT_TRUE(hasNearPairs(model)); }

TEST_F(NearPairs, AreThereIfOnePhotographOrOneCameraIsMissing) {
  const std::vector<uint32_t> views = nearViews(), lights = nearLights();
  EXPECT_TRUE(hasNearPairs(withoutPhotographs(model, std::span(views).first(1), std::span(lights).first(1))));
  EXPECT_TRUE(hasNearPairs(withoutPhotographs(model, std::span(views).first(1), lights)));
}

// 9 of 36 near pairs may be missing.
TEST_F(NearPairs, AreNotThereIfNearViewsLackNearLights) {
  const std::vector<uint32_t> views = nearViews(), lights = nearLights();
  EXPECT_TRUE(hasNearPairs(withoutPhotographs(model, std::span(views).first(3), std::span(lights).first(3))));
  EXPECT_FALSE(
      hasNearPairs(withoutPhotographs(model, std::span(views).first(2), std::span(lights).first(5))));
  EXPECT_FALSE(hasNearPairs(withoutPhotographs(model, views, lights)));
}

TEST(NearPairsOfModels, ComeWithPackingAndOpening) {
  const PackedStudio few(nearlyFullStudio(), 200), many(gappyStudio(), 200);
  EXPECT_FALSE(few.model.isFullProduct);
  EXPECT_TRUE(few.model.hasNearPairs);
  EXPECT_FALSE(many.model.hasNearPairs);
}

} // namespace
} // namespace surflect::shading
