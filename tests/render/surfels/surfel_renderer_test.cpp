#include "render/surfels/surfel_renderer.h"

#include "render/surfels/frame_work.h"
#include "tests/render/films.h"
#include "tests/srf/image/files.h"

#include <ranges>

namespace surflect::surfels {
namespace {

using studio::filmOf;
using studio::noWarp;

FrameStats statsOf(size_t visible, size_t dead, size_t notFinite) {
  FrameStats stats;
  stats.visible = visible;
  stats.splats.dead = dead;
  stats.splats.notFinite = notFinite;
  return stats;
}

TEST(EmptyFrame, SaysWhereMostSurfelsAreGoneOrNothingIsVisible) {
  EXPECT_EQ(emptyFrame(statsOf(1, 0, 0), 100), std::nullopt);
  EXPECT_EQ(emptyFrame(statsOf(1, 25, 25), 100), std::nullopt);
  EXPECT_EQ(emptyFrame(statsOf(1, 25, 26), 100), "51 of 100 surfels have no place or no area once warped");
  EXPECT_NE(emptyFrame(statsOf(0, 0, 0), 100).value_or("").find("nothing is visible"), std::string::npos);
}

class Opened : public studio::PackedSphere<600> {
protected:
  const std::vector<scene::ShotLight> lights{scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}};
};

TEST_F(Opened, ItsFramesAreThoseOfRenderFrame) {
  const auto renderer = method::openRenderer(model().folder);
  const auto warp = noWarp();
  const method::FrameLayers got = renderer->render({*warp, camera, lights}, {"depth"});
  FrameOptions options;
  options.aovs = {"depth"};
  const method::FrameLayers expected = filmOf(model(), *warp, camera, lights, options);
  EXPECT_EQ(got.color.values, expected.color.values);
  EXPECT_EQ(got.aovs.at("depth").values, expected.aovs.at("depth").values);
  EXPECT_EQ(got.report.counts.at("surfels.dead"), 0);
  EXPECT_GT(got.report.counts.at("surfels.visible"), 0);
  EXPECT_TRUE(got.report.seconds.contains("splat"));
  EXPECT_EQ(got.report.remark, std::nullopt);
}

TEST_F(Opened, DescribesItsModel) {
  const auto renderer = method::openRenderer(model().folder);
  const method::Description& description = renderer->describe();
  EXPECT_EQ(description.folder, model().folder);
  EXPECT_EQ(description.counts.at("surfels"), model().cloud.size());
  EXPECT_EQ(description.points.size(), model().cloud.size());
  EXPECT_EQ(description.rig.views.size(), model().rig.views.size());
  EXPECT_NE(description.identity, method::openRenderer(model().folder, {.cameras = 1})->describe().identity);
}

TEST_F(Opened, TurnedKnobsGiveTheFramesOfTheirOptions) {
  const auto turned = method::openRenderer(model().folder);
  const auto fewer = method::openRenderer(model().folder, {.cameras = 1, .lights = 2});
  const std::string full = turned->describe().identity;
  turned->turn({{"cameras", 1}, {"lights", 2}});
  const auto warp = noWarp();
  EXPECT_EQ(turned->render({*warp, camera, lights}).color.values,
            fewer->render({*warp, camera, lights}).color.values);
  EXPECT_EQ(turned->describe().identity, fewer->describe().identity);
  turned->turn({});
  EXPECT_EQ(turned->describe().identity, full);
}

TEST_F(Opened, EveryKnobTakesAllItsValuesAndNoOthers) {
  const auto renderer = method::openRenderer(model().folder);
  const std::vector<knobs::Knob> knobs = renderer->knobs();
  const std::string full = renderer->describe().identity;
  EXPECT_FALSE(knobs.empty());
  for (const knobs::Knob& knob : knobs)
    for (const double value : knob.values) {
      renderer->turn({{knob.name, value}});
      EXPECT_EQ(renderer->describe().identity == full, value == knob.values.front()) << knob.name << value;
    }
  EXPECT_EQ(image::errorOf([&] {
              renderer->turn({{"cameras", 4}});
            }),
            "knob.cameras: found 4, expected a whole number of 1 to 3");
  EXPECT_NE(image::errorOf([&] {
              renderer->turn({{"camera", 1}});
            }).find("knob: found 'camera', expected one of cameras"),
            std::string::npos);
}

TEST_F(Opened, WorkFallsWithEveryStepOfAKnob) {
  const auto renderer = method::openRenderer(model().folder);
  const auto warp = noWarp();
  const auto workAt = [&](const method::Setting& setting) {
    renderer->turn(setting);
    double work = 0;
    for (const auto& [name, count] : renderer->render({*warp, camera, lights}).report.counts)
      if (name.starts_with("work.")) work += count;
    return work;
  };
  const double full = workAt({});
  EXPECT_GT(full, 0);
  for (const knobs::Knob& knob : renderer->knobs()) {
    // Choosing surfels and patches takes some time, also where it leaves nothing out.
    double before = 1.02 * full;
    for (const double value : knob.values | std::views::drop(1)) {
      const double work = workAt({{knob.name, value}});
      EXPECT_LE(work, before) << knob.name << " " << value;
      before = work;
    }
    EXPECT_LE(before, 1.02 * full) << knob.name;
    if (knob.name == "cameras" || knob.name == "lights" || knob.name == "surfel_size") {
      EXPECT_LT(before, full);
    }
  }
  EXPECT_EQ(workAt({}), full);
}

TEST(WorkOf, TabulatedLightsCostLessThanOthers) {
  FrameStats none, tabulated, lit;
  none.queries = tabulated.queries = lit.queries = 1000;
  tabulated.tabulatedLights = lit.lights = 50;
  const auto ulr = [](const FrameStats& stats) { return workOf(stats, {}, 100).at("ulr"); };
  EXPECT_LT(ulr(none), ulr(tabulated));
  EXPECT_LT(ulr(tabulated), ulr(lit));
}

TEST(OpenRenderer, AnUnknownFormatIsToldWithItsPlace) {
  image::TemporaryFolder folder;
  image::writeBytes(folder / "manifest.json", R"({"format": "polygons"})");
  EXPECT_EQ(
      image::errorOf([&] { method::openRenderer(folder.path()); }),
      (folder / "manifest.json").string() +
          ": format: found \"polygons\", expected \"surflect model\", \"surflect surface light field\", "
          "\"surflect lumigraph\", \"surflect light field maps\", \"surflect spherical\", "
          "\"surflect opacity light field\" or \"surflect opacity light field maps\"");
}

} // namespace
} // namespace surflect::surfels
