#include "srf/import/lit_view.h"

#include "srf/capture/rig.h"
#include "srf/import/import.h"
#include "srf/import/text.h"
#include "tests/srf/import/vision_camera.h"

#include <cmath>

namespace surflect::importers {
namespace {

using Towards = Direction3<AcquisitionSpace, double>;

class LitView : public ::testing::Test {
protected:
  // lit.1.png .. lit.N.png: 2 stands before 10 only in natural order.
  void writePictures(int count) const {
    for (int i = 1; i <= count; ++i) writePicture(folder / name(i), 16, 12, static_cast<unsigned>(i));
  }
  static std::string name(int i) { return "lit." + std::to_string(i) + ".png"; }
  Vec3<double> direction() {
    return Vec3<double>(rig.uniform(-1, 1), rig.uniform(-1, 1), rig.uniform(0.2, 1)).normalized();
  }
  static std::string row(const Vec3<double>& v) { return surflect::row(v[0], v[1], v[2]); }
  ForeignCapture read(const std::string& file, const std::string& text,
                      const LitViewOptions& options = {}) const {
    image::writeBytes(folder / file, text);
    return readLitView(folder.path(), folder / file, options, false);
  }
  std::string error(const std::string& file, const std::string& text) const {
    const std::string found = image::errorOf([&] { read(file, text); });
    EXPECT_NE(found.find(file + ": "), std::string::npos) << found;
    return found;
  }
  // Expects picture i to be lit from wanted[i - 1].
  void expectLights(const capture::Capture& capture, const std::vector<Vec3<double>>& wanted) const {
    ASSERT_EQ(capture.frames.size(), wanted.size());
    for (const capture::Frame& frame : capture.frames) {
      const std::string stem = frame.picture.stem();
      const size_t i = std::stoul(stem.substr(4)) - 1;
      const auto& light = capture.lights[*frame.light];
      EXPECT_EQ(light.name, stem);
      EXPECT_NEAR((std::get<capture::DirectionalLight>(light.kind).towards.raw() - wanted[i]).norm(), 0,
                  1e-15);
    }
  }

  image::TemporaryFolder folder;
  VisionRig rig{4};
};

TEST_F(LitView, EveryKindOfLightFileSaysTheSame) {
  constexpr int count = 12;
  writePictures(count);
  std::vector<Vec3<double>> lights;
  for (int i = 0; i < count; ++i) lights.push_back(direction());
  std::string lp = "12\n", lines, counted = "12\n", rows[3], ordinals, stems = "# name,x,y,z\n",
              elsewhere = "12\n";
  for (int i = 1; i <= count; ++i) {
    const Vec3<double>& l = lights[static_cast<size_t>(i - 1)];
    lp.append(name(i)).append("\t").append(row(l)).append("\r\n\r\n");
    elsewhere.append("C:\\Lit pictures\\").append(name(i)).append(" ").append(row(l)).append("\n");
    lines.append(row(l)).append("\n");
    counted.append(row(l)).append("\n");
    for (int axis = 0; axis < 3; ++axis) rows[axis].append(" ").append(digits(l[axis]));
    ordinals = std::to_string(i).append(" ").append(row(l)).append("\n").append(ordinals);
    stems.append("lit.").append(std::to_string(i));
    for (int axis = 0; axis < 3; ++axis) stems.append(", ").append(digits(l[axis]));
    stems.append("\n");
  }
  const std::string columns = rows[0].append("\n").append(rows[1]).append("\n").append(rows[2]);
  for (const std::string& text : {lp, lines, counted, columns, ordinals, stems, elsewhere}) {
    SCOPED_TRACE(text.substr(0, 60));
    expectLights(read("lights.lp", text).capture, lights);
  }
}

TEST_F(LitView, DecimalCommasAreAConventionOfTheWholeFile) {
  writePictures(3);
  const std::vector<Vec3<double>> lights{{0, 0.6, 0.8}, {0.6, 0, 0.8}, {0, 0, 1}};
  for (const char* text : {"3\nlit.1.png 0 0,6 0,8\nlit.2.png 0,6 0 0,8\nlit.3.png 0 0 1\n",
                           "lit.1;0;0,6;8,0e-1\nlit.2;0,6;0;0,8\nlit.3;0;0;1\n",
                           "3\n0\t0,6\t0,8\n0,60\t0\t0,8\n0\t0,0\t1,0\n"}) {
    const ForeignCapture source = read("lights.txt", text);
    expectLights(source.capture, lights);
    EXPECT_EQ(source.notes[0], "the light file has decimal commas");
  }
  EXPECT_EQ(withDecimalPoints("0,1 0,2 0,3 0,4 0,5\n0 1,5 0 0 0\n1 1 1 1 1,0\n"),
            "0.1 0.2 0.3 0.4 0.5\n0 1.5 0 0 0\n1 1 1 1 1.0\n");
  for (const char* commasSeparate :
       {"lit.1.png, 0.1, 0.2, 0.3\n", "lit.1.png,0,0,1\n", "0, 0, 1\n", "1,0,0,1\n"})
    EXPECT_EQ(withDecimalPoints(commasSeparate), commasSeparate);
  EXPECT_NE(error("lights.txt", "lit.1.png 0 0.6 0.8\nlit.2.png 0,6 0 0,8\n")
                .find("line 2: found \"0,6\", and \"0.6\" in line 1, expected either decimal commas or"),
            std::string::npos);
  EXPECT_NE(error("lights.txt", "1 2,3 4\n").find("line 1: \"2,3\" can be one number"), std::string::npos);
  EXPECT_NE(
      error("lights.txt", "lit.1.png,0,0,0,6,0,8\n").find("line 1: found 6 numbers after \"lit.1.png\""),
      std::string::npos);
}

TEST_F(LitView, NamesMayDifferInLetterCaseAndExtensionWhereOnePictureFits) {
  writePictures(2);
  const ForeignCapture source = read("a.lp", "2\nLIT.1.PNG 0 0 1\nC:\\raw\\Lit.2.CR2 0 0.6 0.8\n");
  expectLights(source.capture, {{0, 0, 1}, {0, 0.6, 0.8}});
  ASSERT_EQ(source.notes.size(), 2u);
  EXPECT_NE(source.notes[0].find("1 of 2 names in the list differ from the pictures' in letter case"),
            std::string::npos);
  EXPECT_NE(source.notes[1].find("lit.2.png for \"C:\\raw\\Lit.2.CR2\""), std::string::npos)
      << source.notes[1];
  writePicture(folder / "LIT.2.tif");
  EXPECT_NE(error("a.lp", "1\nlit.2.nef 0 0 1\n").find("line 2: \"lit.2.nef\" can be LIT.2.tif or lit.2.png"),
            std::string::npos);
}

// DiLiGenT: what lies in a folder of the benchmark [Shi et al. 2016].
TEST_F(LitView, AListOfFileNamesSaysWhichPicturesCount) {
  writePictures(4);
  for (const char* other : {"Normal_gt.png", "mask.png", "._mask.png", "._lit.1.png"})
    writePicture(folder / other);
  const std::string lights = "0 0 1\n0 0.6 0.8\n0.6 0 0.8\n1 0 0\n";
  EXPECT_NE(error("light_directions.txt", lights)
                .find("found 5 photographs, of which some are named otherwise (Normal_gt.png), expected 4"),
            std::string::npos);
  image::writeBytes(folder / "filenames.txt", "lit.1.png\r\nlit.3.png\r\nlit.2.png\r\nlit.4.png\r\n");
  expectLights(read("light_directions.txt", lights).capture,
               {{0, 0, 1}, {0.6, 0, 0.8}, {0, 0.6, 0.8}, {1, 0, 0}});
  image::writeBytes(folder / "filenames.txt", "lit.1.png\nlit.2.png\n");
  EXPECT_NE(image::errorOf([&] {
              read("light_directions.txt", lights);
            }).find("filenames.txt: found 2 names, expected 4"),
            std::string::npos);
}

TEST_F(LitView, TheOrthographicCameraLooksDownWithYUpAndUnitHeight) {
  writePictures(1);
  const ForeignCapture source = read("a.lp", "1\nlit.1.png 0 0 1\n");
  const auto& camera = source.capture.views[0].camera;
  const std::pair<Vec3<double>, Vec2<double>> places[] = {
      {{0, 0, 0}, {8, 6}}, {{0, 0.5, 0}, {8, 0}}, {{0, -0.5, 0.3}, {8, 12}}, {{2 / 3., 0, -0.7}, {16, 6}}};
  for (const auto& [point, pixel] : places) {
    const auto found = camera.project(assume<Point3<AcquisitionSpace, double>>(point));
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->x, pixel[0], 1e-12);
    EXPECT_NEAR(found->y, pixel[1], 1e-12);
  }
  const capture::Viewpoint<AcquisitionSpace> viewpoint(camera);
  EXPECT_EQ(viewpoint.towards({0, 0, 0}), Towards(0, 0, 1));
}

TEST_F(LitView, APinholeShowsTheHeightAtTheOrigin) {
  writePictures(1);
  for (const double degrees : {10., 45., 90.}) {
    const ForeignCapture source =
        read("a.lp", "1\nlit.1.png 0 0 1\n",
             {.positions = false, .fieldOfView = Angle::fromDegrees(degrees), .height = 3});
    const auto& camera = source.capture.views[0].camera;
    const auto top = camera.project({0, 1.5, 0}), bottom = camera.project({0, -1.5, 0});
    ASSERT_TRUE(top && bottom);
    EXPECT_NEAR(top->y, 0, 1e-12);
    EXPECT_NEAR(bottom->y, 12, 1e-12);
    EXPECT_NEAR(2 * std::atan(1.5 / camera.center().z()), Angle::fromDegrees(degrees).radians(), 1e-12);
  }
}

TEST_F(LitView, PositionsGiveUnitIrradianceOnAverage) {
  writePictures(3);
  const ForeignCapture source = read("a.lp", "3\nlit.1.png 0 0 2\nlit.2.png 3 0 4\nlit.3.png 0 1 1\n",
                                     {.positions = true, .fieldOfView = {}, .height = 1});
  double mean = 0;
  for (const capture::Light& light : source.capture.lights)
    mean += capture::irradianceAt(light, {0, 0, 0}).g / 3.;
  EXPECT_NEAR(mean, 1, 1e-6);
  EXPECT_EQ(std::get<capture::PointLight>(source.capture.lights[1].kind).position,
            (Point3<AcquisitionSpace, double>(3, 0, 4)));
  EXPECT_TRUE(source.strengthsUnknown);
}

TEST_F(LitView, LampsStandNoFartherThanTheirStrengthsCanBeWritten) {
  writePictures(1);
  const LitViewOptions options{.positions = true, .fieldOfView = {}, .height = 1};
  EXPECT_EQ(
      std::get<capture::PointLight>(read("a.lp", "1\nlit.1.png 0 0 1e6\n", options).capture.lights[0].kind)
          .intensity,
      (Rgb{capture::kMostStrength, capture::kMostStrength, capture::kMostStrength}));
  EXPECT_NE(image::errorOf([&] { read("a.lp", "1\nlit.1.png 0 0 1.1e6\n", options); }).find("within 1e6"),
            std::string::npos);
}

TEST_F(LitView, StrengthsBesideTheLightFileAreTaken) {
  writePictures(2);
  image::writeBytes(folder / "light_intensities.txt", "1 2 3\n0.5 0.25 4\n");
  const ForeignCapture source = read("lights.txt", "0 0 1\n0 0.6 0.8\n");
  EXPECT_FALSE(source.strengthsUnknown);
  EXPECT_EQ(std::get<capture::DirectionalLight>(source.capture.lights[1].kind).irradiance,
            (Rgb{0.5f, 0.25f, 4}));
  image::writeBytes(folder / "light_intensities.txt", "1 2 3\n");
  EXPECT_NE(image::errorOf([&] {
              read("lights.txt", "0 0 1\n0 0.6 0.8\n");
            }).find("light_intensities.txt: found 1"),
            std::string::npos);
  image::writeBytes(folder / "light_intensities.txt", "1 2 3\n1 0 1\n");
  EXPECT_NE(image::errorOf([&] { read("lights.txt", "0 0 1\n0 0.6 0.8\n"); }).find("line 2: "),
            std::string::npos);
}

TEST_F(LitView, OneMaskIsTheMaskOfAllAndTwoAreRefused) {
  writePictures(2);
  writePicture(folder / "lit.mask.png");
  const ForeignCapture source = read("lights.txt", "0 0 1\n0 0.6 0.8\n");
  for (const capture::Frame& frame : source.capture.frames) EXPECT_EQ(frame.mask.filename(), "lit.mask.png");
  writePicture(folder / "mask.png");
  EXPECT_NE(image::errorOf([&] { read("lights.txt", "0 0 1\n0 0.6 0.8\n"); }).find("two masks"),
            std::string::npos);
}

TEST_F(LitView, DirectionsOfAnyLengthAreBroughtToOne) {
  writePictures(2);
  const ForeignCapture source = read("lights.txt", "0 0 7\n0 3 4\n");
  EXPECT_EQ(std::get<capture::DirectionalLight>(source.capture.lights[1].kind).towards, Towards(0, 0.6, 0.8));
  ASSERT_EQ(source.notes.size(), 1u);
  EXPECT_NE(source.notes[0].find("--positions"), std::string::npos);
}

TEST_F(LitView, WhatCannotBeALightFileIsRefused) {
  writePictures(4);
  const std::pair<const char*, const char*> wrongs[] = {
      {"", "lists no light"},
      {"# nothing\n", "lists no light"},
      {";\n;\n;\n", "lists no light"},
      {"0\n", "found 0"},
      {"3\n0 0 1\n", "line 1: found 3, expected 1, as many as lines follow"},
      {"0 0\n", "line 1: found \"0 0\""},
      {"0 0 x\n", "line 1: found \"x\", expected a number"},
      {"\xff\xfe", "text in UTF-16"},
      {"0 0 1\n0 0 1\n", "found 4 photographs, expected 2, as many as lights"},
      {"1 0 0\n0 1 0\n0 0 1\n", "can be lights or columns"},
      {"1 0 0 0\n0 1 0 0\n0 0 1 1\n", "can be lights or columns"},
      {"1 0 0 0 1\n0 1 0 0\n0 0 1 1 1\n", "line 2: found 4, expected 5 numbers"},
      {"lit.1.png 0 0 1\n0 0 1\n", "line 2: found \"0 0 1\", expected a name"},
      {"1\nnone.png 0 0 1\n", "line 2: found \"none.png\", expected a picture"},
      {"2\nlit.1.png 0 0 1\nlit.1 1 0 1\n", "line 3: \"lit.1\" is listed twice"},
      {"1\nlit.1.png 0 0 0\n", "line 2: found length 0, expected a direction"},
      {"1 0 0 1\n2 0 0 1\n3 0 0 1\n5 0 0 1\n", "expected ordinals that follow"},
      {"1\n/etc/hostname 0 0 1\n", "--allow-outside"},
      {"1\n../../../../../../etc/hostname 0 0 1\n", "--allow-outside"}};
  for (const auto& [text, expected] : wrongs) {
    const std::string found = error("lights.txt", text);
    EXPECT_NE(found.find(expected), std::string::npos) << found;
  }
}

TEST_F(LitView, TruncatedLightFilesAreRefusedOrCutTheLastNumber) {
  writePictures(3);
  const std::string text = "3\nlit.1.png 0.125 0.25 0.5\nlit.2.png 0.25 0.125 0.5\nlit.3.png 0.5 0.5 0.625";
  for (size_t length = 0; length < text.size(); ++length) try {
      const ForeignCapture source = read("a.lp", text.substr(0, length));
      EXPECT_GT(length, text.rfind(' ')) << length;
    } catch (const Error&) {
    }
}

// RTIBuilder's project: assembly-files/ has the light file, with paths of the computer that made it.
TEST_F(LitView, AProjectOfRtiBuilderOpensFromEachOfItsPlaces) {
  std::filesystem::create_directories(folder / "coin/assembly-files");
  std::string list = "3\n";
  for (int i = 1; i <= 3; ++i) {
    writePicture(folder / "coin/jpeg-exports" / name(i), 16, 12, static_cast<unsigned>(i));
    list += "C:\\RTI\\coin\\jpeg-exports\\" + name(i) + " " + row(direction()) + "\n";
  }
  image::writeBytes(folder / "coin/assembly-files/coin.lp", list);
  for (const char* source : {"coin", "coin/assembly-files", "coin/assembly-files/coin.lp"}) {
    std::filesystem::remove_all(folder / "out");
    EXPECT_EQ(importCapture(folder / source, folder / "out", {}).pictures, 3u) << source;
  }
  EXPECT_NE(error("wrong.lp", "1\nnone.png 0 0 1\n").find("import FOLDER --lights FILE"), std::string::npos);
}

TEST(NaturalOrder, DigitsCompareAsNumbers) {
  for (const auto& [a, b] : {std::pair("a2", "a10"), std::pair("a", "b"), std::pair("a", "a1"),
                             std::pair("1.9", "1.10"), std::pair("x007y", "x8"), std::pair("", "a"),
                             std::pair("a99999999999999999999998", "a99999999999999999999999")}) {
    EXPECT_TRUE(naturallyBefore(a, b)) << a;
    EXPECT_FALSE(naturallyBefore(b, a)) << a;
    EXPECT_FALSE(naturallyBefore(a, a)) << a;
  }
}

} // namespace
} // namespace surflect::importers
