#include "srf/import/similarity.h"

#include "srf/import/colmap.h"
#include "srf/import/import.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_formats.h"

namespace surflect::importers {
namespace {

class SimilarityTest : public ::testing::Test {
protected:
  Similarity any() {
    Eigen::Quaterniond q(rig.uniform(-1, 1), rig.uniform(-1, 1), rig.uniform(-1, 1), rig.uniform(-1, 1));
    return {rig.uniform(0.1, 9), q.normalized().toRotationMatrix(), 10 * rig.point()};
  }
  VisionRig rig{5};
};

TEST_F(SimilarityTest, IsFoundFromThreePointsOrMore) {
  for (size_t count = 3; count < 20; ++count) {
    const Similarity wanted = any();
    std::vector<Vec3<double>> from, to;
    for (size_t i = 0; i < count; ++i) from.push_back(rig.point()), to.push_back(wanted(from.back()));
    const Similarity found = similarityBetween(from, to);
    EXPECT_NEAR(found.scale, wanted.scale, 1e-13 * wanted.scale * 10);
    EXPECT_LT((found.rotation - wanted.rotation).norm(), 1e-13);
    EXPECT_LT((found.translation - wanted.translation).norm(), 1e-12);
  }
}

TEST_F(SimilarityTest, MovedCamerasSeeMovedPointsInTheSamePixels) {
  for (int i = 0; i < 50; ++i) {
    const VisionCamera vision = rig.camera(true);
    const Similarity similarity = any();
    const Vec3<double> axes(1, -1, -1);
    capture::Camera<AcquisitionSpace> camera{
        {.width = 16, .height = 12, .focalX = 20, .focalY = 20, .centerX = 8, .centerY = 6},
        {axes.asDiagonal() * vision.rotation.toRotationMatrix(), axes.asDiagonal() * vision.translation}};
    capture::Camera<AcquisitionSpace> other = camera;
    other.cameraFromWorld = moved(camera.cameraFromWorld, similarity);
    const Vec3<double> point = rig.point();
    const auto before = camera.project(assume<Point3<AcquisitionSpace, double>>(point)),
               after = other.project(assume<Point3<AcquisitionSpace, double>>(similarity(point)));
    EXPECT_NEAR(before->x, after->x, 1e-10);
    EXPECT_NEAR(before->y, after->y, 1e-10);
  }
}

TEST_F(SimilarityTest, WhatCannotBeTurnedTogetherIsRefused) {
  std::vector<Vec3<double>> line, points, mirrored, shuffled;
  for (int i = 0; i < 8; ++i) {
    line.push_back(Vec3<double>(1, 2, 3) * i);
    points.push_back(rig.point());
    mirrored.push_back(points.back().cwiseProduct(Vec3<double>(1, 1, -1)));
  }
  shuffled = points;
  std::ranges::rotate(shuffled, shuffled.begin() + 3);
  const auto problem = [](const auto& from, const auto& to) {
    return image::errorOf([&] { similarityBetween(from, to); });
  };
  EXPECT_NE(problem(points, line).find("the known places are on a line"), std::string::npos);
  EXPECT_NE(problem(line, points).find("the poses are on a line"), std::string::npos);
  EXPECT_NE(problem(points, mirrored).find("mirror image"), std::string::npos);
  EXPECT_NE(problem(points, shuffled).find("are names exchanged?"), std::string::npos);
  points.resize(2), mirrored.resize(2);
  EXPECT_NE(problem(points, points).find("found 2, expected known places of three cameras or more"),
            std::string::npos);
}

// Five cameras under two lamps, COLMAP's poses of one lamp, and their places in a world in which they stand.
class KnownPlaces : public SimilarityTest {
protected:
  void SetUp() override {
    for (int c = 0; c < 5; ++c) {
      const std::string name = "c" + std::to_string(c);
      for (const char* const light : {"on", "off"})
        writePicture(folder / "images" / name / (std::string(light) + ".png"));
      images.push_back({name + "/on.png", "PINHOLE", asColmapModel("PINHOLE", rig.camera(false)).second});
      const VisionCamera& camera = images.back().camera;
      const Vec3<double> place = world(-(camera.rotation.inverse() * camera.translation));
      table += name + " " + row(place[0], place[1], place[2]) + "\n";
    }
    std::filesystem::create_directories(folder / "sparse/0");
    image::writeBytes(folder / "sparse/0/cameras.txt", colmapCamerasText(images));
    image::writeBytes(folder / "sparse/0/images.txt", colmapImagesText(images));
    image::writeBytes(folder / "lamps.txt", "on 0 0 2\noff 3 0 0\n");
  }
  ForeignCapture movedBy(const std::string& places) const {
    image::writeBytes(folder / "places.txt", places);
    ForeignCapture source = readColmap(folder.path(), {}, false);
    moveToPlaces(source, folder / "places.txt", "{camera}/{light}.png");
    return source;
  }

  image::TemporaryFolder folder;
  std::vector<ColmapImage> images;
  Similarity world{any()};
  std::string table;
};

TEST_F(KnownPlaces, BringCamerasAndLampsToOneWorld) {
  image::writeBytes(folder / "cameras.txt", table + "c9 1 2 3\n"); // as a file of COLMAP is called
  ImportOptions options{.cameraPlaces = folder / "cameras.txt"};
  options.lamps.pattern = "{camera}/{light}.png", options.lamps.lights = folder / "lamps.txt";
  options.lamps.positions = true;
  writePicture(folder / "masks/c3.png");
  const ImportReport report = importCapture(folder.path(), folder / "out", options);
  EXPECT_EQ(report.masks, 1u); // of both photographs of c3
  EXPECT_TRUE(std::ranges::any_of(report.notes, [](const std::string& n) {
    return n.find("1 mask found by name for 2 of 10 photographs") != n.npos;
  }));
  EXPECT_TRUE(std::ranges::any_of(report.notes, [](const std::string& n) {
    return n == "warning: 1 known place of cameras without a registered picture: c9";
  }));
  const capture::Capture capture = capture::readCapture(folder / "out");
  for (size_t c = 0; c < 5; ++c) {
    const VisionCamera& camera = images[c].camera;
    const auto found = viewNamed(capture, "c" + std::to_string(c)).camera;
    for (int i = 0; i < 10; ++i) {
      const Vec3<double> point = rig.point();
      const auto pixel = found.project(assume<Point3<AcquisitionSpace, double>>(world(point)));
      const Vec2<double> wanted = camera.project(point);
      EXPECT_NEAR(pixel->x, wanted[0], 1e-9);
      EXPECT_NEAR(pixel->y, wanted[1], 1e-9);
    }
  }
  EXPECT_EQ(std::get<capture::PointLight>(capture.lights[0].kind).position.raw(), Vec3<double>(0, 0, 2));
}

TEST_F(KnownPlaces, MistakesAreNamed) {
  const auto problem = [&](const std::string& places) { return image::errorOf([&] { movedBy(places); }); };
  EXPECT_NE(
      problem("a 1 2 3\nb 1 2 4\n").find("places.txt: found \"a\", expected names such as \"c0/on.png\""),
      std::string::npos)
      << problem("a 1 2 3\nb 1 2 4\n");
  EXPECT_NE(problem(table + table).find("line 6: found \"c0\", expected a name of its own"),
            std::string::npos);
  EXPECT_NE(problem("c0 1 2 3\nc1 0 0 0\n").find("found 2, expected known places of three"),
            std::string::npos);
  std::string swapped = table;
  swapped[swapped.find("c4") + 1] = '0', swapped[1] = '4';
  const std::string mixed = problem(swapped);
  const bool isSaid = mixed.find("names exchanged") != mixed.npos;
  EXPECT_TRUE(isSaid || movedBy(swapped).notes.back().starts_with("warning: ")) << mixed;
}

} // namespace
} // namespace surflect::importers
