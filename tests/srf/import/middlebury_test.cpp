#include "srf/import/middlebury.h"

#include "srf/import/import.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_formats.h"

namespace surflect::importers {
namespace {

class Middlebury : public ::testing::Test {
protected:
  Middlebury() {
    for (int i = 0; i < 4; ++i) {
      cameras.push_back(rig.camera(false));
      writePicture(folder / name(i));
    }
  }
  static std::string name(int i) { return "ring" + std::to_string(i) + ".png"; }

  std::string line(int i, double scale = 1, double skew = 0) const {
    return middleburyLine(name(i), cameras[static_cast<size_t>(i)], scale, skew);
  }
  std::string whole() const {
    std::string text = "4\n";
    for (int i = 0; i < 4; ++i) text += line(i, i + 1.);
    return text;
  }
  ForeignCapture read(const std::string& text) const {
    image::writeBytes(folder / "ring_par.txt", text);
    return readMiddlebury(folder / "ring_par.txt", false);
  }
  std::string error(const std::string& text) const {
    const std::string found = image::errorOf([&] { read(text); });
    EXPECT_NE(found.find("ring_par.txt: "), std::string::npos) << found;
    return found;
  }

  image::TemporaryFolder folder;
  VisionRig rig{2};
  std::vector<VisionCamera> cameras;
};

TEST_F(Middlebury, PixelsAreThoseOfTheProjectionAndAHalf) {
  const ForeignCapture source = read(whole());
  ASSERT_EQ(source.capture.views.size(), 4u);
  for (size_t i = 0; i < 4; ++i) rig.expectSamePixels(source.capture.views[i].camera, cameras[i], 0.5);
  EXPECT_TRUE(source.capture.lights.empty());
}

TEST_F(Middlebury, TheImportedFolderKeepsThePixelsToo) {
  read(whole());
  ImportOptions options;
  options.testEvery = 4;
  const ImportReport report = importCapture(folder.path(), folder / "out", options);
  EXPECT_EQ(report.format, ImportFormat::middlebury);
  const capture::Capture capture = capture::readCapture(folder / "out");
  for (int i = 0; i < 4; ++i)
    rig.expectSamePixels(viewNamed(capture, "ring" + std::to_string(i)).camera,
                         cameras[static_cast<size_t>(i)], 0.5);
  EXPECT_EQ(capture.frames[3].split, capture::Split::test);
}

TEST_F(Middlebury, SkewAndOtherMatricesAreRefused) {
  EXPECT_NE(error("1\n" + line(0, 1, 0.01)).find("line 2.k12: found 0.01, expected no skew"),
            std::string::npos);
  cameras[0].fx = -cameras[0].fx;
  EXPECT_NE(error("1\n" + line(0)).find("line 2: found -"), std::string::npos);
  std::string text = "1\n" + line(1);
  const size_t zero = text.find(" 0 ", text.find(" 0 ") + 2);
  text.replace(zero, 3, " 1 ");
  EXPECT_NE(error(text).find("line 2.K: "), std::string::npos);
}

TEST_F(Middlebury, WhatIsNoRotationIsRefused) {
  std::string text = "1\n" + line(0);
  const Mat3<double> r = cameras[0].rotation.toRotationMatrix();
  for (const auto& [value, expected] : {std::pair(2 * r(0, 0), "not orthonormal"), std::pair(-r(0, 0), "")}) {
    std::string wrong = text;
    wrong.replace(wrong.find(digits(r(0, 0))), digits(r(0, 0)).size(), digits(value));
    EXPECT_NE(error(wrong).find(std::string("expected a rotation")), std::string::npos);
    EXPECT_NE(error(wrong).find(expected), std::string::npos);
  }
  cameras[0].rotation = Eigen::Quaterniond::Identity();
  text = "1\n" + line(0);
  const std::string identity = row(1., 0., 0., 0., 1., 0., 0., 0., 1.),
                    mirror = row(-1., 0., 0., 0., 1., 0., 0., 0., 1.);
  text.replace(text.find(identity), identity.size(), mirror);
  EXPECT_NE(error(text).find("found a reflection"), std::string::npos);
}

TEST_F(Middlebury, ARoundedRotationIsSaidAndAScaledOneRefused) {
  cameras[0].rotation = Eigen::Quaterniond::Identity();
  const std::string text = "1\n" + line(0), identity = row(1., 0., 0., 0., 1., 0., 0., 0., 1.);
  const auto with = [&](const std::string& rotation) {
    return std::string(text).replace(text.find(identity), identity.size(), rotation);
  };
  const ForeignCapture source = read(with(row(1.0005, 0., 0., 0., 1., 0., 0., 0., 1.)));
  EXPECT_EQ(source.notes.at(1), "1 rotation is rounded, off by up to 0.001; the nearest rotation is taken");
  rig.expectSamePixels(source.capture.views[0].camera, cameras[0], 0.5);
  EXPECT_NE(error(with(row(2., 0., 0., 0., 2., 0., 0., 0., 2.))).find("not orthonormal by 3"),
            std::string::npos);
}

TEST_F(Middlebury, OnlyGoodSilhouettesBecomeMasksByThreshold) {
  read(whole());
  ImportOptions options;
  options.masks = MaskMaking{.threshold = 0.05};
  EXPECT_EQ(importCapture(folder / "ring_par.txt", folder / "all", options).masks, 4u);
  image::writeBytes(folder / "ring_good_silhouette_images.txt", "ring1.png\nring3.png\nring7.png\n");
  const ImportReport report = importCapture(folder / "ring_par.txt", folder / "good", options);
  EXPECT_EQ(report.masks, 2u);
  EXPECT_TRUE(std::ranges::any_of(report.notes, [](const std::string& note) {
    return note.starts_with("masks by brightness") && note.find(" for 2 of 4 views") != note.npos;
  }));
  for (const capture::Frame& frame : capture::readCapture(folder / "good").frames)
    EXPECT_EQ(frame.mask.empty(), frame.picture == "images/ring0.png" || frame.picture == "images/ring2.png");
  image::writeBytes(folder / "ring_good_silhouette_images.txt", "ring7.png\n");
  EXPECT_NE(image::errorOf([&] {
              importCapture(folder / "ring_par.txt", folder / "none", options);
            }).find("could be segmented: ring0 (its silhouette is not good"),
            std::string::npos);
}

TEST_F(Middlebury, CountsAndNamesMustFit) {
  EXPECT_NE(error("3\n" + line(0)).find("line 1: found 3, expected 1, as many as lines follow"),
            std::string::npos);
  EXPECT_NE(error("").find("expected the number of pictures"), std::string::npos);
  EXPECT_NE(error("0\n").find("lists no picture"), std::string::npos);
  EXPECT_NE(error("2\n" + line(0) + line(0)).find("\"ring0.png\" is listed twice"), std::string::npos);
  std::filesystem::remove(folder / "ring1.png");
  EXPECT_NE(error("1\n" + line(1)).find("line 2: found \"ring1.png\", expected a file in"),
            std::string::npos);
}

TEST_F(Middlebury, EveryTruncationIsRefusedOrOnlyCutsTheLastDigits) {
  const std::string text = "1\n" + line(0);
  size_t accepted = 0;
  for (size_t length = 0; length < text.size(); ++length) try {
      read(text.substr(0, length));
      ++accepted;
    } catch (const Error&) {
    }
  EXPECT_LE(accepted, digits(cameras[0].translation[2]).size() + 1); // of t3
}

} // namespace
} // namespace surflect::importers
