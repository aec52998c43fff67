#include "srf/weights/shared_weights.h"

#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace surflect::weights {
namespace {

using reflectance::TableGrid;

Direction3<AcquisitionSpace> above(std::mt19937& random, float least = 0.1f) {
  for (;;)
    if (const Vec3<double> d = randomUnit(random); d.z() >= least)
      return assume<Direction3<AcquisitionSpace>>(d.cast<float>());
}

// One surfel at the origin that faces z, with two random tables.
class SharedWeight : public testing::Test {
protected:
  SharedWeight() {
    field.cloud.p0 = {{0, 0, 0}};
    field.cloud.r0 = {{0, 0, 0}};
    reflectance::SharedReflectance shared{0.3f, {TableGrid{{9, 9, 3, 3}}, {}}, {1, 0.5f}, {}, {}, {}, {}};
    std::uniform_real_distribution<float> value(0.05f, 2);
    for (int table = 0; table < 2; ++table) {
      std::vector<Rgb> nodes;
      for (size_t node = 0; node < shared.tables.grid.size(); ++node) {
        const float r = value(random), g = value(random), b = value(random);
        nodes.push_back({r, g, b});
      }
      shared.tables.add(nodes);
    }
    shared.tilts = {{}};
    shared.fibres = {Angle::fromDegrees(25)};
    shared.mixtures = {{{0, 1, 0}, {0.75f, 0.25f, 0}}};
    shared.gains = {{0.5f, 1.5f, 2}};
    field.shared = std::move(shared);
  }

  std::vector<LitPhotograph> randomPhotographs(size_t count) {
    std::vector<LitPhotograph> photographs;
    for (uint32_t i = 0; i < count; ++i) {
      const auto view = above(random), light = above(random);
      photographs.push_back(
          {{i, pairPlace(light, view, 1, kResidualScales), nuggetOf(0.1f, 1)}, view, light});
    }
    return photographs;
  }

  // L / E_q for the reflectance of the photographs.
  Rgb answerOf(const SharedBlend& blend, std::span<const Rgb> measured) const {
    Rgb sum = field.shared->gains[0] * blend.offset;
    for (const auto& [index, factor] : blend.photographs) sum = sum + factor * measured[index];
    return sum;
  }

  SharedWeights weights() const {
    SharedWeights own(field);
    own.moveTo(0);
    return own;
  }

  SharedBlend blend(const Direction3<AcquisitionSpace>& view, const Direction3<AcquisitionSpace>& light,
                    std::span<const LitPhotograph> photographs) const {
    KrigingBatch batch;
    const PredictedRequest request = weights().ask(view, light, photographs, batch);
    batch.solveSimple();
    return weights().blendOf(request, batch);
  }

  // By the tables alone.
  Rgb predicted(const Direction3<AcquisitionSpace>& view, const Direction3<AcquisitionSpace>& light) const {
    return field.shared->gains[0] * blend(view, light, {}).offset;
  }

  std::mt19937 random{1};
  ReflectanceField field;
};

TEST_F(SharedWeight, PhotographsThatAgreeWithTheTablesChangeNothing) {
  for (int trial = 0; trial < 50; ++trial) {
    const auto photographs = randomPhotographs(1 + random() % kMaxBlended);
    const auto view = above(random), light = above(random);
    std::vector<Rgb> measured;
    for (const LitPhotograph& each : photographs)
      measured.push_back(predicted(each.towardsView, each.towardsLight));
    const Rgb got = answerOf(blend(view, light, photographs), measured), wanted = predicted(view, light);
    EXPECT_NEAR(got.r, wanted.r, 1e-5);
    EXPECT_NEAR(got.g, wanted.g, 1e-5);
    EXPECT_NEAR(got.b, wanted.b, 1e-5);
  }
}

// Epipole consistency.
TEST_F(SharedWeight, APhotographThatIsMetAnswersAlone) {
  std::uniform_real_distribution<float> value(0, 3);
  for (int trial = 0; trial < 50; ++trial) {
    auto photographs = randomPhotographs(8);
    photographs[3].sample.nugget = nuggetOf(0, 1);
    std::vector<Rgb> measured;
    for (size_t i = 0; i < photographs.size(); ++i) measured.push_back({value(random), value(random), 1});
    const SharedBlend met = blend(photographs[3].towardsView, photographs[3].towardsLight, photographs);
    const Rgb got = answerOf(met, measured);
    EXPECT_NEAR(met.photographs[3].weight, 1, 1e-3);
    EXPECT_NEAR(got.r, measured[3].r, 3e-3);
    EXPECT_NEAR(got.g, measured[3].g, 3e-3);
  }
}

TEST_F(SharedWeight, FarFromAllPhotographsTheTablesAnswerAlone) {
  const auto view = assume<Direction3<AcquisitionSpace>>(Vec3<float>(0.6f, 0, 0.8f));
  const auto light = assume<Direction3<AcquisitionSpace>>(Vec3<float>(0.8f, 0, 0.6f));
  const auto other = assume<Direction3<AcquisitionSpace>>(Vec3<float>(-0.8f, 0, 0.6f)); // not grazing
  const std::vector<LitPhotograph> photographs{
      {{0, pairPlace(other, other, 1, kResidualScales), nuggetOf(0.1f, 1)}, other, other}};
  EXPECT_LT(std::abs(blend(view, light, photographs).photographs[0].weight), 1e-3);
}

TEST_F(SharedWeight, TheAnswerIsContinuous) {
  std::uniform_real_distribution<float> value(0, 3);
  for (int path = 0; path < 30; ++path) {
    const auto photographs = randomPhotographs(6);
    std::vector<Rgb> measured;
    for (size_t i = 0; i < photographs.size(); ++i) measured.push_back({value(random), 1, 1});
    const auto v0 = above(random), v1 = above(random), l0 = above(random), l1 = above(random);
    const auto between = [](const auto& a, const auto& b, float t) {
      return assume<Direction3<AcquisitionSpace>>(((1 - t) * a.raw() + t * b.raw()).normalized());
    };
    const auto largestStep = [&](int steps) {
      float largest = 0, before = 0;
      for (int step = 0; step <= steps; ++step) {
        const float t = static_cast<float>(step) / static_cast<float>(steps);
        const float now = answerOf(blend(between(v0, v1, t), between(l0, l1, t), photographs), measured).r;
        if (step > 0) largest = std::max(largest, std::abs(now - before));
        before = now;
      }
      return largest;
    };
    const float coarse = largestStep(500);
    EXPECT_LT(largestStep(1000), 0.65f * coarse + 1e-4f);
  }
}

TEST_F(SharedWeight, TablesDoNotAnswerInShadowFromBehindOrWithoutTrust) {
  const Direction3<AcquisitionSpace> up(0, 0, 1),
      behind = assume<Direction3<AcquisitionSpace>>(Vec3<float>(0.8f, 0, -0.6f));
  EXPECT_FLOAT_EQ(weights().shareOf(up, {up, {}}), 0.875f); // 0.75 of trust 1, 0.25 of trust 0.5
  EXPECT_FLOAT_EQ(weights().shareOf(up, {up, 1.f}), 0.875f);
  EXPECT_EQ(weights().shareOf(up, {up, 0.f}), 0);
  EXPECT_EQ(weights().shareOf(behind, {up, 1.f}), 0);
  EXPECT_EQ(weights().shareOf(up, {behind, {}}), 0);
  field.shared->trust = {0, 0};
  EXPECT_EQ(weights().shareOf(up, {up, 1.f}), 0);
}

} // namespace
} // namespace surflect::weights
