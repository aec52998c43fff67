#include "render/control/controller.h"

#include "render/control/knob_effects.h"
#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
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

namespace {

// Pictures of 8 x 8 pixels whose errors and costs are formulas. Every knob has the values 4, 3, 2 and 1.
class FormulaRenderer : public method::Renderer {
public:
  // Relative RMS error of each knob alone, of a value in a frame.
  std::function<double(size_t knob, double value, int frame)> error = [](size_t knob, double value, int) {
    return 0.004 * (4 - value) / double(knob + 1);
  };
  bool areErrorsAlike = false; // errors of knobs then add up, not their squares
  bool isTimed = true;
  std::vector<std::string> names{"a", "b", "c"};
  int frames = 0; // rendered
  method::Setting setting;

  std::span<const method::Option> options() const override {
    options_.clear();
    for (const std::string& name : names)
      options_.push_back(
          {.name = name, .domain = method::wholeRange(1, 4), .standard = 4, .sweep = {4, 3, 2, 1}});
    return options_;
  }
  double valueOf(size_t knob) const {
    const auto found = setting.find(names[knob]);
    return found == setting.end() ? 4 : found->second.number();
  }
  double work() const { // of two stages: all knobs make the first faster, the last knob also the second
    double product = 1;
    for (size_t k = 0; k < names.size(); ++k) product *= valueOf(k) / 4;
    return 90 * product + (names.empty() ? 10 : 2.5 * valueOf(names.size() - 1));
  }
  method::FrameLayers frame(int number) {
    ++frames;
    method::FrameLayers layers;
    layers.color = image::Image(8, 8, 4);
    for (size_t pixel = 0; pixel < 64; ++pixel) {
      double value = 1;
      for (size_t k = 0; k < names.size(); ++k) { // Walsh functions are orthogonal
        const bool isOdd = std::popcount(pixel & (areErrorsAlike ? 1 : k + 1)) % 2 == 1;
        value += (isOdd ? -1 : 1) * error(k, valueOf(k), number);
      }
      for (size_t c = 0; c < 3; ++c) layers.color.values[4 * pixel + c] = static_cast<float>(value);
    }
    const double second = names.empty() ? 10 : 2.5 * valueOf(names.size() - 1);
    if (isTimed)
      layers.report.counts = {{"work.first", work() - second}, {"work.second", second}, {"more", 7}};
    layers.report.seconds = {{"first", work() - second}, {"second", second}};
    return layers;
  }

  const method::Description& describe() const override { return description_; }
  method::FrameLayers render(const scene::Scene&, const std::vector<std::string>&, const Progress&,
                             method::FrameLayers) override {
    return {};
  }

private:
  void configure(const method::Setting& next) override { setting = next; }

  mutable std::vector<method::Option> options_;
  method::Description description_;
};

struct Film : ::testing::Test {
  FormulaRenderer renderer;
  FrameRange range{1, 100};

  Controller controllerOf(const Target& target, const method::Setting& held = {}) {
    return {renderer, [this](int frame) { return renderer.frame(frame); }, range, target, held};
  }
  double trueError(int frame, const method::Setting& setting, const method::Setting& held = {}) {
    renderer.set(held);
    const image::Image full = renderer.frame(frame).color;
    renderer.set(setting);
    return relativeRms(renderer.frame(frame).color, full);
  }
  double work(const method::Setting& setting) {
    renderer.set(setting);
    return renderer.work();
  }
  // The least work of all settings that meet the tolerance in these frames.
  double leastWork(double tolerance, const std::vector<int>& frames) {
    double least = std::numeric_limits<double>::infinity();
    for (int code = 0; code < 64; ++code) {
      const method::Setting setting{{"a", 1 + code % 4}, {"b", 1 + code / 4 % 4}, {"c", 1 + code / 16}};
      if (std::ranges::all_of(frames, [&](int frame) { return trueError(frame, setting) <= tolerance; }))
        least = std::min(least, work(setting));
    }
    return least;
  }
  // Expects all frames within the tolerance; returns the sum of their work.
  double expectWithin(double tolerance) {
    Controller controller = controllerOf({Target::Kind::tolerance, tolerance});
    double total = 0;
    for (int frame = range.first; frame <= range.last; ++frame) {
      const Choice choice = controller.choose(frame);
      EXPECT_LE(trueError(frame, choice.setting), 1.0001 * tolerance) << frame;
      total += work(choice.setting);
    }
    return total;
  }
};

TEST_F(Film, TheCheapestSettingWithinTheToleranceIsChosen) {
  for (const double tolerance : {0.003, 0.006, 0.01, 0.02})
    EXPECT_NEAR(expectWithin(tolerance), 100 * leastWork(tolerance, {1}), 1e-6);
}

TEST_F(Film, ErrorsThatAddUpAreFoundByMeasuring) {
  renderer.areErrorsAlike = true;
  for (const double tolerance : {0.0035, 0.0065, 0.011, 0.021})
    EXPECT_LE(expectWithin(tolerance), 1.1 * 100 * leastWork(tolerance, {1}));
}

TEST_F(Film, ErrorsThatRiseAlongTheFilmAreFollowed) {
  renderer.error = [](size_t knob, double value, int frame) {
    return 0.002 * (4 - value) / double(knob + 1) * (1 + 0.004 * frame);
  };
  range.last = 500;
  double best = 0;
  for (int frame = 5; frame <= 500; frame += 10) best += 10 * leastWork(0.01, {frame});
  EXPECT_LE(expectWithin(0.01), 1.25 * best);
}

TEST_F(Film, EffectsOfAnotherFrameDoNotMislead) {
  renderer.error = [](size_t knob, double value, int frame) { // another knob is the better one off the middle
    const bool isMiddle = std::abs(frame - 65) < 8;
    return 0.004 * (4 - value) / double(isMiddle ? knob + 1 : 3 - knob) * (isMiddle ? 0.2 : 1);
  };
  EXPECT_LE(expectWithin(0.01), 1.25 * 100 * leastWork(0.01, {1}));
}

TEST_F(Film, AJumpOfTheErrorDividesTheStretch) {
  renderer.error = [](size_t knob, double value, int frame) {
    return 0.004 * (4 - value) / double(knob + 1) * (frame >= 12 && frame < 33 ? 3 : 1);
  };
  Controller controller = controllerOf({Target::Kind::tolerance, 0.01});
  size_t within = 0;
  for (int frame = 1; frame <= 100; ++frame)
    within += trueError(frame, controller.choose(frame).setting) <= 0.01;
  EXPECT_GE(within, 98u) << "a jump between two measured frames shows after at most three frames";
  EXPECT_LT(controller.choose(90).setting, controller.choose(20).setting) << "faster where it may be";
}

TEST_F(Film, ErrorsThatScatterAreKeptLower) {
  std::mt19937 random(1);
  std::vector<double> factors(257); // of each frame, for all knobs
  for (double& factor : factors) factor = std::exp(std::normal_distribution<double>(0, 0.4)(random));
  renderer.error = [&](size_t knob, double value, int frame) {
    return 0.004 * (4 - value) / double(knob + 1) * factors[size_t(frame)];
  };
  range.last = 256;
  for (const double tolerance : {0.006, 0.012, 0.025}) {
    Controller controller = controllerOf({Target::Kind::tolerance, tolerance});
    size_t within = 0;
    for (int frame = 1; frame <= 256; ++frame)
      within += trueError(frame, controller.choose(frame).setting) <= 1.2 * tolerance;
    EXPECT_GE(within, 0.95 * 256);
    EXPECT_LT(work(controller.choose(200).setting), 100);
    EXPECT_LT(controller.probes(), 350u);
  }
}

TEST_F(Film, PredictedErrorsAreTrueWhereTheErrorIsLinear) {
  renderer.error = [](size_t knob, double value, int frame) {
    return 0.004 * (4 - value) / double(knob + 1) * (1 + 0.002 * frame);
  };
  Controller controller = controllerOf({Target::Kind::tolerance, 0.01});
  for (int frame = 1; frame <= 100; frame += 7) {
    const Choice choice = controller.choose(frame);
    EXPECT_NEAR(choice.predictedError, trueError(frame, choice.setting), 1e-5);
  }
}

TEST_F(Film, AChoiceDependsOnTheFilmAlone) {
  renderer.areErrorsAlike = true;
  renderer.error = [](size_t knob, double value, int frame) {
    return 0.003 * (4 - value) / double(knob + 1) * (1.5 + std::sin(0.1 * frame * double(knob + 1)));
  };
  range.last = 300;
  const Target target{Target::Kind::tolerance, 0.01};
  Controller forwards = controllerOf(target), backwards = controllerOf(target);
  std::map<int, Choice> choices;
  for (int frame = 1; frame <= 300; ++frame) choices[frame] = forwards.choose(frame);
  for (int frame = 300; frame >= 1; --frame) {
    const Choice choice = backwards.choose(frame);
    EXPECT_EQ(choice.setting, choices[frame].setting) << frame;
    EXPECT_EQ(choice.predictedError, choices[frame].predictedError) << frame;
  }
  for (int frame = 1; frame <= 300; frame += 23)
    EXPECT_EQ(controllerOf(target).choose(frame).setting, choices[frame].setting) << frame;
}

TEST_F(Film, ProbesAreFewBesideTheFilm) {
  range.last = 1280;
  Controller controller = controllerOf({Target::Kind::tolerance, 0.01});
  for (int frame = 1; frame <= 1280; ++frame) controller.choose(frame);
  EXPECT_LT(controller.probes(), 550u);
}

TEST_F(Film, HeldKnobsKeepTheirValuesAndErrorsAreRelativeToThem) {
  const method::Setting held{{"b", 1}};
  Controller controller = controllerOf({Target::Kind::tolerance, 0.005}, held);
  const Choice choice = controller.choose(50);
  EXPECT_EQ(choice.setting.at("b"), 1);
  EXPECT_GT(choice.setting.size(), 1u);
  EXPECT_LE(trueError(50, choice.setting, held), 0.005);
  EXPECT_THROW(controllerOf({Target::Kind::tolerance, 1}, {{"d", 1}}), Error);
}

TEST_F(Film, NothingIsRenderedWhereThereIsNothingToChoose) {
  EXPECT_EQ(controllerOf({Target::Kind::tolerance, 0}).choose(7).setting, method::Setting{});
  renderer.names.clear();
  EXPECT_EQ(controllerOf({Target::Kind::tolerance, 0.1}).choose(7).setting, method::Setting{});
  EXPECT_EQ(controllerOf({Target::Kind::milliseconds, 1}).choose(7).setting, method::Setting{});
  EXPECT_EQ(renderer.frames, 0);
}

TEST_F(Film, OneFrameIsAFilm) {
  range = {5, 5};
  EXPECT_NEAR(expectWithin(0.01), leastWork(0.01, {5}), 1e-6);
}

TEST_F(Film, ARendererThatReportsNoWorkIsRefused) {
  renderer.isTimed = false;
  EXPECT_THROW(controllerOf({Target::Kind::tolerance, 0.01}).choose(1), Error);
}

TEST_F(Film, ABudgetGetsTheMostAccurateSettingThatIsFastEnough) {
  for (const double milliseconds : {20e3, 40e3, 70e3}) {
    double least = std::numeric_limits<double>::infinity();
    for (int code = 0; code < 64; ++code) {
      const method::Setting setting{{"a", 1 + code % 4}, {"b", 1 + code / 4 % 4}, {"c", 1 + code / 16}};
      if (1e3 * work(setting) <= milliseconds) least = std::min(least, trueError(3, setting));
    }
    const method::Setting chosen = controllerOf({Target::Kind::milliseconds, milliseconds}).choose(3).setting;
    EXPECT_LE(1e3 * work(chosen), milliseconds);
    EXPECT_NEAR(trueError(3, chosen), least, 1e-6);
  }
  EXPECT_EQ(controllerOf({Target::Kind::milliseconds, 200e3}).choose(3).setting, method::Setting{});
  EXPECT_EQ(controllerOf({Target::Kind::milliseconds, 0.1}).choose(3).setting,
            (method::Setting{{"a", 1}, {"b", 1}, {"c", 1}}))
      << "the fastest, if none is fast enough";
}

} // namespace

} // namespace surflect::control
