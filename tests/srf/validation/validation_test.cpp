#include "srf/validation/validation.h"

#include "srf/capture/origin.h"
#include "srf/image/png.h"
#include "tests/support/synthetic_capture.h"

#include <numeric>

namespace surflect::validation {
namespace {

using Severity = Finding::Severity;
using studio::Studio;

// Capture, mesh and photographs of the Lambert sphere.
class Checks : public ::testing::Test {
protected:
  Checks() {
    capture = studio::photograph({.cameras = 10, .lights = 24, .size = 64}, folder.path());
    mesh = readMesh(folder / "mesh.ply");
  }

  std::vector<Finding> findings() const { return checkCapture(capture, mesh, {}, {}); }
  std::vector<ViewMeasures> measures() const {
    std::vector<ViewMeasures> measures;
    forEachSmallView(capture, RayCaster<AcquisitionSpace>(mesh), {0, 0, 0}, 100, {},
                     [&](const SmallView& view) { measures.push_back(measure(capture, view)); });
    return measures;
  }
  // The text of the only finding.
  std::string only(Severity severity) const {
    const auto all = findings();
    for (const Finding& finding : all) SCOPED_TRACE(finding.text);
    EXPECT_EQ(all.size(), 1u) << (all.size() > 1 ? all[1].text : "");
    if (all.empty()) return "";
    EXPECT_EQ(all[0].severity, severity);
    return all[0].text;
  }
  template <class Change> void changeDirections(const Change& change) {
    for (capture::Light& light : capture.lights) {
      auto& towards = std::get<capture::DirectionalLight>(light.kind).towards;
      towards = assume<Direction3<AcquisitionSpace, double>>(change(towards.raw()));
    }
  }

  image::TemporaryFolder folder;
  capture::Capture capture;
  TriangleMesh mesh;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(Checks, FindNothingInACaptureThatIsRight) {
  for (const Finding& finding : findings()) ADD_FAILURE() << finding.text;
}

TEST_F(Checks, FindPosesWithoutAMesh) {
  EXPECT_TRUE(checkPoses(capture).empty());
  const capture::Capture right = capture;
  const Mat3<double> visionAxes = Vec3<double>(1, -1, -1).asDiagonal();
  for (capture::View& view : capture.views) {
    auto& pose = view.camera.cameraFromWorld;
    pose = {visionAxes * pose.rotation(), visionAxes * pose.translation()};
  }
  const auto turned = checkPoses(capture);
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_EQ(turned[0].severity, Severity::error);
  EXPECT_TRUE(contains(turned[0].text, "10 of 10 cameras look away"));
  EXPECT_TRUE(contains(turned[0].text, "OpenGL's axes"));

  capture = right;
  auto& pose = capture.views[3].camera.cameraFromWorld;
  pose = {pose.rotation(), 1000 * pose.translation()};
  const auto far = checkPoses(capture);
  ASSERT_EQ(far.size(), 1u);
  EXPECT_EQ(far[0].severity, Severity::warning);
  EXPECT_TRUE(contains(far[0].text, "1 of 10 cameras"));
  EXPECT_TRUE(contains(far[0].text, capture.views[3].identity));

  capture.views.resize(2); // two axes may meet behind anybody
  EXPECT_TRUE(checkPoses(capture).empty());
}

TEST_F(Checks, FindCamerasThatAllStandAtOnePlace) {
  for (capture::View& view : capture.views) {
    const Mat3<double> rotation = view.camera.cameraFromWorld.rotation();
    view.camera.cameraFromWorld = {rotation, -rotation * Vec3<double>(1, 2, 3)};
  }
  const auto found = checkPoses(capture);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].text, "all 10 cameras stand at one place: are their positions missing?");
}

// A pixel covers 4 / focal length, 0.16 here; floats around 4,600,000 are 0.5 apart, around 50,000 0.004.
TEST_F(Checks, SayHowManyPixelsRoundingCostsFarFromTheOrigin) {
  EXPECT_TRUE(checkPoses(capture::countedFrom(capture, {0, -5000, 0})).empty());
  const auto near = checkPoses(capture::countedFrom(capture, {0, 0, 300000})),
             far = checkPoses(capture::countedFrom(capture, {500000, -4600000, 30}));
  ASSERT_EQ(near.size(), 1u);
  EXPECT_EQ(near[0].severity, Severity::warning);
  ASSERT_EQ(far.size(), 1u);
  EXPECT_EQ(far[0].severity, Severity::error);
  EXPECT_TRUE(contains(far[0].text,
                       "the scene lies at (-500000, 4600000, -30), where single precision is off by up to "))
      << far[0].text;
}

// Without masks, and under fixed light.
class Placement : public Checks {
protected:
  Placement() {
    capture = studio::photograph({.cameras = 14, .lights = 0, .size = 64, .matte = false}, folder / "bare");
  }
};

TEST_F(Placement, FindsNothingWhereTheMeshIsWhatPhotographsShow) {
  for (const Finding& finding : findings()) ADD_FAILURE() << finding.text;
}

TEST_F(Placement, FindsAMeshOfAnotherSize) {
  for (auto& p : mesh.positions) p = {0.5f * p.x(), 0.5f * p.y(), 0.5f * p.z()};
  // Shading that depends on the normal alone looks the same on spheres about one centre.
  EXPECT_TRUE(
      contains(only(Severity::warning), "the mesh may not lie where the photographs show it: they are "));
  for (size_t v = 0; v < capture.views.size(); ++v) {
    const auto checkered = [](const Vec3<float>& n) {
      return (1 + std::sin(9 * n[0]) * std::sin(9 * n[1] + 1) * std::sin(9 * n[2])) * Rgb{0.3f, 0.4f, 0.5f};
    };
    const std::string name = std::to_string(v) + ".exr";
    image::writeExr(folder / "bare" / name,
                    studio::shadeSphere(studio::viewSphere(capture.views[v].camera, 2), checkered));
    capture.frames[v].picture = name;
    capture.frames[v].layer = "";
  }
  EXPECT_TRUE(
      contains(only(Severity::error), "the mesh does not lie where the photographs show it: they are "));
  mesh = readMesh(folder / "mesh.ply");
  EXPECT_TRUE(findings().empty());
}

TEST_F(Checks, FindLightsThatAllStandInOneDirection) {
  for (capture::Light& light : capture.lights) light.kind = capture.lights[0].kind;
  const auto found = checkPoses(capture);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(contains(found[0].text, "lights stand in one direction, within a degree")) << found[0].text;
  capture.lights.resize(1);
  EXPECT_TRUE(checkPoses(capture).empty());
}

TEST_F(Checks, FindAnObjectThatIsThinInAllViews) {
  EXPECT_TRUE(checkThinness(measures()).empty());
  const auto stripes = [&](int width) {
    std::vector<ViewMeasures> views;
    forEachSmallView(capture, RayCaster<AcquisitionSpace>(mesh), {0, 0, 0}, 4, {}, [&](SmallView view) {
      image::Mask stripe(view.outline.width, view.outline.height);
      for (int y = 0; y < stripe.height; ++y)
        for (int x = 20; x < 20 + width; ++x) stripe.inside[static_cast<size_t>(y * stripe.width + x)] = 1;
      (view.matte ? *view.matte : view.outline) = stripe;
      views.push_back(measure(capture, view));
    });
    return views;
  };
  const auto found = checkThinness(stripes(2));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(contains(found[0].text, "thinner than three pixels in all 4 views"));
  EXPECT_TRUE(checkThinness(stripes(3)).empty());
  EXPECT_TRUE(checkThinness(stripes(0)).empty()); // that is told otherwise
  std::vector<ViewMeasures> some = stripes(2);
  some[0].isThin = false;
  EXPECT_TRUE(checkThinness(some).empty());
}

TEST_F(Checks, ABracketIsNeverOverexposed) { // it has no largest value
  capture::Capture bracketed = capture;
  for (capture::Frame& frame : bracketed.frames) frame.further.push_back({frame.picture, "", "", 2});
  forEachSmallView(capture, RayCaster<AcquisitionSpace>(mesh), {0, 0, 0}, 2, {},
                   [&](const SmallView& view) { EXPECT_EQ(measure(bracketed, view).clipped, 0); });
}

TEST_F(Checks, FindHalfFloatsAtTheirLargestValue) {
  capture = studio::photograph({.cameras = 5, .lights = 0, .size = 64}, folder / "fixed");
  image::Image picture(64, 64, 4);
  for (size_t i = 0; i < picture.values.size(); ++i) picture.values[i] = i % 4 == 3 ? 1.f : 65504.f;
  image::writeExr(folder / "fixed" / "full.exr", picture);
  capture.frames[2].picture = "full.exr";
  capture.frames[2].layer = capture.frames[2].alphaLayer = "";
  const auto found = checkExposures(capture, measures());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].text, "1 of 5 photographs are overexposed: C2 (100 % of the object)");
}

TEST_F(Checks, FindBlackAndOverexposedPhotographs) {
  capture = studio::photograph({.cameras = 10, .lights = 0, .size = 64}, folder / "fixed");
  for (const auto& [value, frame] : {std::pair(0.f, 3), std::pair(1.f, 5)}) {
    image::Image picture(64, 64, 4);
    for (size_t i = 0; i < picture.values.size(); ++i) picture.values[i] = i % 4 == 3 ? 1.f : value;
    const std::string name = std::to_string(frame) + ".png";
    image::writePng(folder / "fixed" / name, picture);
    capture.frames[static_cast<size_t>(frame)].picture = name;
    capture.frames[static_cast<size_t>(frame)].layer = capture.frames[static_cast<size_t>(frame)].alphaLayer =
        "";
  }
  capture.colorSpace = capture::ColorSpace::linear;
  const auto found = checkExposures(capture, measures());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].text, "1 of 10 photographs are black: C3");
  EXPECT_EQ(found[1].text, "1 of 10 photographs are overexposed: C5 (100 % of the object)");
}

TEST_F(Checks, FloatingPointIsNeverOverexposed) {
  capture = studio::photograph({.cameras = 2, .lights = 0, .size = 64}, folder / "fixed");
  capture.colorSpace = capture::ColorSpace::linear;
  for (capture::Frame& frame : capture.frames) {
    frame.picture = "A.EXR";
    frame.layer = frame.alphaLayer = "";
  }
  image::writeExr(folder / "fixed/A.EXR", image::randomImage(64, 64, 3, 1, 1, 1));
  EXPECT_TRUE(checkExposures(capture, measures()).empty());
}

TEST_F(Checks, FindThatAllPhotographsAreBlack) {
  for (capture::Frame& frame : capture.frames) {
    frame.picture = "black.exr";
    frame.layer = frame.alphaLayer = "";
  }
  image::writeExr(folder / "black.exr", image::Image(64, 64, 3));
  const auto found = checkExposures(capture, measures());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::error);
  EXPECT_EQ(found[0].text, "all 10 photographs are black");
}

TEST_F(Checks, ReadAsManyMasksAsTheyMay) {
  for (size_t f = 0; f < capture.frames.size(); ++f)
    capture.frames[f].mask = std::to_string(f + 100) + ".png";
  for (const char* read : {"100.png", "220.png"})
    image::writePng(folder / read, image::Image(64, 64, 1)); // of 240
  for (const char* read : {"112.png", "232.png"}) // two mattes of each of the two views are compared
    image::writePng(folder / read, image::Image(64, 64, 1));
  const auto found = checkMattes(capture, {.views = 2}, {});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(contains(found[0].text, "2 of 2 masks show nothing of the object")) << found[0].text;
}

// One view has no middle of the scene but the mesh's.
TEST_F(Checks, SayWhatRoundingCostsASingleView) {
  const Vec3<double> origin(500000, -4600000, 30);
  capture = capture::countedFrom(
      capture::subset(capture, [](const capture::Frame& frame) { return frame.view == 0; }), origin);
  EXPECT_TRUE(checkPoses(capture).empty());
  for (auto& p : mesh.positions)
    p = assume<Point3<AcquisitionSpace>>(Vec3<double>(p.cast<double>().raw() - origin));
  const auto all = findings();
  EXPECT_TRUE(std::ranges::any_of(all, [](const Finding& finding) {
    return finding.severity == Severity::error && contains(finding.text, "single precision is off");
  }));
}

TEST_F(Checks, FindAMeshThatLiesElsewhereUnderLights) {
  capture = studio::photograph({.cameras = 10, .lights = 24, .size = 64, .matte = false}, folder / "bare");
  EXPECT_TRUE(findings().empty());
  for (auto& p : mesh.positions) p = p + Direction3<AcquisitionSpace>(0, 0.9f, 0);
  const auto near = findings();
  ASSERT_FALSE(near.empty());
  EXPECT_EQ(near[0].severity, Severity::warning);
  EXPECT_TRUE(
      contains(near[0].text, "the mesh may not lie where the photographs show it: they are 0.9 times"))
      << near[0].text;
  for (auto& p : mesh.positions) p = p + Direction3<AcquisitionSpace>(0, 0, 1.2f);
  const std::string text = only(Severity::error);
  EXPECT_TRUE(contains(text, "the mesh does not lie where the photographs show it: they are 1.0 times") &&
              contains(text, "and shading correlates by 0.01 with its normals (expected 0.5)"))
      << text;
}

TEST_F(Checks, MeetLightsThatAViewIsTooRichFor) {
  std::swap(capture.lights[1].kind, capture.lights[13].kind); // of a dozen, every second is taken
  for (const bool everyLight : {false, true}) {
    const auto found =
        checkCapture(capture, mesh, {.litViews = 1, .lightsOfView = 12, .everyLight = everyLight}, {});
    EXPECT_EQ(found.size(), everyLight ? 1u : 0u);
  }
}

TEST_F(Checks, ReadSomeDozensOfPhotographsWhereTheyMustBeQuick) {
  changeDirections([](Vec3<double> d) { return Vec3<double>(d[0], -d[1], d[2]); });
  for (size_t f = 0; f < capture.frames.size(); ++f)
    if (capture.frames[f].view % 5 != 0) capture.frames[f].picture = "missing.exr"; // not read
  const auto found =
      checkCapture(capture, mesh, {.views = 2, .litViews = 2, .lightsOfView = 12, .everyLight = false}, {});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(contains(found[0].text, "light directions look negated in y")) << found[0].text;
}

TEST_F(Checks, FindNothingUnderFixedLight) {
  capture = studio::photograph({.lights = 0}, folder / "fixed");
  for (const Finding& finding : findings()) ADD_FAILURE() << finding.text;
}

TEST_F(Checks, FindNegatedAxes) {
  changeDirections([](Vec3<double> d) { return Vec3<double>(d[0], -d[1], d[2]); });
  EXPECT_TRUE(contains(only(Severity::error), "light directions look negated in y"));
  changeDirections([](Vec3<double> d) { return Vec3<double>(-d[0], -d[1], -d[2]); });
  EXPECT_TRUE(contains(only(Severity::error), "negated in x and z"));
}

TEST_F(Checks, FindExchangedAxes) {
  // The usual mistake: z up taken for y up, (x, y, z) written as (x, z, -y).
  changeDirections([](Vec3<double> d) { return Vec3<double>(d[0], d[2], -d[1]); });
  EXPECT_TRUE(contains(only(Severity::error), "(x, -z, y) fits better than (x, y, z)"));
}

TEST_F(Checks, FindLightsThatAreExchanged) {
  std::swap(capture.lights[2].kind, capture.lights[20].kind);
  EXPECT_TRUE(only(Severity::warning).starts_with("2 of 24 lights look exchanged: L2 and L20 (correlation "));
  std::swap(capture.lights[5].kind, capture.lights[9].kind);
  const std::string text = only(Severity::warning);
  EXPECT_TRUE(text.starts_with("4 of 24 lights look exchanged: ")) << text;
  EXPECT_TRUE(contains(text, "L2 and L20 (") && contains(text, "L5 and L9 (")) << text;
}

TEST_F(Checks, FindThreeLightsThatTookEachOthersPlace) { // no pair mends them
  const auto kind = capture.lights[2].kind;
  capture.lights[2].kind = capture.lights[12].kind;
  capture.lights[12].kind = capture.lights[21].kind;
  capture.lights[21].kind = kind;
  const std::string text = only(Severity::warning);
  EXPECT_TRUE(contains(text, "photographs of 3 of 24 lights look lit by another")) << text;
  EXPECT_TRUE(contains(text, "L2 by L21") && contains(text, "L12 by L2 ") && contains(text, "L21 by L12"))
      << text;
}

TEST_F(Checks, FindATableOfLightsInAnotherOrder) {
  const std::vector<capture::Light> right = capture.lights;
  const auto ordered = [&](const auto& sourceOf) {
    for (size_t l = 0; l < right.size(); ++l) capture.lights[l].kind = right[sourceOf(l)].kind;
    return only(Severity::error);
  };
  const std::string later = ordered([](size_t l) { return (l + 1) % 24; });
  EXPECT_TRUE(
      later.starts_with("the table of lights looks shifted by one: photographs of L1 look lit by L0, "))
      << later;
  const std::string earlier = ordered([](size_t l) { return (l + 23) % 24; });
  EXPECT_TRUE(
      earlier.starts_with("the table of lights looks shifted by one: photographs of L0 look lit by L1, "))
      << earlier;
  const std::string reversed = ordered([](size_t l) { return 23 - l; });
  EXPECT_TRUE(reversed.starts_with("the table of lights looks reversed: photographs of L0 look lit by L23, "))
      << reversed;
  // Line 2, named L10 as names sort by letters, has the vector of L2.
  std::vector<size_t> byLetters(24);
  std::iota(byLetters.begin(), byLetters.end(), size_t{0});
  std::ranges::sort(byLetters, {}, [&](size_t l) { return right[l].name; });
  const std::string sorted = ordered(
      [&](size_t l) { return static_cast<size_t>(std::ranges::find(byLetters, l) - byLetters.begin()); });
  EXPECT_TRUE(
      sorted.starts_with("the table of lights looks sorted as 1, 10, 2: photographs of L2 look lit by "
                         "L10, "))
      << sorted;
  // The other way round: names are in natural order, and vectors sorted by letters.
  const std::string natural = ordered([&](size_t l) { return byLetters[l]; });
  EXPECT_TRUE(natural.starts_with("the table of lights looks sorted as 1, 2, 10: photographs of L"))
      << natural;
}

TEST_F(Checks, CompareNoPairsOfVeryManyLights) { // which would take 320 GB
  capture.lights.resize(100000, capture.lights.back());
  for (const Finding& finding : findings()) ADD_FAILURE() << finding.text;
}

TEST_F(Checks, FindOtherUnitsOfPositionsOfLights) {
  // Shading of point lights, at four times the sphere's radius from its centre.
  for (capture::Light& light : capture.lights) {
    const auto towards = std::get<capture::DirectionalLight>(light.kind).towards;
    light.kind = capture::PointLight{
        assume<Point3<AcquisitionSpace, double>>(Vec3<double>(4 * towards.raw())), {16, 16, 16}};
  }
  for (size_t v = 0; v < capture.views.size(); ++v) {
    const studio::SphereView sphere = studio::viewSphere(capture.views[v].camera, 1);
    for (size_t l = 0; l < capture.lights.size(); ++l) {
      const std::string name = "near" + std::to_string(v) + "-" + std::to_string(l) + ".exr";
      image::writeExr(folder / name, studio::overBlack(sphere, [&](const Vec3<float>& n) {
                        const auto p = assume<Point3<AcquisitionSpace, double>>(n.cast<double>());
                        const Vec3<float> towards =
                            capture::towardsLight(capture.lights[l], p).raw().cast<float>();
                        return studio::lambert({0.5f, 0.5f, 0.5f},
                                               capture::irradianceAt(capture.lights[l], p), n, towards);
                      }));
      for (capture::Frame& frame : capture.frames)
        if (frame.view == v && frame.light == l) frame.picture = name, frame.layer = frame.alphaLayer = "";
    }
  }
  EXPECT_TRUE(findings().empty()) << findings()[0].text;
  const std::vector<capture::Light> right = capture.lights;
  const auto timesPositions = [&](double factor) { // in the file's coordinates
    for (size_t l = 0; l < right.size(); ++l) {
      const Vec3<double> place = std::get<capture::PointLight>(right[l].kind).position.raw();
      std::get<capture::PointLight>(capture.lights[l].kind).position =
          assume<Point3<AcquisitionSpace, double>>(
              Vec3<double>(factor * (place + capture.origin) - capture.origin));
    }
    std::string text;
    for (const Finding& finding : findings()) text += finding.text;
    return text;
  };
  const Vec3<double> stated = capture.origin;
  for (const Vec3<double>& moved : {Vec3<double>(0, 0, 0), Vec3<double>(0.4, -0.5, 0.3)}) {
    capture.origin = stated + moved;
    const std::string text = timesPositions(100);
    EXPECT_TRUE(contains(text, "positions of lights look about 100 times too far from the origin (are they "
                               "in centimetres, and the poses in metres?)"))
        << text;
    EXPECT_TRUE(contains(text, "multiply them by 0.01, and intensities by its square")) << text;
  }
  capture.origin = stated;
  EXPECT_TRUE(contains(timesPositions(0.3), "times too near the origin")) << timesPositions(0.3);
  EXPECT_TRUE(contains(timesPositions(1e5), "are their positions in other units?")) << timesPositions(1e5);
}

TEST_F(Checks, FindAPhotographThatIsOfNoLight) {
  for (capture::Frame& frame : capture.frames)
    if (frame.light == 7) {
      frame.picture = "flat.exr";
      frame.layer = frame.alphaLayer = "";
    }
  for (const float noise : {0.01f, 0.2f}) {
    image::writeExr(folder / "flat.exr", image::randomImage(64, 64, 3, 0.5f - noise, 0.5f + noise, 1));
    const std::string text = only(Severity::warning);
    EXPECT_TRUE(contains(text, "photographs of 1 of 24 lights do not follow") && contains(text, "L7 ("))
        << text;
  }
}

TEST_F(Checks, FindACameraThatLooksAway) {
  auto& pose = capture.views[4].camera.cameraFromWorld;
  const Mat3<double> turned = Eigen::AngleAxisd(2.5, Vec3<double>(0, 1, 0)).toRotationMatrix();
  pose = {turned * pose.rotation(), turned * pose.translation()};
  bool found = false;
  for (const Finding& finding : findings())
    found |= finding.severity == Severity::warning &&
             contains(finding.text, "1 of 10 cameras have none of the mesh in their picture") &&
             contains(finding.text, "C4 (143 degrees)");
  EXPECT_TRUE(found);
}

TEST_F(Checks, FindACameraThatIsSlightlyTurned) {
  auto& pose = capture.views[4].camera.cameraFromWorld;
  const Mat3<double> turned = Eigen::AngleAxisd(0.06, Vec3<double>(0, 1, 0)).toRotationMatrix();
  pose = {turned * pose.rotation(), turned * pose.translation()};
  const std::string text = only(Severity::warning);
  EXPECT_TRUE(contains(text, "the mesh and the masks differ in 1 of 10 views: C4 (")) << text;
}

TEST_F(Checks, FindOtherUnits) {
  for (const float scale : {1000.f, 1e-3f}) {
    for (auto& p : mesh.positions) p = {scale * p.x(), scale * p.y(), scale * p.z()};
    EXPECT_TRUE(contains(only(Severity::error), "units?")) << scale;
    for (auto& p : mesh.positions) p = {p.x() / scale, p.y() / scale, p.z() / scale};
  }
}

TEST_F(Checks, FindPointLightsThatAreTooNearOrTooFar) {
  for (capture::Light& light : capture.lights) {
    const auto towards = std::get<capture::DirectionalLight>(light.kind).towards;
    light.kind =
        capture::PointLight{assume<Point3<AcquisitionSpace, double>>(8 * towards.raw()), {10, 10, 10}};
  }
  EXPECT_TRUE(checkUnits(capture, mesh).empty());
  auto& position = std::get<capture::PointLight>(capture.lights[3].kind).position;
  position = {0.3, 0.2, 0.1};
  EXPECT_TRUE(contains(checkUnits(capture, mesh).at(0).text, "1 of 24 point lights stand within the box"));
  position = {1e4, 0, 0};
  EXPECT_TRUE(
      contains(checkUnits(capture, mesh).at(0).text, "1 of 24 point lights are more than 1000 times"));
}

TEST_F(Checks, SayHugeNumbersShortly) {
  for (capture::View& view : capture.views) view.camera.lens.focalX = view.camera.lens.focalY = 1e200;
  const auto found = checkUnits(capture, mesh);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(contains(found[0].text, "e+19")) << found[0].text;
  EXPECT_LT(found[0].text.size(), 150u);
}

TEST_F(Checks, FindMasksThatAreShifted) {
  const image::Image mask = [] {
    image::Image image(64, 64, 1);
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) image.at(x, y)[0] = std::hypot(x - 38.0, y - 32.0) < 25;
    return image;
  }();
  image::writePng(folder / "mask.png", mask);
  for (capture::Frame& frame : capture.frames) frame.mask = "mask.png";
  const auto found = checkMasks(capture, measures());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::error);
  EXPECT_TRUE(contains(found[0].text, "differ in 10 of 10 views")) << found[0].text;
}

TEST_F(Checks, FindFacesThatPointInwards) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_TRUE(contains(only(Severity::error), "the faces of the mesh point inwards: 100 %"));
}

TEST_F(Checks, StopWhenAskedTo) {
  const Progress progress{{}, [] { return true; }};
  EXPECT_THROW(checkCapture(capture, mesh, {}, progress), Cancelled);
}

// A Lambert dome in the middle of one orthographic view, under a ring of lights and one from the front.
class OneViewLights : public ::testing::Test {
protected:
  static constexpr int kSize = 96;

  OneViewLights() {
    capture.file = folder / "transforms.json";
    capture::Lens lens{.model = capture::Lens::Model::orthographic, .width = kSize, .height = kSize};
    lens.focalX = lens.focalY = kSize;
    lens.centerX = lens.centerY = kSize / 2.;
    capture.views = {{"front", {lens, {Mat3<double>::Identity(), Vec3<double>(0, 0, -2)}}}};
    for (int l = 0; l < 9; ++l) {
      const double azimuth = l * 0.8, tilt = l == 8 ? 0 : 0.4 + 0.05 * l;
      const Vec3<double> towards(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                                 std::cos(tilt));
      const std::string name = "L" + std::to_string(l);
      capture.lights.push_back(
          {name, name,
           capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}}});
      image::writePng(folder / (name + ".png"), picture(towards), 16);
      capture.frames.push_back(
          {.view = 0, .light = static_cast<size_t>(l), .picture = name + ".png", .mask = "mask.png"});
    }
    image::Image mask(kSize, kSize, 1);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) mask.at(x, y)[0] = normalAt(x, y) ? 1.f : 0;
    image::writePng(folder / "mask.png", mask);
  }
  static std::optional<Vec3<double>> normalAt(int x, int y) {
    const double nx = (x + 0.5 - kSize / 2.) / (0.4 * kSize), ny = (kSize / 2. - y - 0.5) / (0.4 * kSize);
    if (!(nx * nx + ny * ny < 0.97)) return std::nullopt;
    return Vec3<double>(nx, ny, std::sqrt(1 - nx * nx - ny * ny));
  }
  static image::Image picture(const Vec3<double>& towards) {
    image::Image image(kSize, kSize, 3);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        if (const auto n = normalAt(x, y))
          std::ranges::fill(image.at(x, y), static_cast<float>(0.7 * std::max(0.0, n->dot(towards))));
    return image;
  }
  std::string found(const Vec3<double>& signs, bool withMask = true) const {
    capture::Capture changed = capture;
    for (capture::Light& light : changed.lights) {
      auto& towards = std::get<capture::DirectionalLight>(light.kind).towards;
      towards = assume<Direction3<AcquisitionSpace, double>>(Vec3<double>(towards.raw().cwiseProduct(signs)));
    }
    if (!withMask)
      for (capture::Frame& frame : changed.frames) frame.mask.clear();
    std::string text;
    for (const Finding& finding : checkLightsOfOneView(changed, {0, 0, 0}, {}, {}))
      text += std::string(finding.severity == Severity::error ? "error: " : "warning: ") + finding.text;
    return text;
  }

  image::TemporaryFolder folder;
  capture::Capture capture;
};

TEST_F(OneViewLights, TellsDirectionsByWhatTheCameraSees) {
  for (const bool withMask : {true, false}) EXPECT_EQ(found({1, 1, 1}, withMask), "");
  EXPECT_TRUE(found({-1, -1, -1}).starts_with("error: light directions look negated in x, y and z: "));
  EXPECT_TRUE(found({1, 1, -1}).starts_with("error: light directions look negated in z: "));
  EXPECT_TRUE(found({-1, -1, 1}).starts_with("warning: light directions look negated in x and y: "));
  for (const Vec3<double>& signs : {Vec3<double>(-1, -1, -1), Vec3<double>(1, 1, -1)})
    EXPECT_TRUE(
        found(signs, false).starts_with("error: light directions look negated in z, or in x, y and z: "));
}

TEST_F(OneViewLights, OfAnyMadeGeometryStopsTheWork) {
  for (const bool isRelief : {false, true}) {
    for (const bool isRight : {true, false}) {
      capture::Capture changed = capture;
      for (capture::Light& light : changed.lights) {
        auto& towards = std::get<capture::DirectionalLight>(light.kind).towards;
        if (!isRight) towards = assume<Direction3<AcquisitionSpace, double>>(Vec3<double>(-towards.raw()));
      }
      const proxy::Impostor impostor = proxy::impostorOfOneView(capture, isRelief, {});
      size_t errors = 0;
      const auto take = [&](std::span<const Finding> findings) {
        for (const Finding& finding : findings) errors += finding.severity == Severity::error;
      };
      checkGeometry(changed, impostor, kQuickChecks, take, {});
      EXPECT_EQ(errors, isRight ? 0u : 1u);
    }
  }
}

TEST_F(OneViewLights, TellsAnotherOrderByTheResidualOfNormals) {
  const std::vector<capture::Light> right = capture.lights;
  const auto ordered = [&](const auto& sourceOf) {
    for (size_t l = 0; l < right.size(); ++l) capture.lights[l].kind = right[sourceOf(l)].kind;
    return found({1, 1, 1});
  };
  const std::string shifted = ordered([](size_t l) { return (l + 1) % 9; });
  EXPECT_TRUE(shifted.starts_with(
      "error: the table of lights looks shifted by one: photographs of L1 look lit by L0, "))
      << shifted;
  const std::string reversed = ordered([](size_t l) { return 8 - l; });
  EXPECT_TRUE(reversed.starts_with("error: the table of lights looks reversed: ")) << reversed;
}

// A relief without a mask covers the background, which follows no light.
TEST_F(OneViewLights, WithoutMaskIsJudgedByWhatIsLit) {
  for (capture::Frame& frame : capture.frames) frame.mask.clear();
  const TriangleMesh relief = proxy::impostorOfOneView(capture, true, {}).mesh;
  for (const Finding& finding : checkCapture(capture, relief, {}, {}))
    EXPECT_FALSE(contains(finding.text, "light directions")) << finding.text;
}

} // namespace
} // namespace surflect::validation
