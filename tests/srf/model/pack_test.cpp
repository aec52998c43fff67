#include "srf/model/pack.h"

#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "srf/image/mask.h"
#include "srf/image/png.h"
#include "srf/shading/shade.h"
#include "surfel/base/file.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/sampling.h"
#include "tests/support/synthetic_capture.h"

#include <algorithm>
#include <fstream>
#include <map>

namespace surflect::model {
namespace {

using studio::packOptions;
using studio::Studio;

class Pack : public ::testing::Test {
protected:
  capture::Capture photographed() { return photograph(studio, folder / "capture"); }
  PackReport packed(const capture::Capture& capture, const std::string& name = "model",
                    const PackOptions& options = packOptions(150)) {
    return pack(capture, folder / name, options, {}, nullptr);
  }
  std::map<std::string, std::string> content(const std::string& name = "model") {
    return image::modelContentOf(folder / name);
  }

  image::TemporaryFolder folder;
  Studio studio{.cameras = 5, .lights = 3, .size = 24};
};

TEST_F(Pack, CloudAndFadesAreThoseOfTheMesh) {
  const capture::Capture capture = photographed();
  const PackReport report = packed(capture);
  const Model model = openModel(folder / "model");

  const TriangleMesh mesh = readMesh(folder / "capture/mesh.ply");
  const SurfelCloud cloud = sampleSurfels(mesh, spacingFor(mesh, 150));
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const auto& view : capture.views) cameras.push_back(view.camera);
  EXPECT_EQ(model.cloud.p0, cloud.p0);
  EXPECT_EQ(model.cloud.radius, cloud.radius);
  EXPECT_EQ(model.cloud.coverage, cloud.coverage);
  EXPECT_EQ(model.visibility.values,
            weights::visibilityWeights(cloud, cameras, RayCaster<AcquisitionSpace>(mesh), {}).values);
  EXPECT_EQ(report.surfels, cloud.size());
  EXPECT_EQ(report.views.size(), 5u);
  EXPECT_EQ(report.lights, 3u);
  EXPECT_EQ(report.resumedViews, 0u);
}

TEST_F(Pack, PackingAgainResumesAndGivesTheSameBytes) {
  const capture::Capture capture = photographed();
  packed(capture);
  const auto first = content();
  EXPECT_EQ(packed(capture).resumedViews, 5u);
  EXPECT_EQ(content(), first);
}

TEST_F(Pack, AlphaIsStoredOnlyWhereItIsMoreThanAMask) {
  EXPECT_FALSE(packed(photographed()).isTranslucent);
  EXPECT_FALSE(content().contains("views/0000.srfa"));
  EXPECT_TRUE(openModel(folder / "model").alpha.empty());

  studio.opacity = 0.55f;
  const capture::Capture capture = photograph(studio, folder / "translucent");
  EXPECT_TRUE(packed(capture, "glass").isTranslucent);
  const Model model = openModel(folder / "glass");
  ASSERT_EQ(model.alpha.size(), 5u);
  for (size_t view = 0; view < 5; ++view) {
    const image::Image alpha = capture::readPhotographs(capture, std::vector<size_t>{3 * view})[0].alpha;
    EXPECT_EQ(model.alpha[view].levels(), codec::AlphaPlane(alpha).levels());
    EXPECT_NEAR(model.alpha[view].at(12, 12), 0.55f, 1. / 255);
  }
}

TEST_F(Pack, ATranslucentModelIsResumedToTheSameBytesAlsoWithoutOneOfItsAlphaFiles) {
  studio.opacity = 0.55f;
  const capture::Capture capture = photographed();
  packed(capture);
  const auto first = content();
  EXPECT_TRUE(first.contains("views/0003.srfa"));
  EXPECT_EQ(packed(capture).resumedViews, 5u);
  EXPECT_EQ(content(), first);
  std::filesystem::remove(folder / "model/views/0003.srfa");
  image::writeBytes(folder / "model/views/0001.srfa", "damaged");
  EXPECT_EQ(packed(capture).resumedViews, 3u);
  EXPECT_EQ(content(), first);
}

TEST_F(Pack, ADamagedAlphaFileIsRefusedByName) {
  studio.opacity = 0.55f;
  packed(photographed());
  std::string damaged = content().at("views/0002.srfa");
  damaged.back() ^= 1;
  image::writeBytes(folder / "model/views/0002.srfa", damaged);
  EXPECT_NE(image::errorOf([&] { openModel(folder / "model"); }).find("views/0002.srfa: checksum: found"),
            std::string::npos);
  std::filesystem::remove(folder / "model/views/0002.srfa");
  EXPECT_NE(image::errorOf([&] { openModel(folder / "model"); }).find("views/0002.srfa"), std::string::npos);
}

TEST_F(Pack, AnInterruptedRunIsTakenUpWhereItStopped) {
  const capture::Capture capture = photographed();
  packed(capture, "whole");
  Progress untilTheThirdView;
  bool stop = false;
  untilTheThirdView.report = [&](std::string_view stage, double fraction) {
    stop |= stage == "reflectance images" && fraction > 0.35;
  };
  untilTheThirdView.cancelled = [&] { return stop; };
  EXPECT_THROW(pack(capture, folder / "model", packOptions(150), untilTheThirdView, nullptr), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(folder / "model/manifest.json"));
  EXPECT_EQ(image::errorOf([&] { openModel(folder / "model"); }),
            (folder / "model/manifest.json").string() + ": unfinished model: run the same pack again");
  EXPECT_EQ(packed(capture).resumedViews, 2u);
  EXPECT_EQ(content(), content("whole"));
}

TEST_F(Pack, ProgressOfAViewIsPartOfTheWhole) {
  studio.cameras = 2, studio.size = 640, studio.samples = 1; // more than 4096 blocks show the sphere
  double last = 0;
  Progress progress;
  progress.report = [&](std::string_view stage, double fraction) {
    EXPECT_NE(stage, "encoding");
    if (stage != "reflectance images") return;
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1);
    last = fraction;
  };
  pack(photographed(), folder / "model", packOptions(150), progress, nullptr);
  EXPECT_EQ(last, 1);
}

TEST_F(Pack, BandsOfRowsAreThoseOfTheWholeView) {
  studio.cameras = 1, studio.size = 40;
  for (const float opacity : {1.f, 0.55f}) {
    studio.opacity = opacity;
    const std::string name = opacity < 1 ? "glass" : "opaque";
    capture::Capture capture = photograph(studio, folder / name);
    capture.geometry.clear(); // a plane
    double first = 1;         // progress when the first photograph of the first band is read
    Progress progress;
    progress.report = [&](std::string_view stage, double fraction) {
      if (stage == "reflectance images" && fraction > 0) first = std::min(first, fraction);
    };
    PackOptions options = packOptions(150);
    const PackReport whole = pack(capture, folder / (name + ".whole"), options, progress, nullptr);
    EXPECT_DOUBLE_EQ(first, 1 / 3. / 2);
    EXPECT_EQ(whole.isTranslucent, opacity < 1);
    options.bandBytes = 1; // bands of one row of blocks
    const PackReport bands = pack(capture, folder / (name + ".bands"), options, progress, nullptr);
    EXPECT_NEAR(first, 1 / 3. / 2 / 5, 1e-12);
    auto wholeFiles = content(name + ".whole"), bandFiles = content(name + ".bands");
    for (auto* files : {&wholeFiles, &bandFiles}) files->erase("views/0000.error"); // sums, in another order
    EXPECT_TRUE(bandFiles == wholeFiles);
    EXPECT_EQ(bands.store.objectTexels, whole.store.objectTexels);
    EXPECT_EQ(bands.store.blocksOfRank, whole.store.blocksOfRank);
    EXPECT_EQ(bands.store.fileBytes, whole.store.fileBytes);
    EXPECT_NEAR(bands.store.squaredError, whole.store.squaredError, 1e-12 * whole.store.squaredError);
  }
}

TEST_F(Pack, ADamagedViewFileIsEncodedAgain) {
  const capture::Capture capture = photographed();
  packed(capture);
  const auto first = content();
  std::string damaged = first.at("views/0002.srfb");
  damaged.back() ^= 1;
  image::writeBytes(folder / "model/views/0002.srfb", damaged);
  EXPECT_EQ(packed(capture).resumedViews, 4u);
  EXPECT_EQ(content(), first);
}

TEST_F(Pack, AnotherToleranceMeshOrPhotographIsEncodedAnew) {
  const capture::Capture capture = photographed();
  packed(capture);
  const auto first = content();
  PackOptions finer = packOptions(150, 0.01);
  finer.overwrite = true;
  EXPECT_EQ(packed(capture, "model", finer).resumedViews, 0u);
  EXPECT_NE(content(), first);

  studio::writeSphereMesh(folder / "capture/mesh.ply", 80);
  EXPECT_EQ(packed(capture, "model", finer).resumedViews, 0u);

  // Darkens one picture, which does not affect the white level.
  const auto path = folder / "capture/C4.exr";
  const image::ExrFile file(path);
  std::vector<image::ExrLayer> layers;
  std::vector<image::Image> images;
  for (const char* layer : {"L0", "L1", "L2"}) images.push_back(file.read(image::colorChannels(file, layer)));
  images.push_back(file.read(image::ChannelSet{"matte.A"}));
  for (float& value : images[1].values) value *= 0.5f;
  for (size_t l = 0; l < 3; ++l)
    layers.push_back(
        {image::colorChannels(file, studio::numbered("L", l)), &images[l], image::Precision::half});
  layers.push_back({{"matte.A"}, &images[3], image::Precision::half});
  image::writeExr(path, layers);
  EXPECT_EQ(packed(capture, "model", finer).resumedViews, 0u);
}

TEST_F(Pack, AFinishedModelIsReplacedOnlyWhereThatIsAskedFor) {
  const capture::Capture capture = photographed();
  packed(capture);
  const auto first = content();
  const auto complaint = image::errorOf([&] { packed(capture, "model", packOptions(150, 0.01)); });
  EXPECT_EQ(complaint, (folder / "model").string() +
                           ": a finished model of another capture, geometry, tolerance or version of "
                           "surflect: --overwrite replaces it");
  EXPECT_EQ(content(), first);

  std::filesystem::remove(folder / "model/manifest.json"); // an unreadable model need not be protected
  EXPECT_EQ(packed(capture, "model", packOptions(150, 0.01)).resumedViews, 0u);
}

TEST_F(Pack, ABracketOfEightBitsIsOnePhotograph) {
  // Replaces each photograph by a bracket of two PNGs, by a camera with a square-root response.
  capture::Capture bracketed = photographed();
  const PackReport exact = packed(bracketed, "exact");
  for (size_t i = 0; i < bracketed.frames.size(); ++i) {
    const capture::Photograph photograph = capture::readPhotographs(bracketed, std::span(&i, 1))[0];
    capture::Frame& frame = bracketed.frames[i];
    for (const double seconds : {0.5, 1.}) {
      image::Image picture(photograph.alpha.width, photograph.alpha.height, 4);
      for (size_t p = 0; p < photograph.alpha.values.size(); ++p) {
        for (size_t c = 0; c < 3; ++c)
          picture.values[4 * p + c] =
              std::sqrt(photograph.radiance.values[3 * p + c] * static_cast<float>(seconds) / 2);
        picture.values[4 * p + 3] = photograph.alpha.values[p];
      }
      const std::string name = studio::numbered(seconds == 1 ? "full" : "half", i) + ".png";
      image::writePng(folder / ("capture/" + name), picture);
      if (seconds == 1)
        frame.further = {{name, "", "", seconds}};
      else {
        frame.picture = name;
        frame.exposure = seconds;
        frame.layer = frame.alphaLayer = "";
      }
    }
  }
  bracketed.colorSpace.reset();
  for (auto& curve : bracketed.response.emplace().exposure)
    for (size_t z = 0; z < curve.size(); ++z) curve[z] = 2 * static_cast<float>(z * z) / (255 * 255);
  capture::writeCapture(bracketed, folder / "capture");
  const capture::Capture capture = capture::readCapture(folder / "capture");

  const PackReport report = packed(capture);
  const Model model = openModel(folder / "model");
  EXPECT_EQ(model.rig.frames.size(), 15u);
  EXPECT_NEAR(report.white, exact.white, 0.01 * exact.white);
  EXPECT_EQ(packed(capture).resumedViews, 5u);
  std::filesystem::last_write_time(folder / "capture/full7.png",
                                   std::filesystem::file_time_type::clock::now());
  PackOptions anew = packOptions(150);
  anew.overwrite = true;
  EXPECT_EQ(packed(capture, "model", anew).resumedViews, 0u); // the second picture of a bracket counts too
}

TEST_F(Pack, TestFramesPlayNoPart) {
  const auto isTaken = [](size_t view, size_t light) { return view != 3 && light != 1; };
  studio.split = [&](size_t view, size_t light) {
    return std::optional(isTaken(view, light) ? capture::Split::train : capture::Split::test);
  };
  packed(photograph(studio, folder / "withTest"), "a");
  studio.split = [&](size_t view, size_t light) {
    return isTaken(view, light) ? std::optional(capture::Split::train) : std::nullopt;
  };
  packed(capture::subset(photograph(studio, folder / "without"), [](const capture::Frame&) { return true; }),
         "b");
  EXPECT_EQ(content("a"), content("b"));
  EXPECT_EQ(openModel(folder / "a").rig.views.size(), 4u);
  EXPECT_EQ(openModel(folder / "a").rig.lights.size(), 2u);
}

float percentile995(std::vector<float> values) {
  std::ranges::sort(values);
  return values[static_cast<size_t>(0.995 * static_cast<double>(values.size() - 1))];
}

TEST_F(Pack, WhiteIsThe995thPercentileOfTheObject) {
  const capture::Capture capture = photographed();
  std::vector<float> values;
  for (size_t i = 0; i < capture.frames.size(); ++i) {
    const capture::Photograph photograph = capture::readPhotographs(capture, std::vector{i})[0];
    for (size_t v = 0; v < photograph.radiance.values.size(); ++v)
      if (photograph.alpha.values[v / 3] >= 0.5f) values.push_back(photograph.radiance.values[v]);
  }
  EXPECT_NEAR(packed(capture).white / percentile995(values), 1, 0x1p-12);
}

TEST_F(Pack, WithoutMatteTheSilhouetteOfTheMeshIsStoredAndItsRimContinuesTheInside) {
  studio.matte = false;
  const capture::Capture capture = photographed();
  const PackReport report = packed(capture, "model", packOptions(1500, 0));
  const Model model = openModel(folder / "model");
  const RayCaster<AcquisitionSpace> mesh(readMesh(folder / "capture/mesh.ply"));
  std::vector<float> values; // pixels inside the sphere
  for (size_t v = 0; v < model.files.size(); ++v) {
    const image::Mask outline = image::objectMask(capture::silhouette(capture.views[v].camera, mesh));
    const image::Mask inside = image::eroded(outline, 2);
    const auto source = image::nearestSeeds(inside, outline);
    std::vector<image::Image> photographs;
    for (size_t i = 0; i < capture.frames.size(); ++i)
      if (capture.frames[i].view == v)
        photographs.push_back(capture::readPhotographs(capture, std::vector{i})[0].radiance);
    for (int y = 0; y < outline.height; ++y)
      for (int x = 0; x < outline.width; ++x) {
        const size_t pixel = y * outline.width + x;
        const auto number = model.files[v].find({x / codec::blockSize, y / codec::blockSize});
        const int texel = y % codec::blockSize * codec::blockSize + x % codec::blockSize;
        const codec::Block block = number ? model.files[v].read(*number) : codec::Block();
        ASSERT_EQ(block.present >> texel & 1, outline.inside[pixel]) << v << ": " << x << ", " << y;
        if (!outline.inside[pixel]) continue;
        for (size_t light = 0; light < photographs.size(); ++light) {
          const float* wanted = &photographs[light].values[3 * source[pixel]];
          float stored = 0; // red
          for (int k = 0; k < block.stride; ++k)
            stored += block.light(light)[k] * static_cast<float>(block.texel(texel)[k]);
          EXPECT_NEAR(stored, wanted[0], 2e-3f * report.white) << v << ": " << x << ", " << y;
          if (inside.inside[pixel]) values.insert(values.end(), wanted, wanted + 3);
        }
      }
  }
  EXPECT_NEAR(report.white / percentile995(values), 1, 0x1p-12);
}

// The blend is selected from the photographs, as every view has every light. (The plaster cat of tests/cli
// selects a plane.)
TEST(PackedLights, TheChosenBlendIsTheModels) {
  for (const bool isFullProduct : {true, false}) {
    const studio::PackedStudio packed(isFullProduct ? Studio() : studio::gappyStudio(), 200);
    const auto& [chosen, leftOutDb] = packed.report.lightChoice;
    EXPECT_EQ(leftOutDb.has_value(), isFullProduct);
    const Model& model = packed.model;
    EXPECT_EQ(model.lightBlend, chosen);
    EXPECT_EQ(weights::lightBlend(model, {}), chosen);
    weights::ShadeOptions options;
    options.lights = 7;
    EXPECT_EQ(weights::lightBlend(model, options),
              (weights::LightBlend{7, chosen.fit, chosen.foreshortened}));
    options.lightFit = weights::LightFit::mean;
    options.foreshortened = false;
    EXPECT_EQ(weights::lightBlend(model, options), weights::LightBlend{7});
    options.nearest = true;
    EXPECT_EQ(weights::lightBlend(model, options), weights::LightBlend{1});
  }
}

TEST_F(Pack, TheEstimateComesOnceBeforeTheWork) {
  const capture::Capture capture = photographed();
  std::vector<PackEstimate> estimates;
  const PackReport report =
      pack(capture, folder / "model", packOptions(1500), {}, [&](const PackEstimate& estimate) {
        EXPECT_FALSE(std::filesystem::exists(folder / "model" / viewFilePath(0)));
        estimates.push_back(estimate);
      });
  ASSERT_EQ(estimates.size(), 1u);
  const auto surfels = static_cast<double>(report.surfels);
  EXPECT_NEAR(static_cast<double>(estimates[0].surfels), surfels, 0.05 * surfels);
  const double bytes = static_cast<double>(report.store.fileBytes) + 44 * surfels;
  EXPECT_GT(static_cast<double>(estimates[0].diskBytes), bytes / 1.5);
  EXPECT_LT(static_cast<double>(estimates[0].diskBytes), bytes * 1.5);
}

TEST_F(Pack, TheEstimateLeavesOutWhatIsEnclosed) {
  const capture::Capture capture = photographed();
  const TriangleMesh outer = readMesh(folder / "capture/mesh.ply");
  std::ofstream obj(folder / "nested.obj");
  for (const float scale : {1.f, 0.7f}) // two spheres
    for (const auto& p : outer.positions)
      obj << "v " << scale * p.x() << ' ' << scale * p.y() << ' ' << scale * p.z() << '\n';
  for (const size_t first : {size_t{1}, outer.positions.size() + 1})
    for (const auto& [a, b, c] : outer.triangles)
      obj << "f " << first + a << ' ' << first + b << ' ' << first + c << '\n';
  obj.close();
  PackOptions options = packOptions(1500);
  options.impostor.mesh = folder / "nested.obj";
  size_t estimated = 0;
  const PackReport report = pack(capture, folder / "model", options, {},
                                 [&](const PackEstimate& estimate) { estimated = estimate.surfels; });
  EXPECT_NEAR(static_cast<double>(estimated) / static_cast<double>(report.surfels), 1, 0.05);
}

TEST_F(Pack, AFolderThatIsNoModelIsLeftAlone) {
  const capture::Capture capture = photographed();
  const std::string before = readFile(capture.file);
  const auto complaint = image::errorOf([&] { pack(capture, capture.folder(), packOptions(150), {}, {}); });
  EXPECT_NE(complaint.find("exists and is not a model"), std::string::npos);
  EXPECT_EQ(readFile(capture.file), before);
}

TEST_F(Pack, WhatIsMissingIsSaid) {
  studio.matte = false;
  capture::Capture capture = photographed();
  capture.geometry.clear();
  EXPECT_NE(image::errorOf([&] { packed(capture); }).find("--mesh"), std::string::npos);
  for (capture::Frame& frame : capture.frames) frame.split = capture::Split::test;
  EXPECT_NE(image::errorOf([&] { packed(capture); }).find("found none, expected training frames"),
            std::string::npos);
  image::writeBytes(folder / "file", "");
  EXPECT_NE(image::errorOf([&] { packed(photographed(), "file/model"); }).find("file/model"),
            std::string::npos);
}

} // namespace
} // namespace surflect::model
