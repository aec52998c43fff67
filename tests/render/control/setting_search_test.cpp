#include "render/control/setting_search.h"

#include "render/control/relative_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace surflect::control {
namespace {

image::Image pictureOf(std::initializer_list<float> values) {
  image::Image picture(static_cast<int>(values.size() / 4), 1, 4);
  std::ranges::copy(values, picture.values.begin());
  return picture;
}

TEST(RelativeRms, ComparesColourAndNotAlpha) {
  const image::Image b = pictureOf({3, 0, 0, 1, 0, 4, 0, 1});
  EXPECT_EQ(relativeRms(b, b), 0);
  EXPECT_EQ(relativeRms(pictureOf({3, 0, 0, 0, 0, 4, 0, 0}), b), 0);
  EXPECT_DOUBLE_EQ(relativeRms(pictureOf({3, 0, 1, 1, 0, 4, 0, 1}), b), 0.2);
  EXPECT_DOUBLE_EQ(relativeRms(image::Image(2, 1, 4), b), 1);
  EXPECT_EQ(relativeRms(image::Image(2, 1, 4), image::Image(2, 1, 4)), 0);
  EXPECT_TRUE(std::isinf(relativeRms(b, image::Image(2, 1, 4))));
}

struct Model {
  std::vector<KnobEffects> knobs;
  std::vector<FrameModel> frames;
};

Model randomModel(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  Model model;
  for (size_t k = 0; k < 4; ++k) {
    KnobEffects knob{{0, 0, {1, 1}}};
    const size_t steps = 2 + random() % 3;
    for (size_t step = 1; step < steps; ++step) // now and then dearer, or less accurate, than the one before
      knob.push_back(
          {double(step), uniform(random), {0.3 + 0.8 * uniform(random), 0.3 + 0.8 * uniform(random)}});
    model.knobs.push_back(knob);
  }
  for (size_t f = 0; f < 2; ++f) model.frames.push_back({{uniform(random), uniform(random)}, {}});
  for (FrameModel& frame : model.frames)
    for (size_t k = 0; k < 4; ++k) frame.weights.push_back(0.1 + uniform(random));
  return model;
}

// All combinations, in lexicographic order.
std::vector<Steps> allSteps(const std::vector<KnobEffects>& knobs) {
  std::vector<Steps> all{{}};
  for (const KnobEffects& knob : knobs) {
    std::vector<Steps> longer;
    for (const Steps& steps : all)
      for (size_t step = 0; step < knob.size(); ++step) {
        longer.push_back(steps);
        longer.back().push_back(step);
      }
    all = std::move(longer);
  }
  return all;
}

TEST(BestSteps, AreThoseOfAllCombinations) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const Model model = randomModel(random);
    const auto errorOf = [&](const Steps& steps) {
      return std::max(squaredError(model.knobs, model.frames[0], steps),
                      squaredError(model.knobs, model.frames[1], steps));
    };
    const auto costOf = [&](const Steps& steps) {
      return std::max(cost(model.knobs, model.frames[0], steps), cost(model.knobs, model.frames[1], steps));
    };
    const auto isOdd = [](const Steps& steps) { return (steps[0] + steps[2]) % 2 == 1; };
    for (const Objective objective : {Objective::cost, Objective::error}) {
      const SearchLimits limits =
          objective == Objective::cost ? SearchLimits{0.4, 10} : SearchLimits{10, 0.4};
      std::optional<double> least;
      for (const Steps& steps : allSteps(model.knobs)) {
        if (isOdd(steps) || errorOf(steps) > limits.squaredError || costOf(steps) > limits.cost) continue;
        const double value = objective == Objective::cost ? costOf(steps) : errorOf(steps);
        least = std::min(least.value_or(value), value);
      }
      const auto best = bestSteps(model.knobs, model.frames, limits, objective, isOdd);
      ASSERT_EQ(best.has_value(), least.has_value());
      if (!best) continue;
      EXPECT_FALSE(isOdd(*best));
      EXPECT_NEAR(objective == Objective::cost ? costOf(*best) : errorOf(*best), *least, 1e-12);
    }
  }
}

TEST(KnobEffects, ACorrectionExplainsTheMeasurement) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Model model = randomModel(random);
    const Steps steps{1, 1, 0, 1};
    FrameModel corrected = model.frames[0];
    corrected.correlation = 0.2;
    const FrameModel before = corrected;
    const double measured = 1.1 * squaredError(model.knobs, corrected, steps);
    correct(model.knobs, steps, measured, corrected);
    EXPECT_NEAR(squaredError(model.knobs, corrected, steps) / measured, 1, 1e-4);
    EXPECT_EQ(corrected.weights[2], before.weights[2]) << "of a knob that was not turned";
    EXPECT_GT(corrected.weights[1], before.weights[1]);
    EXPECT_GT(corrected.correlation, before.correlation);
  }
}

TEST(KnobEffects, ASingleKnobSaysNothingOfCorrelation) {
  std::mt19937 random(3);
  const Model model = randomModel(random);
  FrameModel frame = model.frames[0];
  const double before = frame.correlation;
  correct(model.knobs, {0, 1, 0, 0}, 0.3, frame);
  EXPECT_NEAR(squaredError(model.knobs, frame, {0, 1, 0, 0}), 0.3, 1e-12);
  EXPECT_NEAR(frame.correlation, before, 1e-12);
}

TEST(KnobEffects, ErrorsAddBetweenSquaresAndNumbers) {
  const std::vector<KnobEffects> knobs(2, KnobEffects{{4, 0, {1}}, {3, 0.0009, {0.5}}});
  EXPECT_NEAR(std::sqrt(squaredError(knobs, {{1}, {1, 1}, 0}, {1, 1})), 0.03 * std::sqrt(2), 1e-12);
  EXPECT_NEAR(std::sqrt(squaredError(knobs, {{1}, {1, 1}, 1}, {1, 1})), 0.06, 1e-12);
  EXPECT_EQ(cost(knobs, {{8}, {1, 1}, 0}, {1, 1}), 2);
}

} // namespace
} // namespace surflect::control
