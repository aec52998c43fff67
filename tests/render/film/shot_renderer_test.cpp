#include "render/film/shot_renderer.h"

#include "render/film/frame_file.h"
#include "render/methods.h"
#include "tests/render/films.h"

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

} // namespace
} // namespace surflect::film
