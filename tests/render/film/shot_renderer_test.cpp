#include "render/film/shot_renderer.h"

#include "render/film/frame_file.h"
#include "render/methods.h"
#include "tests/render/films.h"

#include <cmath>
#include <functional>
#include <utility>

namespace surflect::film {
namespace {

using studio::filmOf;

class ShotOfSphere : public studio::PackedSphere<600> {
protected:
  // One light that brightens and goes dark again, one warp; `camera` is the table's content.
  static scene::Script script(const std::string& camera, const std::string& size = "[40, 40]",
                              const std::string& intensity = "[[3, 1], [6, 40], [11, 0]]") {
    return scene::parseScript("model = \"m.srf\"\n[frames]\nfirst = 3\nlast = 11\n[output]\nsize = " + size +
                                  "\npath = \"#.exr\"\naov = [\"depth\"]\n[camera]\n" + camera +
                                  "\n[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\n"
                                  "intensity = " +
                                  intensity +
                                  "\n[[warp]]\ntype = \"twist\"\naxis = [0, 1, 0]\nangle_deg = \"5*frame\"",
                              "shots/shot.toml");
  }
  ShotRenderer rendererOf(const scene::Script& script) { return ShotRenderer(script, *renderer, progress); }

  const Progress progress;
  const std::unique_ptr<method::Renderer> renderer = method::openRenderer(model().folder);
  const std::string placed = "position = [4, 1, \"t\"]\nlook_at = [0, 0, 0]\nfov_deg = 40";
};

TEST_F(ShotOfSphere, AFrameIsTheScriptAtItsTime) {
  const scene::Script shot = script(placed);
  const method::FrameLayers film = rendererOf(shot).render(7, 1);
  const warp::ShotTime time = scene::shotTime(shot, 7);
  surfels::FrameOptions options;
  options.aovs = {"depth"};
  const method::FrameLayers expected = filmOf(
      model(), *scene::warpAt(shot, time), scene::cameraAt(shot, time), scene::lightsAt(shot, time), options);
  EXPECT_EQ(film.color.values, expected.color.values);
  ASSERT_EQ(film.aovs.size(), 1u);
  EXPECT_EQ(film.aovs.at("depth").values, expected.aovs.at("depth").values);
}

TEST_F(ShotOfSphere, ACapturedCameraHasItsOwnPoseAndViewAtAnySize) {
  const scene::Script shot = script("from = \"C5\"", "[60, 60]");
  const capture::Camera<AcquisitionSpace>& captured = model().rig.views[5].camera;
  for (const double scale : {1.0, 0.5, 3.0}) {
    const capture::Camera<ObjectSpace> got = rendererOf(shot).camera(7, scale);
    EXPECT_EQ(got.lens.width, 60 * scale);
    EXPECT_EQ(got.lens.height, 60 * scale);
    EXPECT_NEAR(got.lens.focalX / got.lens.width, captured.lens.focalX / captured.lens.width, 1e-15);
    EXPECT_EQ(got.cameraFromWorld.translation(), captured.cameraFromWorld.translation());
    EXPECT_EQ(got.cameraFromWorld.rotation(), captured.cameraFromWorld.rotation());
  }
}

TEST_F(ShotOfSphere, ACameraThatCannotBeIsToldWithItsPlaceInTheScript) {
  const scene::Script nobody = script("from = \"C99\""), wide = script("from = \"C5\"", "[80, 40]");
  EXPECT_EQ(image::errorOf([&] { rendererOf(nobody).camera(3, 1); }),
            "shots/shot.toml: camera.from: found 'C99', expected a camera of " + model().folder.string());
  EXPECT_EQ(image::errorOf([&] { rendererOf(wide).camera(3, 1); }),
            "shots/shot.toml: output.size: found 80 x 40, expected the shape of the camera's pictures, "
            "40 x 40");
}

TEST_F(ShotOfSphere, TheBrightestOfFiveFramesIsWhiteInThePreviews) {
  const scene::Script shot = script(placed, "[160, 160]");
  ShotRenderer shots = rendererOf(shot);
  double white = 0;
  for (const int frame : {3, 5, 7, 9, 11}) {
    white = std::max(white, whiteOf(shots.render(frame, 0.25).color));
  }
  EXPECT_GT(white, 0);
  EXPECT_EQ(shots.previewExposure(), 1 / white);
  EXPECT_EQ(rendererOf(shot).previewExposure(), 1 / white) << "whatever was rendered before";
}

TEST_F(ShotOfSphere, AStopOfExposureDoublesColoursAndTheirErrorsExactly) {
  const std::vector<std::string> aovs = {"predicted_error", "stretch", "camera_blend"};
  const scene::Script moves = script(placed + "\nexposure = \"frame - 10\"");
  for (const int frame : {7, 10, 11}) {
    const method::FrameLayers without = rendererOf(script(placed)).render(frame, 1, aovs),
                              with = rendererOf(moves).render(frame, 1, aovs);
    const float factor = std::ldexp(1.f, frame - 10);
    for (size_t i = 0; i < with.color.values.size(); ++i)
      ASSERT_EQ(with.color.values[i], (i % 4 == 3 ? 1 : factor) * without.color.values[i]);
    for (size_t i = 0; i < with.color.values.size() / 4; ++i)
      ASSERT_EQ(with.aovs.at("predicted_error").values[i],
                factor * without.aovs.at("predicted_error").values[i]);
    EXPECT_EQ(with.aovs.at("stretch").values, without.aovs.at("stretch").values);
    EXPECT_EQ(with.aovs.at("camera_blend").values, without.aovs.at("camera_blend").values);
  }
  EXPECT_EQ(rendererOf(moves).previewExposure(), 1);
}

TEST_F(ShotOfSphere, AnExposureBeyondThirtyStopsIsToldWithItsPlace) {
  const scene::Script bright = script(placed + "\nexposure = \"10*frame\"");
  EXPECT_EQ(image::errorOf([&] { rendererOf(bright).render(4, 1); }),
            "shots/shot.toml: camera.exposure: found 40, expected stops in -30..30");
}

TEST_F(ShotOfSphere, WhereNothingShinesPreviewsAreAsTheyAre) {
  const scene::Script dark = script(placed, "[40, 40]", "0");
  EXPECT_EQ(rendererOf(dark).previewExposure(), 1);
}

TEST_F(ShotOfSphere, BlurOfAStillSceneHasTheBitsOfNone) {
  const std::string still = "position = [4, 1, 2]\nlook_at = [0, 0, 0]\nfov_deg = 40\n";
  const image::TemporaryFolder folder;
  const image::Image sky = image::randomImage(8, 4, 3, 0, 1, 1);
  const image::ExrLayer layer{{"R", "G", "B"}, &sky};
  image::writeExr(folder / "sky.exr", std::span(&layer, 1), {});
  const auto shotOf = [&](const std::string& camera, const std::string& samples) {
    return scene::parseScript(
        "model = \"m.srf\"\n[frames]\nfirst = 1\nlast = 9\n[output]\nsize = [40, 40]\n"
        "path = \"#.exr\"\naov = [\"depth\", \"normal\", \"predicted_error\"]\nsamples = " +
            samples + "\n[camera]\nexposure = 1.37\n" + camera +
            "[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\nintensity = 40\n"
            "[[light]]\ntype = \"environment\"\nimage = \"" +
            (folder / "sky.exr").string() + "\"\n[ground]\npoint = [0, -1, 0]\nshadow = 0.7",
        "shots/shot.toml");
  };
  const scene::Script sharp = shotOf(still, "16");
  const method::FrameLayers expected = rendererOf(sharp).render(5, 1);
  for (const auto& [camera, samples] : {std::pair{still + "shutter_deg = 360\n", "3"},
                                        {still + "shutter_deg = 180\naperture = 0\n", "7"},
                                        {still + "aperture = 0\nfocus_distance = 2\n", "1024"}}) {
    const scene::Script blurred = shotOf(camera, samples);
    const method::FrameLayers film = rendererOf(blurred).render(5, 1);
    EXPECT_EQ(film.color.values, expected.color.values);
    EXPECT_EQ(film.shadow.values, expected.shadow.values);
    for (const auto& [name, image] : expected.aovs)
      EXPECT_EQ(film.aovs.at(name).values, image.values) << name;
  }
}

TEST_F(ShotOfSphere, TheObjectAloneIsTheFrameWithoutItsGround) {
  const std::string text =
      "model = \"m.srf\"\n[frames]\nfirst = 1\nlast = 9\n[output]\nsize = [40, 40]\n"
      "path = \"#.exr\"\n[camera]\nposition = [4, 1, 2]\nlook_at = [0, 0, 0]\nfov_deg = 40\n"
      "[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\nintensity = 40\n";
  const scene::Script bare = scene::parseScript(text, "shot.toml"),
                      onGround = scene::parseScript(text + "[ground]\npoint = [0, -1, 0]", "shot.toml");
  ShotRenderer shot = rendererOf(onGround);
  const method::FrameLayers expected = rendererOf(bare).render(5, 1);
  EXPECT_EQ(shot.renderObject(5, 1, {}).color.values, expected.color.values);
  const method::FrameLayers whole = shot.render(5, 1);
  EXPECT_EQ(whole.color.values, expected.color.values);
  EXPECT_GT(std::ranges::max(whole.shadow.values), 0.9f);
  EXPECT_TRUE(shot.renderObject(5, 1, {}).shadow.values.empty());
  EXPECT_EQ(shot.previewExposure(), rendererOf(bare).previewExposure());
}

const Progress quiet;

// A renderer of what a function draws.
class DrawnRenderer : public method::Renderer {
public:
  using Draw = std::function<void(const scene::Scene&, method::FrameLayers&)>;
  explicit DrawnRenderer(Draw draw) : draw_(std::move(draw)) {}

  int frames = 0; // rendered
  method::Description description;

  const method::Description& describe() const override { return description; }
  std::span<const method::Option> options() const override { return {}; }
  method::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs, const Progress&,
                             method::FrameLayers) override {
    ++frames;
    const capture::Lens& lens = scene.camera.lens;
    method::FrameLayers layers{image::Image(lens.width, lens.height, 4), {}, {}};
    for (const std::string& aov : aovs) layers.aovs[aov] = image::Image(lens.width, lens.height, 1);
    layers.report = {{{"draw", 0.5}}, {{"draw", 1}}, {{"work.draw", 3}, {"level", 2}}, {}};
    draw_(scene, layers);
    return layers;
  }

private:
  void configure(const method::Setting&) override {}
  const Draw draw_;
};

// A square of side 2 at a distance of 4, seen at 64 pixels per unit of tangent; the warp moves it.
constexpr int kSide = 64;
void drawCard(const scene::Scene& scene, method::FrameLayers& layers) {
  const Vec3<double> middle = scene.warp.position({0, 0, -4});
  const auto objectFromCamera = scene.camera.cameraFromWorld.inverse();
  for (int y = 0; y < layers.color.height; ++y)
    for (int x = 0; x < layers.color.width; ++x) {
      const auto ray = capture::rayThrough(scene.camera.lens, {x + 0.5, y + 0.5});
      const Vec3<double> o = objectFromCamera(ray->origin).raw(), d = objectFromCamera(ray->direction).raw();
      const Vec3<double> hit = o + (middle[2] - o[2]) / d[2] * d - middle;
      if (std::abs(hit[0]) < 1 && std::abs(hit[1]) < 1)
        std::ranges::copy(std::array{0.5f, 0.25f, 1.f, 1.f}, layers.color.at(x, y).begin());
    }
  for (auto& [name, image] : layers.aovs) std::ranges::fill(image.values, static_cast<float>(middle[0]));
}

scene::Script blurScript(const std::string& camera, int samples, const std::string& more = "") {
  return scene::parseScript(
      "model = \"m.srf\"\n[frames]\nfirst = 0\nlast = 8\n[output]\nsize = [64, 64]\npath = \"#.exr\"\n"
      "samples = " +
          std::to_string(samples) +
          "\n[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, -4]\nfov_deg = 53.13010235415598\n" + camera +
          "\n" + more,
      "shots/shot.toml");
}
// By 20 pixels a frame to the right, in the middle at frame 4.
const std::string moving = "[[warp]]\ntype = \"rigid\"\ntranslate = [\"1.25*(frame - 4)\", 0, 0]\n";

TEST(MotionBlur, AnOpaqueEdgeBecomesARampAsWideAsItsPath) {
  for (const double degrees : {90.0, 180.0, 360.0})
    for (const int samples : {8, 64}) {
      const scene::Script script = blurScript("shutter_deg = " + std::to_string(degrees), samples, moving);
      DrawnRenderer renderer(drawCard);
      const image::Image color = ShotRenderer(script, renderer, quiet).render(4, 1).color;
      const double width = 20 * degrees / 360, left = kSide / 2 - 16, right = kSide / 2 + 16;
      const auto passed = [&](double edge, double x) { // share of the time in which the edge is left of x
        return std::clamp((x - edge) / width + 0.5, 0.0, 1.0);
      };
      for (int x = 0; x < kSide; ++x) {
        const double expected = passed(left, x + 0.5) - passed(right, x + 0.5);
        EXPECT_NEAR(color.at(x, kSide / 2)[3], expected, 0.51 / samples) << x;
        EXPECT_EQ(color.at(x, kSide / 2)[0], 0.5f * color.at(x, kSide / 2)[3]) << "premultiplied";
      }
    }
}

TEST(MotionBlur, AFrameHasItsOwnExposureWhileExposureMoves) {
  DrawnRenderer renderer(drawCard);
  const std::string open = "shutter_deg = 360\n";
  const scene::Script plain = blurScript(open, 16, moving),
                      moves = blurScript(open + "exposure = \"2*frame\"", 16, moving),
                      steep = blurScript(open + "exposure = \"30*(frame - 4)\"", 16, moving);
  const std::vector<std::string> aovs = {"predicted_error"};
  const method::FrameLayers without = ShotRenderer(plain, renderer, quiet).render(4, 1, aovs),
                            with = ShotRenderer(moves, renderer, quiet).render(4, 1, aovs);
  for (size_t i = 0; i < with.color.values.size(); ++i)
    ASSERT_EQ(with.color.values[i], (i % 4 == 3 ? 1 : 256) * without.color.values[i]);
  for (size_t i = 0; i < with.color.values.size() / 4; ++i)
    ASSERT_EQ(with.aovs.at("predicted_error").values[i], 256 * without.aovs.at("predicted_error").values[i]);
  EXPECT_EQ(ShotRenderer(steep, renderer, quiet).render(5, 1, {}).color.values,
            ShotRenderer(blurScript(open + "exposure = 30", 16, moving), renderer, quiet)
                .render(5, 1, {})
                .color.values)
      << "30 stops at the frame, more while it is open";
}

// Gives the card the intensity of the light, and a shadow of the ground's strength.
void drawLit(const scene::Scene& scene, method::FrameLayers& layers) {
  const float light = std::get<scene::ShotPointLight>(scene.lights.at(0)).intensity.r;
  for (size_t i = 0; i < layers.color.values.size(); i += 4) layers.color.values[i] = light;
  layers.shadow = image::Image(layers.color.width, layers.color.height, 1);
  std::ranges::fill(layers.shadow.values, static_cast<float>(scene.ground->shadow));
}

// Four of eight samples of the first frame lie before the film: lights have the strength of its beginning
// there.
TEST(MotionBlur, FadesEndWithTheFilmAndShadowsAreMeans) {
  DrawnRenderer renderer(drawLit);
  const auto shot = [&](const std::string& fade) {
    return blurScript("shutter_deg = 360", 8,
                      "[[light]]\ntype = \"point\"\nposition = [0, 0, 9]\nintensity = \"" + fade +
                          "\"\n[ground]\npoint = [0, -1, 0]\nshadow = \"" + fade + "\"\n");
  };
  const scene::Script in = shot("s"), out = shot("1 - s"), root = shot("sqrt(frame)/3");
  const float sum = (0.5f + 1.5f + 2.5f + 3.5f) / 8 / 8 / 8; // of s over the open half
  const auto expectMean = [&](const scene::Script& script, int frame, float wanted) {
    const method::FrameLayers film = ShotRenderer(script, renderer, quiet).render(frame, 1, {});
    EXPECT_NEAR(film.color.values[0], wanted, 1e-6f);
    EXPECT_NEAR(film.shadow.values[0], wanted, 1e-6f);
  };
  expectMean(in, 0, sum);
  expectMean(in, 8, 1 - sum);
  expectMean(in, 4, 0.5f);
  expectMean(out, 0, 1 - sum);
  expectMean(out, 8, sum);
  EXPECT_TRUE(std::isfinite(ShotRenderer(root, renderer, quiet).render(0, 1, {}).color.values[0]));
}

TEST(Exposure, TellsOfColoursThatAnExrClamps) {
  DrawnRenderer renderer(drawCard);
  const scene::Script bright = blurScript("exposure = 17", 1), dim = blurScript("exposure = 15", 1);
  const auto remark = ShotRenderer(bright, renderer, quiet).render(4, 1, {}).report.remark;
  ASSERT_TRUE(remark);
  EXPECT_EQ(*remark,
            "2048 colour values beyond 65504, the most that an EXR of half floats holds, are clamped to it");
  EXPECT_FALSE(ShotRenderer(dim, renderer, quiet).render(4, 1, {}).report.remark);
}

TEST(MotionBlur, SamplesCostAFrameEachAndDepthOneMore) {
  DrawnRenderer renderer(drawCard);
  const scene::Script script = blurScript("shutter_deg = 180", 12, moving),
                      still = blurScript("", 12, moving);
  ShotRenderer shot(script, renderer, quiet);
  const method::FrameLayers film = shot.render(4, 1, {"normal"});
  EXPECT_EQ(renderer.frames, 12);
  EXPECT_EQ(shot.samples(4), 12);
  EXPECT_EQ(film.report.seconds.at("draw"), 12 * 0.5);
  EXPECT_EQ(film.report.processorSeconds.at("draw"), 12);
  EXPECT_EQ(film.report.counts.at("work.draw"), 12 * 3);
  EXPECT_EQ(film.report.counts.at("level"), 2) << "no amount";
  EXPECT_NEAR(film.aovs.at("normal").values[0], 0, 1e-6) << "the mean over the shutter";
  shot.render(4, 1, {"depth"});
  EXPECT_EQ(renderer.frames, 12 + 13);
  ShotRenderer(still, renderer, quiet).render(4, 1, {"depth"});
  EXPECT_EQ(renderer.frames, 12 + 13 + 1);
}

TEST(MotionBlur, DepthAndPreviewsAreThoseOfTheMiddleInstant) {
  DrawnRenderer renderer(drawCard);
  const scene::Script script = blurScript("shutter_deg = 360", 5, moving), sharp = blurScript("", 5, moving);
  ShotRenderer shot(script, renderer, quiet), without(sharp, renderer, quiet);
  EXPECT_EQ(shot.render(6, 1, {"depth"}).aovs.at("depth").values,
            without.render(6, 1, {"depth"}).aovs.at("depth").values);
  EXPECT_EQ(shot.renderSharp(6, 1, {}).color.values, without.render(6, 1, {}).color.values);
  EXPECT_EQ(shot.previewExposure(), without.previewExposure());
}

// A spot of one pixel's deviation where the point (0.3, 0.2, -6) is seen.
void drawSpot(const scene::Scene& scene, method::FrameLayers& layers) {
  const auto at = scene.camera.project(Point3<ObjectSpace, double>(0.3, 0.2, -6));
  for (int y = 0; y < layers.color.height; ++y)
    for (int x = 0; x < layers.color.width; ++x) {
      const double dx = x + 0.5 - at->x, dy = y + 0.5 - at->y;
      layers.color.at(x, y)[3] = static_cast<float>(std::exp(-0.5 * (dx * dx + dy * dy)));
    }
}

// A disc of diameter D has the second moment D^2 / 16 along each axis.
TEST(DepthOfField, ASpotBecomesTheCircleOfConfusion) {
  const scene::Script script = blurScript("aperture = 1.5\nfocus_distance = 2.5", 256);
  DrawnRenderer renderer(drawSpot);
  const image::Image color = ShotRenderer(script, renderer, quiet).render(4, 1).color;
  double sum = 0;
  Vec2<double> mean(0, 0), square(0, 0);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const Vec2<double> at(x, y);
      const double weight = color.at(x, y)[3];
      sum += weight;
      mean += weight * at;
      square += weight * at.cwiseAbs2();
    }
  const Vec2<double> moment = square / sum - (mean / sum).cwiseAbs2() - Vec2<double>(1, 1);
  const double diameter = 1.5 * 64 * (6 - 2.5) / (6 * 2.5);
  EXPECT_NEAR(4 * std::sqrt(moment[0]) / diameter, 1, 0.004);
  EXPECT_NEAR(4 * std::sqrt(moment[1]) / diameter, 1, 0.004);
}

TEST(DepthOfField, TheFocusIsWhereTheCameraLooksUnlessGiven) {
  DrawnRenderer renderer(drawCard);
  const scene::Script given = blurScript("aperture = 1\nfocus_distance = 4", 9),
                      looked = blurScript("aperture = 1", 9), sharp = blurScript("", 9);
  const auto colorOf = [&](const scene::Script& script) {
    return ShotRenderer(script, renderer, quiet).render(4, 1).color.values;
  };
  EXPECT_EQ(colorOf(looked), colorOf(given));
  EXPECT_EQ(colorOf(looked), colorOf(sharp)) << "the card is in focus";
}

TEST(BlurSteps, AreThePathAndTheCircleInPixels) {
  DrawnRenderer renderer(drawCard);
  const std::vector<Point3<AcquisitionSpace>> points(3, Point3<AcquisitionSpace>(0, 0, -4));
  renderer.description.points = points;
  const scene::Script script =
      blurScript("shutter_deg = 180\naperture = 1.5\nfocus_distance = 2.5", 16, moving);
  const ShotRenderer::BlurSteps steps = ShotRenderer(script, renderer, quiet).blurSteps(4, 0.5);
  EXPECT_NEAR(steps.motion, 5, 1e-9); // at half the size
  EXPECT_NEAR(steps.defocus, 1.5 * 32 * (4 - 2.5) / (4 * 2.5), 1e-9);
  EXPECT_EQ(steps.needed, 11); // pi/4 (7.2 / 2)^2 = 10.2
  const scene::Script sharp = blurScript("", 16, moving);
  EXPECT_EQ(ShotRenderer(sharp, renderer, quiet).blurSteps(4, 0.5).needed, 1);
}

TEST(Ground, IsRefusedByNameUnderFixedLight) {
  DrawnRenderer renderer(drawCard);
  renderer.description.isBaked = true;
  renderer.description.folder = "vase.slf";
  const scene::Script script = blurScript("", 1, "[ground]\npoint = [0, -1, 0]");
  EXPECT_EQ(
      image::errorOf([&] { ShotRenderer(script, renderer, quiet); }),
      "shots/shot.toml: ground: needs a model that is relit: the light of vase.slf is fixed, and casts no "
      "shadow on a ground");
}

} // namespace
} // namespace surflect::film
