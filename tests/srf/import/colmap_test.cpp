#include "srf/import/colmap.h"

#include "srf/import/import.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_formats.h"

#include <cstring>

namespace surflect::importers {
namespace {

class Colmap : public ::testing::Test {
protected:
  ColmapImage& add(const std::string& name, const std::string& model) {
    images.push_back({name, model, asColmapModel(model, rig.camera(true)).second});
    writePicture(folder / "images" / name);
    return images.back();
  }
  void addOneOfEachModel() {
    for (const char* model : colmapModels) add(std::string("im_").append(model).append(".png"), model);
  }

  std::string camerasText() const { return colmapCamerasText(images); }
  std::string imagesText() const { return colmapImagesText(images); }
  std::string camerasBinary() const { return colmapCamerasBinary(images); }
  std::string imagesBinary() const { return colmapImagesBinary(images); }
  void writeText() const {
    std::filesystem::create_directories(folder / "sparse/0");
    image::writeBytes(folder / "sparse/0/cameras.txt", camerasText());
    image::writeBytes(folder / "sparse/0/images.txt", imagesText());
  }
  void writeBinary() const {
    std::filesystem::create_directories(folder / "sparse/0");
    image::writeBytes(folder / "sparse/0/cameras.bin", camerasBinary());
    image::writeBytes(folder / "sparse/0/images.bin", imagesBinary());
  }
  ForeignCapture read() const { return readColmap(folder.path(), {}, false); }
  void expectAllImages(const capture::Capture& capture) {
    ASSERT_EQ(capture.views.size(), images.size());
    for (const ColmapImage& image : images)
      rig.expectSamePixels(viewNamed(capture, std::filesystem::path(image.name).replace_extension()).camera,
                           image.camera);
  }

  image::TemporaryFolder folder;
  VisionRig rig{1};
  std::vector<ColmapImage> images;
};

TEST_F(Colmap, TextAndBinaryKeepThePixelsOfEveryModel) {
  addOneOfEachModel();
  writeText();
  expectAllImages(read().capture);
  std::filesystem::remove_all(folder / "sparse");
  writeBinary();
  expectAllImages(read().capture);
}

TEST_F(Colmap, TheImportedFolderKeepsThePixelsToo) {
  addOneOfEachModel();
  add("below/im.png", "PINHOLE");
  writeBinary();
  importCapture(folder.path(), folder / "out", {});
  const capture::Capture capture = capture::readCapture(folder / "out");
  expectAllImages(capture);
  for (const capture::Frame& frame : capture.frames)
    EXPECT_EQ(frame.picture, std::filesystem::path("images") / (capture.views[frame.view].identity + ".png"));
}

TEST_F(Colmap, ACameraAtTheOriginLooksAlongZWithYDown) {
  ColmapImage& image = add("a.png", "PINHOLE");
  image.camera.rotation = Eigen::Quaterniond::Identity();
  image.camera.translation = {0, 0, 0};
  writeText();
  const ForeignCapture source = read();
  const auto& camera = source.capture.views[0].camera;
  const auto& lens = camera.lens;
  const auto ahead = camera.project({0, 0, 1}), right = camera.project({1, 0, 1}),
             down = camera.project({0, 1, 1});
  ASSERT_TRUE(ahead && right && down);
  EXPECT_DOUBLE_EQ(ahead->x, lens.centerX);
  EXPECT_DOUBLE_EQ(ahead->y, lens.centerY);
  EXPECT_DOUBLE_EQ(right->x, lens.centerX + lens.focalX);
  EXPECT_DOUBLE_EQ(down->y, lens.centerY + lens.focalY);
  EXPECT_FALSE(camera.project({0, 0, -1}));
}

TEST_F(Colmap, RoundedQuaternionsAreSaid) {
  add("a.png", "PINHOLE").camera.rotation = Eigen::Quaterniond(0.5002, 0.5002, 0.5002, 0.5002);
  writeText();
  const ForeignCapture source = read();
  EXPECT_EQ(std::ranges::count(source.notes,
                               "1 rotation is rounded, off by up to 0.0004; the nearest rotation is taken"),
            1);
  Mat3<double> turned; // x to y to z to x, then y and z turn around
  turned << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  EXPECT_NEAR((source.capture.views[0].camera.cameraFromWorld.rotation() - turned).norm(), 0, 1e-15);
}

TEST_F(Colmap, NamesCanHaveBlanksAndFolders) {
  add("a b/c d.png", "PINHOLE");
  writeText();
  EXPECT_EQ(read().capture.views[0].identity, "a b/c d");
}

TEST_F(Colmap, PicturesThatDifferOnlyInTheirExtensionKeepIt) {
  add("a.png", "PINHOLE");
  images.push_back(images[0]);
  images.back().name = "a.PNG";
  writePicture(folder / "images/a.PNG");
  writeText();
  const ForeignCapture source = read();
  EXPECT_EQ(source.capture.views[0].identity, "a.PNG");
  EXPECT_EQ(source.capture.views[1].identity, "a.png");
}

TEST_F(Colmap, MasksBesideThePicturesAreTaken) {
  add("a.png", "PINHOLE");
  add("b.png", "PINHOLE");
  writePicture(folder / "masks/a.png.png");
  writeText();
  importCapture(folder.path(), folder / "out", {});
  const capture::Capture capture = capture::readCapture(folder / "out");
  EXPECT_EQ(capture.frames[0].mask, "masks/a.png.png");
  EXPECT_EQ(capture.frames[1].mask, "");
}

TEST_F(Colmap, TheLargestOfSeveralModelsIsTakenAndTheOthersNamed) {
  add("a.png", "PINHOLE");
  writeText();
  std::filesystem::rename(folder / "sparse/0", folder / "sparse/2");
  add("b.png", "PINHOLE");
  writeText();
  std::filesystem::rename(folder / "sparse/0", folder / "sparse/10");
  writePicture(folder / "images/rig/c.png"); // not registered
  writeBinary();
  image::writeBytes(folder / "sparse/0/images.bin", "");
  const ImportReport report = importCapture(folder.path(), folder / "out", {});
  EXPECT_EQ(report.views, 2u);
  const std::string& models = report.notes[0];
  EXPECT_EQ(models.find("of 3 COLMAP models the largest is taken"), 0u) << models;
  EXPECT_NE(models.find("sparse/10 (2 photographs); left out: "), std::string::npos) << models;
  EXPECT_NE(models.find("sparse/2 (1 photographs)"), std::string::npos) << models;
  EXPECT_NE(models.find("sparse/0 (cannot be read: "), std::string::npos) << models;
  EXPECT_TRUE(std::ranges::any_of(
      report.notes, [](const std::string& note) { return note.ends_with("not used: 1 (rig/c.png)"); }));
}

TEST_F(Colmap, MasksOfFullSizeServeShrunkPictures) {
  add("a.png", "PINHOLE");
  writeText();
  writePicture(folder / "images_2/a.png", 8, 6);
  writePicture(folder / "masks/a.png", 16, 12);
  ImportOptions options;
  options.images = folder / "images_2/";
  importCapture(folder.path(), folder / "out", options);
  EXPECT_EQ(capture::readCapture(folder / "out").frames[0].mask, "masks/a.png");
  writePicture(folder / "masks/a.png", 16, 9);
  EXPECT_NE(image::errorOf([&] {
              importCapture(folder.path(), folder / "out2", options);
            }).find("masks/a.png: size: found 16 x 9, expected 8 x 6"),
            std::string::npos);
}

TEST_F(Colmap, ShrunkPicturesShrinkTheLens) {
  VisionCamera camera = add("a.png", "OPENCV").camera;
  writeText();
  writePicture(folder / "half/a.png", 8, 6);
  ImportOptions options;
  options.images = folder / "half";
  importCapture(folder.path(), folder / "out", options);
  camera.width = 8, camera.height = 6;
  camera.fx /= 2, camera.fy /= 2, camera.cx /= 2, camera.cy /= 2;
  rig.expectSamePixels(capture::readCapture(folder / "out").views[0].camera, camera);

  writePicture(folder / "half/a.png", 8, 8);
  EXPECT_NE(image::errorOf([&] {
              importCapture(folder.path(), folder / "out2", options);
            }).find("found 8 x 8, expected 16 x 12"),
            std::string::npos);
}

TEST_F(Colmap, OtherModelsAreNamed) {
  const std::vector<double> twelve{20, 20, 8, 6, 0, 0, 0, 0, 0, 0.01, 0, 0};
  for (const auto& [model, count] :
       {std::pair("OPENCV_FISHEYE", 8), std::pair("FULL_OPENCV", 12), std::pair("FOV", 5),
        std::pair("SIMPLE_RADIAL_FISHEYE", 4), std::pair("RADIAL_FISHEYE", 5),
        std::pair("THIN_PRISM_FISHEYE", 12), std::pair("SIMPLE_DIVISION", 4), std::pair("DIVISION", 5),
        std::pair("SIMPLE_FISHEYE", 3), std::pair("FISHEYE", 4), std::pair("EUCM", 6),
        std::pair("EQUIRECTANGULAR", 2)}) {
    const std::span parameters(twelve.data(), static_cast<size_t>(count));
    EXPECT_NE(
        image::errorOf([&] { colmapLens(model, 16, 12, parameters); }).find(std::string("found ") + model),
        std::string::npos);
  }
  EXPECT_NE(image::errorOf([&] { colmapLens("BEST", 16, 12, twelve); }).find("found \"BEST\""),
            std::string::npos);
  EXPECT_NE(image::errorOf([&] { colmapLens("PINHOLE", 16, 12, twelve); }).find("expected 4 of PINHOLE"),
            std::string::npos);
  const std::array aside{20., 20., 1e30, 6.};
  EXPECT_NE(
      image::errorOf([&] { colmapLens("PINHOLE", 16, 12, aside); }).find("a principal point within 1e12"),
      std::string::npos);
}

TEST_F(Colmap, WrongTextIsNamedWithItsLine) {
  add("a.png", "PINHOLE");
  writeText();
  const std::string cameras = camerasText(), imagesFile = imagesText();
  const auto errorWith = [&](const char* file, std::string text, const std::string& from,
                             const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    image::writeBytes(folder / "sparse/0" / file, text);
    const std::string line = image::errorOf([&] { read(); });
    writeText();
    EXPECT_NE(line.find(file), std::string::npos) << line;
    return line;
  };
  EXPECT_NE(errorWith("cameras.txt", cameras, "PINHOLE 16", "PINHOLE x").find("line 2: found \"x\""),
            std::string::npos);
  EXPECT_NE(errorWith("cameras.txt", cameras, " 16 12", " 16 0").find("expected pixels"), std::string::npos);
  EXPECT_NE(errorWith("images.txt", imagesFile, "5 ", "5 9").find("unit quaternion"), std::string::npos);
  EXPECT_NE(errorWith("images.txt", imagesFile, "a.png", "b.png").find("expected a file in"),
            std::string::npos);
  EXPECT_NE(errorWith("images.txt", imagesFile, " 1000 ", " 1001 ").find("CAMERA_ID: found 1001"),
            std::string::npos);
  EXPECT_NE(errorWith("images.txt", "5\n", "5", "# none").find("no picture"), std::string::npos);
}

TEST_F(Colmap, EveryPictureHasItsLineOfPoints) {
  for (const char* name : {"a.png", "b b c.png", "c.png", "d.png"}) add(name, "PINHOLE");
  writeText();
  const std::string whole = imagesText();
  std::string stripped; // as scripts that drop empty lines leave it
  for (size_t at = 0, end; at < whole.size(); at = end + 1) {
    end = whole.find('\n', at);
    if (end > at) stripped += whole.substr(at, end + 1 - at);
  }
  image::writeBytes(folder / "sparse/0/images.txt", stripped);
  const std::string line = image::errorOf([&] { read(); });
  EXPECT_NE(line.find("images.txt: line 5: found \""), std::string::npos) << line;
  EXPECT_NE(line.find("expected the picture's points"), std::string::npos) << line;
  for (const char* wrong : {"1.5 2.5", "1.5 2.5 -1 3.5", "1.5 x -1", "0.5 1.5 nan"}) {
    std::string text = whole;
    text.replace(text.find("1.5 2.5 -1 3.5 4.5 17"), 21, wrong);
    image::writeBytes(folder / "sparse/0/images.txt", text);
    EXPECT_NE(
        image::errorOf([&] { read(); }).find("images.txt: line 3: found \"" + std::string(wrong) + "\""),
        std::string::npos)
        << wrong;
  }
  image::writeBytes(folder / "sparse/0/images.txt", whole.substr(0, whole.size() - 1)); // by an editor
  EXPECT_EQ(read().capture.frames.size(), 4u);
}

TEST_F(Colmap, ListsThatWereCutDifferFromTheirCount) {
  for (const char* name : {"a.png", "b.png"}) add(name, "PINHOLE");
  writeText();
  const auto counted = [&](const std::string& count) {
    image::writeBytes(folder / "sparse/0/images.txt",
                      "# Number of images: " + count + ", mean observations per image: 0.5\n" + imagesText());
  };
  counted("2");
  EXPECT_EQ(read().capture.frames.size(), 2u);
  counted("3");
  std::string line = image::errorOf([&] { read(); });
  EXPECT_NE(line.find("images.txt: found 2 images, expected 3, as line 1 says"), std::string::npos) << line;
  writeText();
  image::writeBytes(folder / "sparse/0/cameras.txt", camerasText() + "# Number of cameras: 1\n");
  line = image::errorOf([&] { read(); });
  EXPECT_NE(line.find("cameras.txt: found 2 cameras, expected 1, as line 4 says"), std::string::npos) << line;
}

TEST_F(Colmap, PathsOutOfThePicturesFolderNeedPermission) {
  add("../outside.png", "PINHOLE");
  writeText();
  EXPECT_NE(image::errorOf([&] { read(); }).find("--allow-outside"), std::string::npos);
  EXPECT_EQ(readColmap(folder.path(), {}, true).capture.frames.size(), 1u);
  images[0].name = "link.png";
  std::filesystem::create_symlink(folder / "outside.png", folder / "images/link.png");
  writeText();
  EXPECT_NE(image::errorOf([&] { read(); }).find("--allow-outside"), std::string::npos);
  images[0].name = folder / "outside.png";
  writeText();
  EXPECT_NE(image::errorOf([&] { read(); }).find("--allow-outside"), std::string::npos);
}

TEST_F(Colmap, EveryTruncationOfABinaryIsRefused) {
  addOneOfEachModel();
  writeBinary();
  for (const char* name : {"cameras.bin", "images.bin"}) {
    const std::string whole = std::string(name) == "cameras.bin" ? camerasBinary() : imagesBinary();
    for (size_t length = 0; length < whole.size(); ++length) {
      image::writeBytes(folder / "sparse/0" / name, whole.substr(0, length));
      const std::string line = image::errorOf([&] { read(); });
      EXPECT_NE(line.find(name), std::string::npos) << line;
    }
    image::writeBytes(folder / "sparse/0" / name, whole + '\0');
    EXPECT_NE(image::errorOf([&] { read(); }).find("found 1 more bytes"), std::string::npos);
    image::writeBytes(folder / "sparse/0" / name, whole);
  }
}

TEST_F(Colmap, HugeCountsCostNothing) {
  add("a.png", "PINHOLE");
  writeBinary();
  std::string bytes = camerasBinary();
  const uint64_t huge = ~uint64_t{0};
  std::memcpy(bytes.data(), &huge, sizeof huge);
  image::writeBytes(folder / "sparse/0/cameras.bin", bytes);
  EXPECT_NE(image::errorOf([&] { read(); }).find("num_cameras: found 18446744073709551615"),
            std::string::npos);
  writeBinary();
  bytes = imagesBinary();
  std::memcpy(bytes.data() + bytes.size() - 8, &huge, sizeof huge); // of points
  image::writeBytes(folder / "sparse/0/images.bin", bytes);
  EXPECT_NE(image::errorOf([&] { read(); }).find("num_points2D"), std::string::npos);
}

TEST_F(Colmap, DamageGivesAnErrorOrASource) {
  addOneOfEachModel();
  writeBinary();
  std::mt19937 random(3);
  int refused = 0;
  for (int i = 0; i < 600; ++i) {
    const bool cameras = i % 2;
    std::string bytes = cameras ? camerasBinary() : imagesBinary();
    bytes[random() % bytes.size()] = static_cast<char>(random());
    writeBinary();
    image::writeBytes(folder / "sparse/0" / (cameras ? "cameras.bin" : "images.bin"), bytes);
    try {
      for (const ForeignCapture source = read(); const capture::View& view : source.capture.views)
        EXPECT_TRUE(view.camera.cameraFromWorld.rotation().allFinite());
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

} // namespace
} // namespace surflect::importers
