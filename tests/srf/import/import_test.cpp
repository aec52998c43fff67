#include "srf/import/import.h"

#include "surfel/base/file.h"
#include "tests/srf/import/vision_camera.h"

#include <cmath>
#include <numeric>

namespace surflect::importers {
namespace {

std::vector<std::string> filesIn(const std::filesystem::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(folder));
  std::ranges::sort(files);
  return files;
}

// A Lambert dome of radius 0.4 scene units under lights of known strength; black around it. 16-bit, so
// linear.
class Dome : public ::testing::Test {
protected:
  static constexpr int kLights = 8, kSize = 48;

  Dome() {
    std::filesystem::create_directories(folder / "source");
    std::string lp = std::to_string(kLights).append("\n");
    for (int l = 0; l < kLights; ++l) {
      const double azimuth = l * 2.4, tilt = 0.25 + 0.05 * l;
      const Vec3<double> towards(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                                 std::cos(tilt));
      directions.push_back(towards);
      strengths.push_back(0.6 + 0.1 * ((l * 3) % kLights));
      const std::string name = std::string("p").append(std::to_string(l));
      lp.append(name).append(".png ").append(row(towards[0], towards[1], towards[2])).append("\n");
    }
    image::writeBytes(folder / "source/set.lp", lp);
    photograph(std::vector<Vec3<double>>(kLights, Vec3<double>::Zero()));
  }
  // A gradient of each light's logarithm, per scene unit.
  void photograph(const std::vector<Vec3<double>>& gradients) const {
    for (size_t l = 0; l < kLights; ++l)
      image::writePng(folder / "source" / ("p" + std::to_string(l) + ".png"),
                      picture(directions[l], strengths[l], gradients[l]), 16);
  }
  static bool isDome(int x, int y) { return std::hypot(x + 0.5 - 24, y + 0.5 - 24) < 0.4 * kSize; }
  static image::Image picture(const Vec3<double>& towards, double strength, const Vec3<double>& gradient) {
    image::Image image(kSize, kSize, 3);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        if (!isDome(x, y)) continue;
        const double nx = (x + 0.5 - 24) / kSize, ny = (24 - y - 0.5) / kSize;
        const Vec3<double> normal(nx, ny, std::sqrt(0.25 - nx * nx - ny * ny));
        const double shading = std::max(0.0, normal.normalized().dot(towards));
        const double here = strength * std::exp(gradient.dot(Vec3<double>(nx, ny, 0)));
        for (float& v : image.at(x, y)) v = static_cast<float>(0.6 * here * shading);
      }
    return image;
  }
  capture::Capture imported(const ImportOptions& options = {}) const {
    std::filesystem::remove_all(folder / "out");
    importCapture(folder / "source", folder / "out", options);
    return capture::readCapture(folder / "out");
  }

  image::TemporaryFolder folder;
  std::vector<Vec3<double>> directions;
  std::vector<double> strengths;
};

TEST_F(Dome, StrengthsOfLightsAreEstimatedFromTestPhotographsToo) {
  ImportOptions options;
  options.testEvery = 4;
  for (const bool withMask : {false, true}) {
    if (withMask) options.masks = MaskMaking{.threshold = 0.05};
    const capture::Capture capture = imported(options);
    EXPECT_TRUE(capture.calibration.contains("light_strengths"));
    double mean = 0;
    for (const double strength : strengths) mean += strength / kLights;
    ASSERT_EQ(capture.lights.size(), size_t{kLights});
    for (size_t l = 0; l < kLights; ++l)
      EXPECT_NEAR(std::get<capture::DirectionalLight>(capture.lights[l].kind).irradiance.g,
                  strengths[l] / mean, 0.005);
  }
}

TEST_F(Dome, HowLightsThatTrainFallOffIsEstimatedWhenAsked) {
  std::vector<Vec3<double>> gradients;
  for (int l = 0; l < kLights; ++l) gradients.emplace_back(0.4 * std::cos(3. * l), 0.3 * std::sin(2. * l), 0);
  const Vec3<double> sum = std::accumulate(gradients.begin(), gradients.end(), Vec3<double>(0, 0, 0));
  photograph(gradients);
  for (const auto& fieldOfView : {std::optional<Angle>(), std::optional(Angle::fromDegrees(20))}) {
    ImportOptions options;
    options.litView.fieldOfView = fieldOfView;
    for (const capture::Light& light : imported(options).lights)
      EXPECT_TRUE(std::get<capture::DirectionalLight>(light.kind).isEven());
    options.unevenLights = true;
    capture::Capture capture = imported(options);
    for (size_t l = 0; l < kLights; ++l) {
      const auto& light = std::get<capture::DirectionalLight>(capture.lights[l].kind);
      EXPECT_LT((light.irradianceGradient - (gradients[l] - sum / kLights)).norm(), 3e-5);
    }
    options.test = {"p3"};
    capture = imported(options);
    for (const capture::Frame& frame : capture.frames) {
      const capture::Light& light = capture.lights[*frame.light];
      EXPECT_EQ(std::get<capture::DirectionalLight>(light.kind).isEven(), light.name == "p3");
    }
  }
}

TEST_F(Dome, MasksByThresholdAreTheObject) {
  ImportOptions options;
  options.masks = MaskMaking{.threshold = 0.05};
  const capture::Capture capture = imported(options);
  for (const capture::Frame& frame : capture.frames) EXPECT_EQ(frame.mask, capture.frames[0].mask);
  const image::Image mask = image::readPng(folder / "out" / capture.frames[0].mask).image;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) EXPECT_EQ(mask.at(x, y)[0], isDome(x, y) ? 1 : 0) << x << " " << y;
}

TEST_F(Dome, InvertedMasksAreTurnedBeforeStrengthsAreEstimated) {
  image::Image background(kSize, kSize, 1);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) background.at(x, y)[0] = isDome(x, y) ? 0 : 1;
  image::writePng(folder / "source/mask.png", background);
  ImportOptions options;
  options.invertMasks = true;
  const capture::Capture capture = imported(options);
  EXPECT_EQ(image::readPng(folder / "out" / capture.frames[0].mask).image.at(24, 24)[0], 1);
  const double mean = std::accumulate(strengths.begin(), strengths.end(), 0.) / kLights;
  for (size_t l = 0; l < kLights; ++l)
    EXPECT_NEAR(std::get<capture::DirectionalLight>(capture.lights[l].kind).irradiance.g, strengths[l] / mean,
                0.005);
}

TEST_F(Dome, TheOutputIsWhatTheReportSays) {
  ImportOptions options;
  options.masks = MaskMaking{.threshold = 0.05};
  options.test = {"p3", "p5"};
  const ImportReport report = importCapture(folder / "source", folder / "out", options);
  EXPECT_EQ(report.format, ImportFormat::lights);
  EXPECT_EQ(report.views, 1u);
  EXPECT_EQ(report.lights, size_t{kLights});
  EXPECT_EQ(report.trainingFrames, 6u);
  EXPECT_EQ(report.testFrames, 2u);
  EXPECT_EQ(report.pictures, size_t{kLights});
  EXPECT_EQ(report.masks, 1u);
  uint64_t bytes = 0;
  for (const std::string& file : filesIn(folder / "out"))
    if (file != "transforms.json") bytes += std::filesystem::file_size(folder / "out" / file);
  EXPECT_EQ(report.bytes, bytes);
  for (int l = 0; l < kLights; ++l) {
    const std::string name = std::string("p").append(std::to_string(l)).append(".png");
    EXPECT_EQ(readFile(folder / "source" / name), readFile(folder / "out/images" / name));
  }
}

TEST_F(Dome, HowColoursAreTakenIsSaid) {
  const auto note = [&](const ImportOptions& options) {
    std::filesystem::remove_all(folder / "out");
    for (const std::string& said : importCapture(folder / "source", folder / "out", options).notes)
      if (said.starts_with("colour: ")) return said;
    return std::string();
  };
  const std::filesystem::path first = folder / "source/p0.png";
  image::writePng(first, image::readPng(first).image, 16, image::PngColors::srgb);
  EXPECT_EQ(note({}),
            "colour: 7 pictures as linear (16 bits that state nothing), 1 as sRGB (PNG sRGB chunk)");
  EXPECT_FALSE(
      capture::readCapture(folder / "out").colorSpace); // so that the copies are read in the same way
  ImportOptions options;
  options.colorSpace = capture::ColorSpace::linear;
  EXPECT_EQ(note(options),
            "colour: 7 pictures as linear (color_space), 1 as linear (color_space, over PNG sRGB chunk)");
}

TEST_F(Dome, TheSameSourceGivesTheSameBytes) {
  ImportOptions options;
  options.masks = MaskMaking{.threshold = 0.05};
  importCapture(folder / "source", folder / "a", options);
  importCapture(folder / "source", folder / "b", options);
  ASSERT_EQ(filesIn(folder / "a"), filesIn(folder / "b"));
  for (const std::string& file : filesIn(folder / "a"))
    EXPECT_EQ(readFile(folder / "a" / file), readFile(folder / "b" / file)) << file;
}

TEST_F(Dome, ThreeLightsAreNotCalibratedButImported) {
  std::string lp = "3\n";
  for (const char* line : {"p0.png 0 0 1\n", "p1.png 0 0.6 0.8\n", "p2.png 0.6 0 0.8\n"}) lp += line;
  image::writeBytes(folder / "source/set.lp", lp);
  const capture::Capture capture = imported();
  EXPECT_EQ(capture.calibration.at("light_strengths"), "unknown, taken as equal");
  for (const capture::Light& light : capture.lights)
    EXPECT_EQ(std::get<capture::DirectionalLight>(light.kind).irradiance, (Rgb{1, 1, 1}));
}

TEST_F(Dome, AFailureLeavesNothingBehind) {
  const auto nothingLeft = [&] {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
      if (entry.path().filename() != "source") return false;
    return true;
  };
  ImportOptions options;
  options.test = {"none"};
  EXPECT_NE(image::errorOf([&] {
              importCapture(folder / "source", folder / "out", options);
            }).find("expected a camera or light: "),
            std::string::npos);
  EXPECT_TRUE(nothingLeft());

  Progress progress;
  for (int calls = 0; calls < 1000; calls += 3) { // cancelled at one moment after another
    int left = calls;
    progress.cancelled = [&] { return left-- == 0; };
    try {
      importCapture(folder / "source", folder / "out", {}, progress);
      break; // there were fewer moments
    } catch (const Cancelled&) {
      EXPECT_TRUE(nothingLeft()) << calls;
    }
    ASSERT_LT(calls, 999);
  }
  std::filesystem::remove_all(folder / "out");

  image::writeBytes(folder / "source/p7.png", readFile(folder / "source/p7.png").substr(0, 200));
  EXPECT_NE(image::errorOf([&] { importCapture(folder / "source", folder / "out", {}); }), "");
}

TEST_F(Dome, AnOutputThatHoldsSomethingIsRefusedAndKept) {
  std::filesystem::create_directory(folder / "out");
  importCapture(folder / "source", folder / "out", {}); // empty is fine
  const auto before = filesIn(folder / "out");
  EXPECT_NE(image::errorOf([&] {
              importCapture(folder / "source", folder / "out", {});
            }).find("expected a new folder"),
            std::string::npos);
  EXPECT_EQ(filesIn(folder / "out"), before);
  image::writeBytes(folder / "file", "x");
  EXPECT_NE(image::errorOf([&] { importCapture(folder / "source", folder / "file", {}); }).find("file: "),
            std::string::npos);
  EXPECT_EQ(readFile(folder / "file"), "x");
}

TEST(ImportFormats, AreToldByWhatIsThere) {
  image::TemporaryFolder folder;
  const auto formatIn = [&](const std::string& name) {
    const std::filesystem::path inner = folder / "x";
    std::filesystem::remove_all(inner);
    std::filesystem::create_directories((inner / name).parent_path());
    image::writeBytes(inner / name, "");
    const ImportFormat format = formatOfSource(inner, {});
    return format;
  };
  for (const char* name : {"transforms.json", "transforms_train.json"})
    EXPECT_EQ(formatIn(name), ImportFormat::transforms);
  for (const char* name : {"cameras.bin", "cameras.txt", "sparse/0/cameras.bin", "sparse/cameras.txt",
                           "colmap/sparse/0/cameras.bin"})
    EXPECT_EQ(formatIn(name), ImportFormat::colmap);
  EXPECT_EQ(formatIn("dinoSR_par.txt"), ImportFormat::middlebury);
  for (const char* name : {"a.lp", "b.LP", "lights.txt", "light_directions.txt"})
    EXPECT_EQ(formatIn(name), ImportFormat::lights);
  EXPECT_NE(image::errorOf([&] { formatIn("readme.txt"); }).find("no format known"), std::string::npos);
  EXPECT_NE(image::errorOf([&] { formatOfSource(folder / "none", {}); }).find("No such file"),
            std::string::npos);
  image::writeBytes(folder / "x/a_par.txt", "");
  image::writeBytes(folder / "x/b_par.txt", "");
  EXPECT_NE(image::errorOf([&] { formatOfSource(folder / "x", {}); }).find("two parameter files"),
            std::string::npos);
  EXPECT_EQ(formatOfSource(folder / "x/b_par.txt", {}), ImportFormat::middlebury);
  ImportOptions options;
  options.format = ImportFormat::lights;
  EXPECT_EQ(formatOfSource(folder / "x", options), ImportFormat::lights);
}

class HoldOut : public ::testing::Test {
protected:
  HoldOut() {
    for (int v = 0; v < 6; ++v) capture.views.push_back({std::string("C").append(std::to_string(v)), {}});
    for (int l = 0; l < 4; ++l) {
      const std::string name = std::string("L").append(std::to_string(l));
      capture.lights.push_back(
          {name, l < 2 ? "cluster" : name, capture::DirectionalLight{{0, 0, 1}, {1, 1, 1}}});
    }
    for (size_t v = 0; v < 6; ++v)
      for (size_t l = 0; l < 4; ++l) capture.frames.push_back({.view = v, .light = l});
  }
  size_t tests() const {
    return static_cast<size_t>(std::ranges::count_if(
        capture.frames, [](const capture::Frame& f) { return f.split == capture::Split::test; }));
  }

  capture::Capture capture;
};

TEST_F(HoldOut, NamesAreThoseOfCamerasOfLightsAndOfClusters) {
  holdOut(capture, {"C1", "L0"}, 0); // L1 is the same light as L0
  for (const capture::Frame& frame : capture.frames)
    EXPECT_EQ(frame.split == capture::Split::test, frame.view == 1 || *frame.light < 2);
}

TEST_F(HoldOut, EachNthCameraAndOfOneCameraEachNthLight) {
  holdOut(capture, {}, 3);
  for (const capture::Frame& frame : capture.frames)
    EXPECT_EQ(frame.split == capture::Split::test, frame.view == 2 || frame.view == 5);
  capture::Capture one =
      capture::subset(capture, [](const capture::Frame& frame) { return frame.view == 0; });
  holdOut(one, {}, 3); // cluster, L2, L3
  for (const capture::Frame& frame : one.frames)
    EXPECT_EQ(frame.split == capture::Split::test, *frame.light == 3);
}

TEST_F(HoldOut, WhatTheSourceHoldsOutStaysOut) {
  capture.frames[0].split = capture::Split::test;
  holdOut(capture, {"C5"}, 0);
  EXPECT_EQ(tests(), 5u);
}

TEST_F(HoldOut, UnknownNamesAndEmptyTrainingAreRefused) {
  EXPECT_EQ(image::errorOf([&] { holdOut(capture, {"C9"}, 0); }),
            "--test: found \"C9\", expected a camera or light: C0, C1, C2, ..");
  EXPECT_NE(image::errorOf([&] { holdOut(capture, {"c3"}, 0); }).find("; did you mean C3?"),
            std::string::npos);
  EXPECT_NE(image::errorOf([&] { holdOut(capture, {}, 1); }).find("no photograph is left"),
            std::string::npos);
}

} // namespace
} // namespace surflect::importers
