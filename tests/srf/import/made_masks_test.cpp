// Masks of the example vase, photographed before a table and before a green screen, against its alpha.
#include "srf/import/made_masks.h"

#include "srf/capture/mask_file.h"
#include "srf/image/mask.h"
#include "srf/image/png.h"
#include "srf/import/import.h"
#include "srf/import/text.h"
#include "surfel/base/file.h"
#include "surfel/geometry/mesh.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_captures.h"

#include <regex>
#include <span>

namespace surflect::importers {
namespace {

const std::filesystem::path kVase = std::filesystem::path(__FILE__).parent_path() / "../../../examples/vase";

class MadeMasks : public ::testing::Test {
protected:
  // Folders of both scenes, written once and copied by each test.
  static const std::filesystem::path& scenes() {
    static const image::TemporaryFolder written;
    static const std::filesystem::path folder = [] {
      const auto views = photographedByOthers(capture::readCapture(kVase), 0, 5);
      writeBeforeBackdrop(views, Backdrop::table, written / "table");
      writeBeforeBackdrop(views, Backdrop::screen, written / "screen");
      return written.path();
    }();
    return folder;
  }

  MadeMasks() { std::filesystem::copy(scenes(), folder.path(), std::filesystem::copy_options::recursive); }

  // Smallest overlap of a mask with the truth. `how`: as parseMaskMaking() reads it, or mesh:FILE.
  double overlapOf(const std::string& scene, const std::string& how, double margin = 0) {
    std::filesystem::remove_all(folder / "out");
    ImportOptions options;
    if (how.starts_with("mesh:")) options.mesh = how.substr(5);
    options.masks = parseMaskMaking(options.mesh.empty() ? how : "mesh");
    options.masks->margin = margin;
    notes.clear();
    for (const std::string& note : importCapture(folder / scene, folder / "out", options).notes)
      notes += note + "\n";
    double least = 1;
    for (const capture::Frame& frame : capture::readCapture(folder / "out").frames) {
      if (frame.mask.empty()) continue;
      const auto truth = capture::readMask(folder / scene / "truth" / frame.picture.filename()).coverage;
      const auto mask = capture::readMask(folder / "out" / frame.mask).coverage;
      least =
          std::min(least, image::intersectionOverUnion(image::objectMask(mask), image::objectMask(truth)));
    }
    return least;
  }
  std::string problemOf(const std::string& scene, const std::string& how) {
    return image::errorOf([&] { overlapOf(scene, how); });
  }
  std::string at(const char* path) const { return (folder / path).string(); }

  image::TemporaryFolder folder;
  std::string notes; // a line each
};

TEST_F(MadeMasks, FitTheObjectEachWay) {
  EXPECT_GT(overlapOf("table", "plate:" + at("table/plates")), 0.98);
  EXPECT_EQ(notes.find("warning"), std::string::npos) << notes;
  EXPECT_GT(overlapOf("screen", "plate:" + at("screen/plates/C00.png")), 0.985);
  EXPECT_GT(overlapOf("screen", "key"), 0.985);
  EXPECT_EQ(notes.find("warning"), std::string::npos) << notes;
  EXPECT_NE(notes.find("masks by key, #"), std::string::npos) << notes;
  EXPECT_GT(overlapOf("screen", "key:#00b050"), 0.985);
  EXPECT_GT(overlapOf("table", "mesh:" + (kVase / "vase.ply").string()), 0.994);
  EXPECT_EQ(notes.find("warning"), std::string::npos) << notes;
  EXPECT_EQ(capture::readCapture(folder / "out").geometry, "geometry/vase.ply");
}

TEST_F(MadeMasks, AMarginMovesTheOutline) {
  const std::string how = "mesh:" + (kVase / "vase.ply").string();
  const auto pixels = [&](double margin) {
    overlapOf("table", how, margin);
    const auto mask = capture::readMask(folder / "out/masks/C00.png").coverage;
    return static_cast<double>(std::ranges::count(image::objectMask(mask).inside, 1));
  };
  const double plain = pixels(0), wide = pixels(2), narrow = pixels(-2);
  EXPECT_GT(wide, 1.05 * plain);
  EXPECT_LT(narrow, 0.95 * plain);
  EXPECT_NEAR(wide - plain, plain - narrow, 0.3 * (wide - plain)); // the outline is longer outside
}

TEST_F(MadeMasks, AMeshIsSeenThroughTheDistortionOfTheLens) {
  const std::filesystem::path cameras = folder / "table/sparse/0/cameras.txt";
  std::string bent;
  const std::string content = readFile(cameras);
  for (const TextLine& line : sayingLinesOf(content)) {
    const std::vector<std::string_view> words = wordsOf(line.text);
    ASSERT_EQ(words[1], "PINHOLE");
    bent += std::string(words[0]) + " OPENCV";
    for (const std::string_view word : std::span(words).subspan(2)) bent += " " + std::string(word);
    bent += " 0.3 0.1 0.02 -0.01\n";
  }
  image::writeBytes(cameras, bent);
  EXPECT_LT(overlapOf("table", "mesh:" + (kVase / "vase.ply").string()), 0.96); // it is elsewhere now
  const TriangleMesh mesh = readMesh(kVase / "vase.ply");
  for (const capture::Frame& frame : capture::readCapture(folder / "out").frames) {
    const capture::Capture capture = capture::readCapture(folder / "out");
    const image::Image mask = capture::readMask(folder / "out" / frame.mask).coverage;
    size_t inside = 0, seen = 0;
    for (const auto& position : mesh.positions) {
      const auto pixel = capture.views[frame.view].camera.project(position.cast<double>());
      if (!pixel || !capture::contains(capture.views[frame.view].camera.lens, *pixel)) continue;
      ++seen;
      inside += mask.at(static_cast<int>(pixel->x), static_cast<int>(pixel->y))[0] > 0;
    }
    EXPECT_GT(inside, seen - seen / 200) << frame.picture; // all but those at the outline
  }
}

TEST_F(MadeMasks, EachLightMayHaveItsPlate) {
  const std::filesystem::path source = folder / "table";
  for (const char* place : {"images", "plates"}) {
    const std::vector<std::filesystem::path> pictures = picturesIn(source / place);
    for (const std::filesystem::path& picture : pictures) {
      const std::filesystem::path camera = source / place / picture.stem();
      std::filesystem::create_directories(camera);
      const image::Image bright = image::readPng(picture).image;
      image::Image dim = bright;
      for (size_t i = 0; i < dim.values.size(); ++i) dim.values[i] *= i % 3 == 2 ? 0.8f : 0.5f;
      image::writePng(camera / "day.png", bright);
      image::writePng(camera / "night.png", dim);
      std::filesystem::remove(picture);
    }
  }
  const std::filesystem::path poses = source / "sparse/0/images.txt";
  image::writeBytes(poses, std::regex_replace(readFile(poses), std::regex("\\.png"), "/day.png"));
  image::writeBytes(folder / "lamps.txt", "day 0 0 1\nnight 1 0 0\n");
  ImportOptions options;
  options.lamps = {.pattern = "{camera}/{light}.png", .lights = folder / "lamps.txt"};
  options.masks = parseMaskMaking("plate:" + (source / "plates").string());
  const ImportReport report = importCapture(source, folder / "out", options);
  EXPECT_EQ(report.masks, 7u);
  const auto mask = [&] {
    return image::objectMask(capture::readMask(folder / "out/masks/C00/day.png").coverage);
  };
  const auto truth = image::objectMask(capture::readMask(source / "truth/C00.png").coverage);
  EXPECT_GT(image::intersectionOverUnion(mask(), truth), 0.98);

  // Photographs without a plate of their own do not vote.
  for (const std::filesystem::path& camera : {source / "plates/C00", source / "plates/C06"})
    std::filesystem::remove(camera / "night.png");
  std::filesystem::remove_all(folder / "out");
  importCapture(source, folder / "out", options);
  EXPECT_GT(image::intersectionOverUnion(mask(), truth), 0.98);
}

TEST_F(MadeMasks, AnExposureIsComparedWithItsPlate) {
  overlapOf("screen", "key");
  capture::Capture whole = capture::readCapture(folder / "out");
  ForeignCapture source{.files = {folder / "screen/images"}};
  source.capture.colorSpace = whole.colorSpace;
  source.capture.views = {whole.views[0]};
  // The first photograph is of another scene, which does not vote.
  source.capture.frames = {{.view = 0, .picture = folder / "table/images/C00.png"},
                           {.view = 0, .picture = folder / "screen/images/C00.png", .exposure = 8}};
  std::filesystem::create_directories(folder / "made");
  Copies copies(source.files.root, folder / "made");
  makeMasks(source, folder / "screen", parseMaskMaking("plate:" + at("screen/plates/C00.png")), copies, {});
  const image::Image mask = capture::readMask(source.capture.frames[1].mask).coverage;
  const image::Image truth = capture::readMask(folder / "screen/truth/C00.png").coverage;
  EXPECT_GT(image::intersectionOverUnion(image::objectMask(mask), image::objectMask(truth)), 0.985);
  EXPECT_EQ(source.capture.calibration["masks"], "by plate plates/C00.png");
}

TEST_F(MadeMasks, CanBeCancelled) {
  for (const char* how : {"key", "mesh"}) {
    ImportOptions options;
    options.masks = parseMaskMaking(how);
    options.mesh = kVase / "vase.ply";
    bool isMaking = false;
    const Progress progress{.report = [&](std::string_view stage, double) { isMaking = stage == "masks"; },
                            .cancelled = [&] { return isMaking; }};
    EXPECT_THROW(importCapture(folder / "screen", folder / "cancelled", options, progress), Cancelled) << how;
    EXPECT_TRUE(isMaking) << how;
    EXPECT_FALSE(std::filesystem::exists(folder / "cancelled")) << how;
  }
}

TEST_F(MadeMasks, AMeshBesideThePicturesIsFound) {
  std::filesystem::copy_file(kVase / "vase.ply", folder / "stranger.ply"); // beside the source, not in it

  EXPECT_NE(problemOf("table", "mesh").find("found none, expected one mesh"), std::string::npos);
  std::filesystem::copy_file(kVase / "vase.ply", folder / "table/vase.ply");
  EXPECT_GT(overlapOf("table", "mesh"), 0.994);
  std::filesystem::copy_file(kVase / "vase.ply", folder / "table/other.ply");
  EXPECT_NE(problemOf("table", "mesh").find("found other.ply, vase.ply, expected one mesh"),
            std::string::npos)
      << problemOf("table", "mesh");
}

TEST_F(MadeMasks, AMeshThatIsElsewhereIsToldOrRefused) {
  const auto movedBy = [&](const Vec3<double>& shift) {
    const TriangleMesh mesh = readMesh(kVase / "vase.ply");
    std::string text;
    for (const auto& position : mesh.positions) {
      const Vec3<double> p = position.raw().cast<double>() + shift;
      text += "v " + numberText(p.x()) + " " + numberText(p.y()) + " " + numberText(p.z()) + "\n";
    }
    for (const auto& triangle : mesh.triangles)
      text += "f " + std::to_string(triangle[0] + 1) + " " + std::to_string(triangle[1] + 1) + " " +
              std::to_string(triangle[2] + 1) + "\n";
    image::writeBytes(folder / "moved.obj", text);
    return "mesh:" + at("moved.obj");
  };
  EXPECT_LT(overlapOf("table", movedBy({0.3, 0, 0})), 0.8);
  EXPECT_NE(notes.find("warning: "), std::string::npos) << notes;
  const std::string problem = problemOf("table", movedBy({0, 0, 500}));
  EXPECT_NE(problem.find("could be segmented"), std::string::npos) << problem;
}

TEST_F(MadeMasks, PlatesThatDoNotFitAreToldInALine) {
  const std::filesystem::path plates = folder / "table/plates";
  std::filesystem::copy_file(folder / "screen/plates/C00.png", plates / "C00.png",
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::remove(plates / "C12.png");
  EXPECT_GT(overlapOf("table", "plate:" + plates.string()), 0.98);
  EXPECT_NE(notes.find("warning: no mask could be made in 2 of 7 views: C00 (the background explains "),
            std::string::npos)
      << notes;
  EXPECT_NE(notes.find("C12 (there is no plate of its name)"), std::string::npos) << notes;

  image::writePng(plates / "C06.png", image::Image(100, 192, 3));
  EXPECT_EQ(problemOf("table", "plate:" + plates.string()),
            (plates / "C06.png").string() +
                ": size: found 100 x 192, expected 192 x 192, as the photographs of C06");
  std::filesystem::create_directories(folder / "empty");
  EXPECT_EQ(problemOf("table", "plate:" + at("empty")),
            at("empty") + ": found no picture, expected plates, pictures named like photographs or cameras");
  EXPECT_EQ(problemOf("table", "plate:" + at("none")),
            at("none") + ": found none, expected a picture, or a folder of pictures");
  const std::string problem = problemOf("table", "plate:" + at("screen/plates"));
  EXPECT_NE(problem.find("none of 7 views could be segmented: C00 (the background explains "),
            std::string::npos)
      << problem;
}

TEST_F(MadeMasks, AKeyThatIsNotThereIsRefusedAndOneThatTheObjectHasIsTold) {
  const std::string problem = problemOf("screen", "key:255,0,0");
  EXPECT_NE(
      problem.find("none of 7 views could be segmented: C00 (less than 20 % of its border have the key"),
      std::string::npos)
      << problem;
  overlapOf("table", "key"); // the vase is of the table's brown
  EXPECT_NE(notes.find("C06 (cuts away what others show)"), std::string::npos) << notes;
}

TEST_F(MadeMasks, AMaskThatIsTooLargeOrTooSmallIsNamed) {
  // A bright speck on the table, in one view, becomes object; in another view part of the vase is covered.
  const auto paint = [&](const char* name, int x0, int y0, int x1, int y1, std::array<float, 3> color) {
    const std::filesystem::path path = folder / "screen/images" / name;
    image::Image image = image::readPng(path).image;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) std::ranges::copy(color, image.at(x, y).begin());
    image::writePng(path, image);
  };
  paint("C06.png", 120, 60, 192, 100, {1, 1, 1});
  const image::Image plate = image::readPng(folder / "screen/plates/C12.png").image;
  std::filesystem::path path = folder / "screen/images/C12.png";
  image::Image image = image::readPng(path).image;
  for (int y = 80; y < 120; ++y)
    for (int x = 0; x < 192; ++x) std::ranges::copy(plate.at(x, y), image.at(x, y).begin());
  image::writePng(path, image);
  overlapOf("screen", "key");
  EXPECT_NE(notes.find(
                "touches the picture's border, as of a cropped object or of background in 1 of 7 views: C06"),
            std::string::npos)
      << notes;
  EXPECT_NE(notes.find("C06 ("), std::string::npos) << notes;
  EXPECT_NE(notes.find("C12 (cuts away what others show)"), std::string::npos) << notes;
}

TEST(MaskMaking, IsAWordAndItsValue) {
  EXPECT_EQ(parseMaskMaking("brightness:0.05").threshold, 0.05);
  EXPECT_EQ(parseMaskMaking("plate:a:b/c").path, "a:b/c");
  EXPECT_EQ(parseMaskMaking("mesh").path, "");
  EXPECT_FALSE(parseMaskMaking("key").key);
  EXPECT_EQ(*parseMaskMaking("key:#ff0000").key, (Rgb{1, 0, 0}));
  EXPECT_EQ(*parseMaskMaking("key:0,0,255").key, (Rgb{0, 0, 1}));
  for (const char* wrong : {"",
                            "plate",
                            "plate:",
                            "brightness",
                            "brightness:2",
                            "brightness:nan",
                            "brightness:-1",
                            "keys",
                            "key:",
                            "key:green",
                            "key:#00ff0",
                            "key:#00ff000",
                            "key:#-1ff00",
                            "key:#zzzzzz",
                            "key:1,2",
                            "key:1,2,256",
                            "key:1,2,-3",
                            "key:1,2,3,4",
                            "mesh:",
                            "mesh:object.ply"})
    EXPECT_NE(image::errorOf([&] { parseMaskMaking(wrong); }), "") << wrong;
}

} // namespace
} // namespace surflect::importers
