#include "srf/import/metashape.h"

#include "srf/import/import.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_formats.h"

namespace surflect::importers {
namespace {

class Metashape : public ::testing::Test {
protected:
  void SetUp() override {
    for (size_t i = 0; i < 4; ++i) {
      cameras.emplace_back("shot" + std::to_string(i), rig.camera(true));
      writePicture(folder / "images" / (cameras.back().first + ".png"));
    }
    chunk.rotation = Eigen::Quaterniond(0.3, -0.2, 0.8, 0.4).normalized();
  }
  ForeignCapture read(const std::string& text, const MetashapeOptions& options = {}) const {
    image::writeBytes(folder / "cameras.xml", text);
    return readMetashape(folder / "cameras.xml", options);
  }
  std::string whole() const { return metashapeDocument(metashapeChunk(chunk, cameras)); }
  // The error of a file in which a piece of text is replaced.
  std::string errorWith(const std::string& before, const std::string& after) const {
    std::string text = whole();
    EXPECT_NE(text.find(before), text.npos) << before;
    text.replace(text.find(before), before.size(), after);
    const std::string found = image::errorOf([&] { read(text); });
    EXPECT_EQ(found.find('\n'), found.npos);
    EXPECT_NE(found.find("cameras.xml: "), found.npos);
    return found;
  }
  void expectError(const std::string& before, const std::string& after, const std::string& words) const {
    const std::string found = errorWith(before, after);
    EXPECT_NE(found.find(words), found.npos) << found;
  }
  void expectTheCameras(const capture::Capture& capture) {
    for (const auto& [name, camera] : cameras) rig.expectSamePixels(viewNamed(capture, name).camera, camera);
  }
  static bool says(const ForeignCapture& source, const std::string& words) {
    return std::ranges::any_of(source.notes, [&](const std::string& n) { return n.find(words) != n.npos; });
  }

  image::TemporaryFolder folder;
  VisionRig rig{11};
  std::vector<std::pair<std::string, VisionCamera>> cameras; // with a lens each
  MetashapeChunk chunk{.scale = 0.4, .translation = {1, -2, 3}};
};

TEST_F(Metashape, PixelsAreThoseOfOpenCvsLensInTheChunksWorld) {
  const ForeignCapture source = read(whole());
  ASSERT_EQ(source.capture.views.size(), 4u);
  expectTheCameras(source.capture);
  EXPECT_EQ(source.capture.views[0].camera.lens.p1, cameras[0].second.p1);
  EXPECT_TRUE(source.capture.lights.empty());
}

TEST_F(Metashape, TheImportedFolderKeepsThePixels) {
  image::writeBytes(folder / "cameras.xml", whole());
  for (const char* const name : {"shot1_mask.png", "shot2_mask.png"}) writePicture(folder / "masks" / name);
  const ImportReport report = importCapture(folder.path(), folder / "out", {.testEvery = 4});
  EXPECT_EQ(report.format, ImportFormat::metashape);
  EXPECT_EQ(std::tuple(report.views, report.testFrames, report.masks), std::tuple(4u, 1u, 2u));
  expectTheCameras(capture::readCapture(folder / "out"));
}

TEST_F(Metashape, OnlyAlignedAndEnabledCamerasCount) {
  std::string text = metashapeChunk(chunk, {cameras[0], cameras[1]},
                                    "<camera id=\"7\" sensor_id=\"0\" label=\"shot2\"/>\n"
                                    "<camera id=\"9\" master_id=\"0\" sensor_id=\"0\" label=\"shot2\"/>\n"
                                    "<camera id=\"8\" sensor_id=\"0\" enabled=\"false\" label=\"shot3\">"
                                    "<transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera>\n");
  const ForeignCapture source = read(metashapeDocument(text));
  EXPECT_EQ(source.capture.views.size(), 2u);
  EXPECT_TRUE(
      says(source, "2 aligned cameras; left out: 1 disabled, 1 not aligned, 1 of a multi-camera system"));
}

TEST_F(Metashape, ChunksWithoutOneWorldAreNotMixed) {
  MetashapeChunk other = chunk;
  other.label = "Rücken & Fuß";
  other.scale = 3;
  other.translation = {-1, 0.5, 2};
  std::string label = other.label;
  label.replace(label.find('&'), 1, "&amp;");
  MetashapeChunk written = other;
  written.label = label;
  const std::string text = metashapeDocument(metashapeChunk(chunk, {cameras[0], cameras[1], cameras[2]}) +
                                             metashapeChunk(written, {cameras[3]}));
  const ForeignCapture largest = read(text);
  EXPECT_EQ(largest.capture.views.size(), 3u);
  EXPECT_TRUE(says(largest, "left out: chunk \"R"));
  expectTheCameras(read(text, {.chunks = {chunk.label, other.label}}).capture); // aligned, as this test knows
  EXPECT_EQ(read(text, {.chunks = {other.label}}).capture.views.size(), 1u);
  EXPECT_NE(image::errorOf([&] { read(text, {.chunks = {"Chonk 1"}}); }).find("did you mean Chunk 1"),
            std::string::npos);
  std::string apart = text;
  for (size_t at; (at = apart.find("<components>")) != apart.npos;)
    apart.erase(at, apart.find("</components>") + 13 - at);
  EXPECT_NE(image::errorOf([&] {
              read(apart, {.chunks = {chunk.label, other.label}});
            }).find("has no transform"),
            std::string::npos);
  EXPECT_TRUE(says(read(apart), "scale and axes are Metashape's own"));
}

TEST_F(Metashape, LabelsAreNamesOrPathsOfPhotographs) {
  std::string text = whole();
  text.replace(text.find("label=\"shot0\""), 13, "label=\"C:\\work\\shot0.JPG\"");
  expectTheCameras(read(text).capture);
  writePicture(folder / "images/left/a.png");
  writePicture(folder / "images/right/a.png");
  const std::string groups = metashapeDocument(
      metashapeChunk(chunk, {},
                     "<group label=\"left\">" + metashapeCamera(0, "a", cameras[0].second, chunk) +
                         "</group><group label=\"right\">" +
                         metashapeCamera(1, "a", cameras[1].second, chunk) + "</group>"));
  std::string withSensors = groups;
  withSensors.insert(withSensors.find("</sensors>"),
                     metashapeSensor(0, cameras[0].second) + metashapeSensor(1, cameras[1].second));
  const capture::Capture capture = read(withSensors).capture;
  rig.expectSamePixels(viewNamed(capture, "left/a").camera, cameras[0].second);
  rig.expectSamePixels(viewNamed(capture, "right/a").camera, cameras[1].second);
  expectError("label=\"shot1\"", "label=\"a\"",
              "camera \"1\": found \"a\", which fits left/a.png, right/a.png, expected");
  expectError("label=\"shot1\"", "label=\"b\"", "camera \"1\": found \"b\", expected a photograph in");
  expectError("label=\"shot1\"", "label=\"shot0\"", "found \"shot0.png\" a second time");
}

TEST_F(Metashape, LampsAreToldByNames) {
  for (size_t c = 0; c < 2; ++c)
    for (const char* const light : {"on", "off"})
      writePicture(folder / "images" / ("c" + std::to_string(c) + "_" + light + ".png"));
  image::writeBytes(folder / "lamps.txt", "on 0 0 2\noff 3 0 0\n");
  image::writeBytes(
      folder / "cameras.xml",
      metashapeDocument(metashapeChunk(chunk, {{"c0_on", cameras[0].second}, {"c1_on", cameras[1].second}})));
  LampOptions lamps;
  lamps.pattern = "{camera}_{light}.png", lamps.lights = folder / "lamps.txt";
  const ImportReport report = importCapture(folder / "cameras.xml", folder / "out", {.lamps = lamps});
  EXPECT_EQ(std::tuple(report.views, report.lights, report.trainingFrames), std::tuple(2u, 2u, 4u));
  rig.expectSamePixels(viewNamed(capture::readCapture(folder / "out"), "c1").camera, cameras[1].second);
}

TEST_F(Metashape, OtherLensesAreRefusedByName) {
  expectError("type=\"frame\"", "type=\"fisheye\"",
              "sensor \"0\".type: found \"fisheye\", expected \"frame\"");
  expectError("<calibration type=\"frame\"", "<calibration type=\"spherical\"",
              "sensor \"0\".calibration.type: found \"spherical\"");
  for (const char* const name : {"k4", "p3", "p4", "b2"}) {
    expectError("<f>", "<" + std::string(name) + ">0.01</" + name + "><f>",
                "sensor \"0\".calibration." + std::string(name) + ": found 0.01, expected 0");
    std::string text = whole();
    text.insert(text.find("<f>"), "<" + std::string(name) + ">0</" + name + ">");
    expectTheCameras(read(text).capture);
  }
}

TEST_F(Metashape, MistakesAreNamed) {
  expectError("<f>", "<f>x", "sensor \"0\".calibration.f: ");
  expectError("<f>", "<g>", "line 4: found no complete XML");
  expectError("\"adjusted\"><resolution width=\"16\"", "\"adjusted\"><resolution width=\"-1\"",
              "resolution.width: found -1, expected pixels");
  expectError("sensor_id=\"2\"", "sensor_id=\"9\"",
              "camera \"2\".sensor_id: found \"9\", expected a sensor's id");
  expectError("</scale>", "e99</scale>", "transform.scale: found");
  expectError("<translation>", "<translation>1 ", "transform.translation: found 4, expected 3 numbers");
  expectError("0 0 0 1</transform>", "0 0 0.5 1</transform>",
              "camera \"0\".transform: found 0 0 0.5 1, expected 0 0 0 1");
  expectError("<document", "<doc", "found no complete XML");
  EXPECT_NE(image::errorOf([&] { read("<project/>"); }).find("found <\"project\">, expected <document>"),
            std::string::npos);
  EXPECT_NE(image::errorOf([&] { read(metashapeDocument("")); }).find("expected cameras with a <transform>"),
            std::string::npos);
}

TEST_F(Metashape, AGeoreferencedChunkSaysSo) {
  std::string text = whole();
  text.insert(text.find("</chunk>"), "<reference>GEOGCS[\"WGS 84\"]</reference>");
  EXPECT_TRUE(says(read(text), "is georeferenced"));
}

TEST_F(Metashape, EveryTruncationIsRefused) {
  const std::string text = metashapeDocument(metashapeChunk(chunk, {cameras[0]}));
  for (size_t length = 0; length + 1 < text.size(); ++length) // the last byte is a line's end
    EXPECT_THROW(read(text.substr(0, length)), Error) << length;
}

} // namespace
} // namespace surflect::importers
