#include "render/surfels/surfel_method.h"

#include "render/methods.h"
#include "render/surfels/frame_work.h"
#include "surfel/base/error.h"
#include "tests/render/films.h"
#include "tests/srf/image/files.h"
#include "tests/srf/shading/queries.h"

#include <fmt/format.h>

#include <map>
#include <ranges>
#include <string>
#include <vector>

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
  EXPECT_NE(description.identity,
            method::openRenderer(model().folder, {{"cameras", 1}})->describe().identity);
}

TEST_F(Opened, ASettingGivesTheFramesOfARendererThatIsOpenedWithIt) {
  const auto later = method::openRenderer(model().folder);
  const auto fewer = method::openRenderer(model().folder, {{"cameras", 1}, {"lights", 2}});
  const std::string full = later->describe().identity;
  later->set({{"cameras", 1}, {"lights", 2}});
  const auto warp = noWarp();
  EXPECT_EQ(later->render({*warp, camera, lights}).color.values,
            fewer->render({*warp, camera, lights}).color.values);
  EXPECT_EQ(later->describe().identity, fewer->describe().identity);
  later->set({});
  EXPECT_EQ(later->describe().identity, full);
  fewer->set({});
  EXPECT_EQ(fewer->describe().identity, full);
  EXPECT_EQ(fewer->render({*warp, camera, lights}).color.values,
            later->render({*warp, camera, lights}).color.values);
}

// The number of lights that a model blends by default depends on the interpolation.
TEST_F(Opened, ASettingHasOneIdentityHoweverTheRendererWasOpened) {
  const method::Setting settings[] = {{},
                                      {{"lights", 3}},
                                      {{"lights", 4}},
                                      {{"interpolation", "paper"}},
                                      {{"interpolation", "paper"}, {"lights", 4}}};
  const auto warp = noWarp();
  std::map<std::string, std::vector<float>> pictures; // by identity
  for (const method::Setting& first : settings)
    for (const method::Setting& later : settings) {
      const auto renderer = method::openRenderer(model().folder, first);
      renderer->set(later);
      const auto values = renderer->render({*warp, camera, lights}).color.values;
      const auto [known, isNew] = pictures.emplace(renderer->describe().identity, values);
      EXPECT_EQ(known->second, values) << method::textOf(first) << " " << method::textOf(later);
    }
  EXPECT_GE(pictures.size(), 3u);
}

TEST_F(Opened, EveryKnobTakesAllItsValuesAndNoOthers) {
  const auto renderer = method::openRenderer(model().folder);
  const std::string full = renderer->describe().identity;
  size_t knobs = 0;
  for (const method::Option& knob : renderer->options()) {
    knobs += !knob.sweep.empty();
    for (const method::Value& value : knob.sweep) {
      renderer->set({{knob.name, value}});
      EXPECT_EQ(renderer->describe().identity == full, value == knob.sweep.front())
          << knob.name << value.text();
    }
  }
  EXPECT_GE(knobs, 6u);
  EXPECT_EQ(image::errorOf([&] {
              renderer->set({{"cameras", 0}});
            }),
            "--cameras: found 0, expected " +
                method::domainText(method::rowOf(method::optionsOf(*renderer), "cameras")));
  EXPECT_EQ(image::errorOf([&] {
              renderer->set({{"camera", 1}});
            }),
            "surfels has no option --camera; did you mean --cameras?");
}

TEST_F(Opened, SweepsBeginWithTheDefault) {
  const auto renderer = method::openRenderer(model().folder);
  for (const method::Option& option : renderer->options()) {
    if (option.sweep.empty() || !option.standard) continue;
    EXPECT_EQ(option.sweep.front().text(), option.standard->text()) << option.name;
  }
}

TEST_F(Opened, OptionsOfOpeningAreKept) {
  const auto renderer = method::openRenderer(model().folder, {{"cache_mb", 1}});
  EXPECT_THROW(renderer->set({{"cache_mb", 2}}), Error);
  const auto warp = noWarp();
  EXPECT_EQ(renderer->render({*warp, camera, lights}).color.values,
            method::openRenderer(model().folder)->render({*warp, camera, lights}).color.values);
}

TEST_F(Opened, ReusedStagesLeaveThePicturesOfADragAsTheyAre) {
  const auto reusing = method::openRenderer(model().folder, {{"reuse", method::kOn}});
  const auto warp = noWarp();
  for (int step = 0; step < 5; ++step) {
    const std::vector<scene::ShotLight> dragged{scene::ShotPointLight{{2, 1, 2 - 0.1 * step}, {9, 8, 7}}};
    EXPECT_EQ(reusing->render({*warp, camera, dragged}).color.values,
              filmOf(model(), *warp, camera, dragged).color.values)
        << step;
  }
  EXPECT_THROW(reusing->set({{"reuse", method::kOff}}), Error);
}

TEST_F(Opened, WorkFallsWithEveryStepOfAKnob) {
  const auto renderer = method::openRenderer(model().folder);
  const auto warp = noWarp();
  const auto workAt = [&](const method::Setting& setting) {
    renderer->set(setting);
    double work = 0;
    for (const auto& [name, count] : renderer->render({*warp, camera, lights}).report.counts)
      if (name.starts_with("work.")) work += count;
    return work;
  };
  const double full = workAt({});
  EXPECT_GT(full, 0);
  for (const method::Option& knob : renderer->options()) {
    if (knob.sweep.empty()) continue;
    // Choosing surfels and patches takes some time, also where it leaves nothing out.
    double before = 1.02 * full;
    for (const method::Value& value : knob.sweep | std::views::drop(1)) {
      const double work = workAt({{knob.name, value}});
      EXPECT_LE(work, before) << knob.name << " " << value.text();
      before = work;
    }
    EXPECT_LE(before, 1.02 * full) << knob.name;
    if (knob.name == "cameras" || knob.name == "lights" || knob.name == "surfel_size") {
      EXPECT_LT(before, full);
    }
  }
  EXPECT_EQ(workAt({}), full);
}

// [Weyrich 2005, Eqs. 8 and 9] At rest, tangents are orthonormal as they are; a twist shears them.
TEST_F(Opened, TangentsByTheBisectorDifferFromThePolarOnesWhereAWarpShears) {
  const auto polar = method::openRenderer(model().folder);
  const auto bisector = method::openRenderer(model().folder, {{"tangents", "bisector"}});
  EXPECT_NE(polar->describe().identity, bisector->describe().identity);
  const auto difference = [&](const warp::Warp& warp) {
    return studio::largestDifference(polar->render({warp, camera, lights}).color,
                                     bisector->render({warp, camera, lights}).color);
  };
  EXPECT_LE(difference(*noWarp()), 1e-6);
  EXPECT_GT(difference(*warp::twistWarp({0, 1, 0}, Angle::fromDegrees(60), {0, 0, 0})), 1e-3);
}

TEST_F(Opened, FibresThatItDoesNotHaveAreRefused) {
  for (const char* tangents : {"along", "across"})
    EXPECT_NE(image::errorOf([&] {
                method::openRenderer(model().folder, {{"tangents", tangents}});
              }).find(fmt::format("tangents: found {}, expected polar or bisector", tangents)),
              std::string::npos);
}

// Fibres that a warp carries along differ from those across them, and from those that turn as the surfel.
TEST(Tangents, OfTablesFollowTheWarp) {
  std::mt19937 random(5);
  const studio::PackedStudio packed(studio::Studio{.gloss = 1}, 600);
  auto model = std::make_shared<model::Model>(model::openModel(packed.folder / "model"));
  studio::giveTables(*model, random);
  const auto camera = studio::cameraFrom<ObjectSpace>({1, 1, 1}, 60);
  const std::vector<scene::ShotLight> lights{scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}};
  const auto film = [&](const warp::Warp& warp, const char* tangents) {
    return SurfelRenderer(model, {{"tangents", tangents}}).render({warp, camera, lights}, {}).color;
  };
  const auto twist = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(60), {0, 0, 0});
  for (const char* tangents : {"along", "across"}) {
    EXPECT_LE(studio::largestDifference(film(*noWarp(), "polar"), film(*noWarp(), tangents)), 1e-5)
        << tangents;
    EXPECT_GT(studio::largestDifference(film(*twist, "polar"), film(*twist, tangents)), 1e-2) << tangents;
  }
  EXPECT_GT(studio::largestDifference(film(*twist, "along"), film(*twist, "across")), 1e-2);
}

TEST_F(Opened, EveryPresetShowsTheObject) {
  const auto warp = noWarp();
  const auto full = method::openRenderer(model().folder)->render({*warp, camera, lights}).color;
  for (const auto preset : {method::Preset::preview, method::Preset::paper}) {
    const method::Setting setting = method::settingOf(preset, surfelMethod().renderOptions);
    const auto layers = method::openRenderer(model().folder, setting)->render({*warp, camera, lights});
    EXPECT_FALSE(layers.report.remark);
    double squares = 0, all = 0;
    for (size_t i = 0; i < full.values.size(); ++i) {
      squares += std::pow(static_cast<double>(layers.color.values[i] - full.values[i]), 2);
      all += std::pow(static_cast<double>(full.values[i]), 2);
    }
    EXPECT_GT(squares, 0) << method::textOf(setting);
    EXPECT_LT(std::sqrt(squares / all), 0.2) << method::textOf(setting);
  }
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
          ": format: found \"polygons\", expected one of \"surflect model\", \"surflect surface light "
          "field\", \"surflect lumigraph\", \"surflect light field maps\", \"surflect opacity light field\", "
          "\"surflect opacity light field maps\", \"surflect spherical\"");
}

} // namespace
} // namespace surflect::surfels
