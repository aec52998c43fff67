#include "render/chart/front.h"
#include "render/chart/make_chart.h"
#include "render/chart/measurements.h"
#include "render/chart/samples.h"
#include "render/chart/subject.h"

#include "srf/capture/capture.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"
#include "tests/support/synthetic_capture.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <set>

namespace surflect::chart {
namespace {

const std::vector<method::Option> kKnobs = {
    {.name = "a", .domain = method::Range{1, 3}, .standard = 3, .sweep = {3, 2, 1}},
    {.name = "b", .domain = method::Range{0, 1}, .standard = 1, .sweep = {1, 0.5}}};

TEST(ChartSettings, CombinationsHoldEveryPairOnce) {
  const auto all = combinations(kKnobs);
  EXPECT_EQ(all.size(), 6u);
  EXPECT_EQ(std::set(all.begin(), all.end()).size(), 6u);
  EXPECT_EQ(all.front(), (method::Setting{{"a", 3}, {"b", 1}}));
  EXPECT_EQ(withoutFull(kKnobs, all.front()), method::Setting());
  EXPECT_EQ(withoutFull(kKnobs, {{"a", 2}, {"b", 1}}), (method::Setting{{"a", 2}}));
}

TEST(ChartSettings, OneByOneTurnsASingleKnob) {
  EXPECT_EQ(oneByOne(kKnobs), (std::vector<method::Setting>{{}, {{"a", 2}}, {{"a", 1}}, {{"b", 0.5}}}));
}

// b saves as much as a step of a, at a tenth of the error, so that it is taken first.
TEST(ChartSettings, DescentTakesTheStepThatSavesMostWorkForItsError) {
  const auto cost = [](const method::Setting& setting) {
    const double a = setting.contains("a") ? 3 - setting.at("a").number() : 0,
                 b = setting.contains("b") ? 1 : 0;
    return Cost{100 - 20 * a - 20 * b, 0.1 * a + 0.01 * b};
  };
  EXPECT_EQ(descent(kKnobs, 20, cost),
            (std::vector<method::Setting>{{{"b", 0.5}}, {{"a", 2}, {"b", 0.5}}, {{"a", 1}, {"b", 0.5}}}));
  EXPECT_EQ(descent(kKnobs, 1, cost).size(), 1u);
  EXPECT_EQ(longestDescent(kKnobs, 20), 3u);
}

TEST(ChartSettings, DescentEndsWhereNothingSavesWork) {
  const auto cost = [](const method::Setting& setting) {
    return Cost{setting.contains("a") ? 90. : 100., 0};
  };
  EXPECT_EQ(descent(kKnobs, 20, cost), (std::vector<method::Setting>{{{"a", 2}}}));
}

std::vector<Point> randomPoints(unsigned seed, size_t count) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> grid(1, 9); // with ties
  std::vector<Point> points(count);
  for (size_t i = 0; i < count; ++i) {
    points[i].setting = {{"a", static_cast<double>(i)}};
    points[i].milliseconds = grid(random);
    points[i].rest.psnrSrgbDb = grid(random);
    points[i].rmsToFull = 0.005 * grid(random);
  }
  return points;
}

TEST(ChartFront, EveryOtherPointIsBeatenByAPointOfTheFront) {
  std::vector<Point> points = randomPoints(1, 60);
  markFront(points);
  const auto atLeast = [](const Point& a, const Point& b) {
    return a.milliseconds <= b.milliseconds && a.rest.psnrSrgbDb >= b.rest.psnrSrgbDb;
  };
  for (const Point& point : points) {
    const auto better = [&](const Point& other) {
      return other.isOnFront && atLeast(other, point) && !atLeast(point, other);
    };
    EXPECT_EQ(std::ranges::any_of(points, better), !point.isOnFront);
  }
}

TEST(ChartFront, KneeIsWhereTheErrorsBegin) {
  std::vector<Point> points(5);
  const double times[] = {1, 2, 4, 8, 1.5}, errors[] = {0.5, 0.02, 0.01, 0, 0.6}; // the last is beaten
  for (size_t i = 0; i < 5; ++i) points[i].milliseconds = times[i], points[i].rmsToFull = errors[i];
  EXPECT_EQ(kneeOf(points, points[0].model), 1u);
}

TEST(ChartFront, FullPreviewKneeAndNearlyExactAreChosen) {
  std::vector<Point> points = randomPoints(2, 40);
  points[7].setting = {};
  points[3].name = kPreviewName;
  markChosen(points);
  EXPECT_TRUE(points[7].isChosen);
  EXPECT_TRUE(points[3].isChosen);
  EXPECT_TRUE(points[kneeOf(points, points[0].model)].isChosen);
  double least = 1e9;
  for (const Point& point : points)
    if (point.rmsToFull <= 0.01) least = std::min(least, point.milliseconds);
  EXPECT_TRUE(std::ranges::any_of(points, [&](const Point& point) {
    return point.isChosen && point.rmsToFull <= 0.01 && point.milliseconds == least;
  }));
  EXPECT_LE(std::ranges::count_if(points, &Point::isChosen), 4);
}

TEST(ChartMeasurements, ComeBackToTheBitAndSurviveDamage) {
  const image::TemporaryFolder folder;
  const auto file = folder / "measurements.jsonl";
  const Accuracy accuracy{
      {1 / 3., std::numeric_limits<double>::infinity(), 0.1, 0.2}, std::nullopt, 1e-300, 5, 7};
  const Timing timing{0.1, {{"splat", 1 / 7.}}};
  {
    Measurements measurements(file);
    EXPECT_FALSE(measurements.accuracy("x"));
    measurements.keep("x", accuracy);
    measurements.keep("x", timing);
    measurements.keep("y", Cost{1, 2});
    Accuracy black;
    black.rmsToFull = std::numeric_limits<double>::infinity();
    measurements.keep("black", black);
  }
  const std::string text = readFile(file);
  {
    const Measurements again(file);
    const Accuracy read = *again.accuracy("x");
    EXPECT_EQ(read.rest.psnrLinearDb, accuracy.rest.psnrLinearDb);
    EXPECT_EQ(read.rest.psnrSrgbDb, accuracy.rest.psnrSrgbDb);
    EXPECT_EQ(read.rmsToFull, accuracy.rmsToFull);
    EXPECT_EQ(read.memoryBytes, 7u);
    EXPECT_FALSE(read.bent);
    EXPECT_EQ(again.timing("x")->stages, timing.stages);
    EXPECT_EQ(again.cost("y")->error, 2);
    EXPECT_TRUE(std::isinf(again.accuracy("black").value().rmsToFull)) << "full is black";
    EXPECT_FALSE(again.accuracy("y"));
  }
  const std::string deep(1000000, '[');
  std::ofstream(file, std::ios::binary) << text << "{\"of\":\"y\",\"cost\":" << deep << "\n";
  EXPECT_EQ(Measurements(file).cost("y")->error, 2);
  for (size_t end = 0; end < text.size(); end += 7) {
    std::ofstream(file, std::ios::binary)
        << text.substr(0, end) << "\n[1]\n{\"of\":3}\n{\"of\":\"z\",\"cost\":{}}\n";
    const Measurements damaged(file);
    const auto read = damaged.accuracy("x");
    if (read) {
      EXPECT_EQ(read->rest.psnrLinearDb, accuracy.rest.psnrLinearDb);
    }
    EXPECT_FALSE(damaged.cost("z"));
  }
}

TEST(ChartSamples, RampsStayRampsWhenEnlarged) {
  image::Image small(8, 5, 4);
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 8; ++x)
      for (size_t c = 0; c < 4; ++c) small.at(x, y)[c] = static_cast<float>(x + 10 * y) + 0.5f;
  const image::Image large = enlarged(small, 24, 20);
  for (int y = 4; y < 16; ++y) // borders repeat
    for (int x = 3; x < 21; ++x)
      EXPECT_NEAR(large.at(x, y)[2], (x + 0.5) / 3 - 0.5 + 10 * ((y + 0.5) / 4 - 0.5) + 0.5, 1e-4);
}

TEST(ChartSamples, RelativeRmsIgnoresAlphaAndScalesWithTheDifference) {
  image::Image a(2, 1, 4), b = a;
  b.values = {1, 2, 2, 1, 0, 0, 0, 0};
  a.values = {1.1f, 2.2f, 2.2f, 0.5f, 0, 0, 0, 1};
  RelativeRms rms;
  rms.add(b, b);
  EXPECT_EQ(rms.value(), 0);
  rms.add(a, b);
  EXPECT_NEAR(rms.value(), 0.1 / std::sqrt(2), 1e-6);
}

// A small sphere with two cameras held out.
class ChartOfASphere : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    studio::Studio studio{.cameras = 6, .lights = 6, .size = 20};
    studio.split = [](size_t view, size_t) {
      return view < 2 ? capture::Split::test : capture::Split::train;
    };
    packed = std::make_unique<studio::PackedStudio>(studio, 400);
  }
  static void TearDownTestSuite() { packed.reset(); }

  static ChartOptions options() {
    ChartOptions options;
    options.settings["surfels"] = {{"interpolation", "separate"}}; // its knobs matter under lamps too
    options.frames = 3;
    options.timedFrames = 1;
    options.rounds = 1;
    options.machine = "test";
    options.commandOf = [](const std::filesystem::path&, const method::Setting& setting) {
      return "chart \"" + method::textOf(setting) + "\"";
    };
    options.announce = [](std::string_view) {};
    return options;
  }
  static std::filesystem::path emptyFolder(const char* name) {
    const auto folder = packed->folder / name;
    std::filesystem::create_directories(folder);
    return folder;
  }
  static Chart chartIn(const char* folder, const ChartOptions& options, const Progress& progress = {}) {
    return makeChart({packed->model.folder}, packed->capture, std::nullopt, emptyFolder(folder), options,
                     progress);
  }

  static inline std::unique_ptr<studio::PackedStudio> packed;
};

TEST_F(ChartOfASphere, HoldsTheSweepWithFullFirst) {
  ChartOptions asked = options();
  asked.sweep = {{"cameras", {1}}, {"scale", {0.5}}};
  const Chart chart = chartIn("sweep", asked);
  ASSERT_EQ(chart.points.size(), 4u);
  EXPECT_EQ(chart.restFrames, 3u);
  EXPECT_EQ(chart.restHeldOut, 12u);
  EXPECT_EQ(chart.points[0].setting, method::Setting());
  EXPECT_EQ(chart.points[0].rmsToFull, 0);
  for (const Point& point : chart.points) {
    EXPECT_EQ(point.setting.empty(), point.rmsToFull == 0);
    EXPECT_GT(point.rest.psnrLinearDb, 10);
    EXPECT_TRUE(point.rest.ssim > 0 && point.rest.ssim < 1);
    EXPECT_TRUE(point.rest.flip > 0 && point.rest.flip < 0.5);
    EXPECT_GT(point.milliseconds, 0);
    EXPECT_FALSE(point.stages.empty());
    EXPECT_GT(point.bytesRead, 0);
    EXPECT_GT(point.modelBytes, 1000u);
  }
  EXPECT_TRUE(std::ranges::any_of(chart.points, &Point::isOnFront));
  EXPECT_TRUE(chart.points[0].isChosen);
  ASSERT_FALSE(chart.panels.empty());
  for (const Panel& panel : chart.panels) EXPECT_TRUE(panel.errorPng.starts_with("\x89PNG"));

  const std::string csv = csvOf(chart);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 5);
  EXPECT_NE(csv.find("\"chart \"\"full\"\"\""), std::string::npos);
}

// Photographs that are said to be deformed by no more than nothing.
TEST_F(ChartOfASphere, DeformedFramesAreScoredLikeThoseAtRest) {
  ChartOptions asked = options();
  asked.onlyGiven = true;
  const auto folder = emptyFolder("bent");
  const auto script = folder / "warp.toml";
  std::ofstream(script) << "[[warp]]\ntype = \"twist\"\naxis = [0, 0, 1]\nangle_deg = 0\n";
  const Chart chart = makeChart({packed->model.folder}, packed->capture,
                                BentTruth{packed->capture, script, 1}, folder, asked, {});
  EXPECT_EQ(chart.bentFrames, 3u);
  ASSERT_TRUE(chart.points[0].bent);
  EXPECT_NEAR(chart.points[0].bent->psnrLinearDb, chart.points[0].rest.psnrLinearDb, 0.1);
  EXPECT_EQ(chart.panels.size(), 2u);
}

TEST_F(ChartOfASphere, SecondRunMeasuresNothingAgain) {
  ChartOptions asked = options();
  asked.sweep = {{"cameras", {1}}};
  const Chart first = chartIn("again", asked);
  const std::string kept = readFile(packed->folder / "again" / "measurements.jsonl");
  EXPECT_EQ(csvOf(chartIn("again", asked)), csvOf(first));
  EXPECT_EQ(readFile(packed->folder / "again" / "measurements.jsonl"), kept);
  const Chart elsewhere = chartIn("elsewhere", asked);
  for (size_t i = 0; i < first.points.size(); ++i) {
    EXPECT_EQ(elsewhere.points[i].rest.psnrLinearDb, first.points[i].rest.psnrLinearDb);
    EXPECT_EQ(elsewhere.points[i].rest.flip, first.points[i].rest.flip);
    EXPECT_EQ(elsewhere.points[i].rmsToFull, first.points[i].rmsToFull);
    EXPECT_EQ(elsewhere.points[i].bytesRead, first.points[i].bytesRead);
  }
}

// A descent asks no clock: a chart in another folder finds the same settings.
TEST_F(ChartOfASphere, DescentsAreEqual) {
  ChartOptions asked = options();
  asked.descentSteps = 4;
  std::vector<std::vector<method::Setting>> settings;
  for (const char* name : {"descent", "descent again"}) {
    Measurements measurements(emptyFolder(name) / "measurements.jsonl");
    Subject subject(packed->model.folder, packed->capture, std::nullopt, asked, measurements, {});
    const size_t before = subject.settings().size();
    subject.descend({});
    EXPECT_GT(subject.settings().size(), before);
    settings.push_back(subject.settings());
  }
  EXPECT_EQ(settings[0], settings[1]);
}

// Lights stand in the capture, not in the model or in the photographs.
TEST_F(ChartOfASphere, LightsThatMovedAreMeasuredAgain) {
  ChartOptions asked = options();
  asked.onlyGiven = true;
  const Chart before = chartIn("moved", asked);
  capture::Capture capture = packed->capture;
  for (capture::Light& light : capture.lights)
    if (auto* directional = std::get_if<capture::DirectionalLight>(&light.kind))
      directional->towards = normalized(directional->towards + Direction3<AcquisitionSpace, double>(0, 0, 1));
  const Chart after =
      makeChart({packed->model.folder}, capture, std::nullopt, emptyFolder("moved"), asked, {});
  EXPECT_NE(after.points[0].rest.psnrLinearDb, before.points[0].rest.psnrLinearDb);
}

TEST_F(ChartOfASphere, InterruptedRunGoesOn) {
  ChartOptions asked = options();
  asked.sweep = {{"cameras", {2, 1}}};
  Progress progress;
  bool stop = false;
  progress.report = [&](std::string_view stage, double fraction) {
    stop = stage == "accuracy" && fraction > 0.5;
  };
  progress.cancelled = [&] { return stop; };
  EXPECT_THROW(chartIn("stopped", asked, progress), Cancelled);
  const std::string kept = readFile(packed->folder / "stopped" / "measurements.jsonl");
  EXPECT_EQ(std::ranges::count(kept, '\n'), 2);
  const Chart chart = chartIn("stopped", asked);
  EXPECT_EQ(chart.points.size(), 3u);
  EXPECT_TRUE(readFile(packed->folder / "stopped" / "measurements.jsonl").starts_with(kept));
}

TEST_F(ChartOfASphere, WithoutKnobsAllAreTriedAloneAndTogether) {
  ChartOptions asked = options();
  asked.descentSteps = 1;
  std::string said;
  asked.announce = [&](std::string_view line) { said += fmt::format("{}\n", line); };
  const Chart chart = chartIn("all", asked);
  for (const method::Option& knob : chart.knobs)
    for (const method::Value& value : knob.sweep) {
      const bool isFull = value == knob.sweep.front();
      const method::Setting alone = isFull ? method::Setting() : method::Setting{{knob.name, value}};
      // No frame has an environment, and no patch enough surfels for corners.
      const bool isIdle = knob.name == "environment_error" || knob.name == "patch";
      const long expected = isIdle && !isFull ? 0 : 1;
      EXPECT_EQ(std::ranges::count(chart.points, alone, &Point::setting), expected) << method::textOf(alone);
    }
  EXPECT_TRUE(said.ends_with(": no effect on these frames: environment_error, patch\n")) << said;
  EXPECT_EQ(chart.idleKnobs.at(packed->model.folder),
            (std::vector<std::string>{"environment_error", "patch"}));
}

TEST_F(ChartOfASphere, OnlyTheGivenValuesStandAlone) {
  ChartOptions asked = options();
  asked.onlyGiven = true;
  EXPECT_EQ(chartIn("full", asked).points.size(), 1u);
  asked.sweep = {{"cameras", {1}}, {"lights", {2}}};
  const Chart chart = chartIn("only", asked);
  ASSERT_EQ(chart.points.size(), 1u);
  EXPECT_EQ(chart.points[0].setting, (method::Setting{{"cameras", 1}, {"lights", 2}}));
  EXPECT_GT(chart.points[0].rmsToFull, 0);
}

TEST_F(ChartOfASphere, SweepsWithoutEndAreRefused) {
  ChartOptions asked = options();
  for (const char* knob : {"cameras", "lights", "scale"}) {
    asked.sweep.push_back({knob, {}});
    for (int i = 1; i <= 1000; ++i) asked.sweep.back().values.push_back(i);
  }
  EXPECT_THROW(chartIn("endless", asked), Error);
}

TEST_F(ChartOfASphere, UnknownKnobsAndValuesAreRefused) {
  for (const method::Sweep& wrong :
       std::vector<method::Sweep>{{"colour", {1}}, {"cameras", {99}}, {"scale", {2}}}) {
    ChartOptions asked = options();
    asked.sweep = {wrong};
    EXPECT_THROW(chartIn("wrong", asked), Error) << wrong.name;
  }
}

} // namespace
} // namespace surflect::chart
