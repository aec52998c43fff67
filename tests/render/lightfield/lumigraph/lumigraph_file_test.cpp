#include "render/lightfield/lumigraph/lumigraph_file.h"

#include "render/lightfield/lumigraph/build.h"
#include "tests/support/synthetic_capture.h"

#include <array>
#include <cstring>
#include <filesystem>

namespace surflect::lumigraph {
namespace {

namespace fs = std::filesystem;

constexpr SlabOptions kSlabOptions{.nodes = 2, .texels = 3000};

// A small lumigraph on disk, built once.
class LumigraphFileTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    shared_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 8, .lights = 0, .size = 24}, *shared_ / "capture");
    report_ = build(lightfield::Views(*shared_ / "capture"), {.slabs = kSlabOptions}, *shared_ / "lumigraph");
  }
  static void TearDownTestSuite() { shared_.reset(); }

  void SetUp() override { fs::copy(*shared_ / "lumigraph", folder_.path(), fs::copy_options::recursive); }

  static lightfield::LightFieldFolder opened(const fs::path& path) {
    return lightfield::LightFieldFolder(path, kFormat, kVersion);
  }
  Lumigraph read() const { return readLumigraph(opened(folder_.path())); }
  std::string errorOfReading() const {
    return image::errorOf([&] { read(); });
  }
  // Writes a file that the manifest agrees with again.
  void replaceTexels(const std::string& content) const {
    const lightfield::LightFieldFolder before = opened(folder_.path());
    const TriangleMesh mesh = before.mesh();
    const capture::Capture rig = before.rig();
    const Recipe recipe = recipeOf(before);
    LumigraphWriter writer(folder_.path());
    std::vector<Texel> texels(content.size() / sizeof(Texel));
    std::memcpy(texels.data(), content.data(), texels.size() * sizeof(Texel));
    writer.append(texels);
    writer.commit(rig, mesh, recipe);
  }

  static inline std::unique_ptr<image::TemporaryFolder> shared_;
  static inline BuildReport report_;
  image::TemporaryFolder folder_;
};

TEST_F(LumigraphFileTest, IsReadAsItWasBuilt) {
  const Lumigraph lumigraph = read();
  EXPECT_EQ(lumigraph.slabs, report_.slabs);
  EXPECT_EQ(lumigraph.overlap, kSlabOptions.overlap);
  EXPECT_TRUE(lumigraph.exactOutline);
  EXPECT_EQ(lumigraph.geometry.triangles.size(), report_.triangles);
  size_t texels = 0, covered = 0;
  for (const std::vector<Texel>& ofSlab : lumigraph.texels)
    for (const Texel& texel : ofSlab) ++texels, covered += texel[3] != 0;
  EXPECT_EQ(texels, report_.texels.seen + report_.texels.unseen + report_.texels.missed);
  EXPECT_EQ(covered, report_.texels.seen + report_.texels.unseen);
  uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(folder_.path())) bytes += entry.file_size();
  EXPECT_EQ(report_.bytes, bytes);
}

TEST_F(LumigraphFileTest, BuildingAgainGivesTheSameBits) {
  build(lightfield::Views(*shared_ / "capture"), {.slabs = kSlabOptions}, *shared_ / "again");
  EXPECT_EQ(image::contentOf(*shared_ / "again"), image::contentOf(*shared_ / "lumigraph"));
}

// A held-out photograph is black in one of the captures.
TEST_F(LumigraphFileTest, HeldOutViewsChangeNothing) {
  const fs::path capture = folder_.path() / "capture";
  studio::photograph({.cameras = 8,
                      .lights = 0,
                      .size = 24,
                      .split =
                          [](size_t view, size_t) {
                            return std::optional(view == 3 ? capture::Split::test : capture::Split::train);
                          }},
                     capture);
  const auto built = [&](const char* name) {
    build(lightfield::Views(capture), {.slabs = kSlabOptions}, folder_.path() / name);
    return readFile(folder_.path() / name / "texels.bin");
  };
  const std::string before = built("before");
  const image::Image black(24, 24, 3);
  const std::array<capture::RadianceLayer, 1> layers{{{"L0", &black}}};
  capture::writeViewPictures(capture / "C3.exr", layers, nullptr, "matte");
  EXPECT_EQ(before, built("after"));
}

TEST_F(LumigraphFileTest, GivesSimplifiedGeometryWhenAsked) {
  const Lumigraph lumigraph = readLumigraph(opened(folder_.path()), 100);
  EXPECT_LE(lumigraph.geometry.triangles.size(), 100u);
  EXPECT_FALSE(lumigraph.exactOutline);
  EXPECT_TRUE(readLumigraph(opened(folder_.path()), 1000000).exactOutline);
}

TEST_F(LumigraphFileTest, EveryTruncationIsAnError) {
  for (const auto& entry : fs::directory_iterator(*shared_ / "lumigraph")) {
    const std::string name = entry.path().filename(), content = readFile(entry.path());
    const size_t step = std::max<size_t>(1, content.size() / 50);
    for (size_t size = 0; size + 1 < content.size();
         size += step) { // without its last newline it is complete
      image::writeBytes(folder_ / name, content.substr(0, size));
      const std::string line = errorOfReading();
      EXPECT_NE(line.find(name), std::string::npos) << line;
    }
    image::writeBytes(folder_ / name, content);
  }
  EXPECT_NO_THROW(read());
}

TEST_F(LumigraphFileTest, TexelsThatAreNotFiniteAreErrors) {
  const std::string content = readFile(folder_ / "texels.bin");
  for (const uint16_t half : std::array<uint16_t, 3>{0x7c00, 0xfc00, 0x7e01}) {
    std::string bad = content;
    std::memcpy(bad.data() + 8 * 5 + 2, &half, 2);
    replaceTexels(bad);
    const std::string line = errorOfReading();
    EXPECT_NE(line.find("texels.bin: slab 0: texel 5: is not finite"), std::string::npos) << line;
  }
}

TEST_F(LumigraphFileTest, AnotherNumberOfTexelsThanTheSlabsHaveIsAnError) {
  const std::string content = readFile(folder_ / "texels.bin");
  for (const std::string& bad : {content.substr(8), content + content.substr(0, 8)}) {
    replaceTexels(bad);
    EXPECT_NE(errorOfReading().find("texels.bin: found "), std::string::npos);
  }
}

TEST_F(LumigraphFileTest, NumbersOutOfRangeAreErrors) {
  const TriangleMesh mesh = opened(folder_.path()).mesh();
  const capture::Capture rig = opened(folder_.path()).rig();
  const lightfield::Numbers good{
      {"nodes", 2}, {"texels", 3000}, {"distance", 8}, {"overlap", 0.1}, {"triangles", 0}};
  const auto fails = [&](const std::string& name, std::optional<double> value) {
    lightfield::Numbers numbers = good;
    numbers.erase(name);
    if (value) numbers[name] = *value;
    lightfield::LightFieldWriter writer(folder_.path(), kFormat, kVersion);
    image::writeBytes(writer.file("texels.bin"), "");
    writer.commit(rig, mesh, numbers);
    const std::string line = errorOfReading();
    EXPECT_NE(line.find("manifest.json: "), std::string::npos) << line;
    EXPECT_NE(line.find(name), std::string::npos) << line;
  };
  for (const auto& [name, value] : good) fails(name, std::nullopt);
  fails("nodes", 1);
  fails("nodes", 2.5);
  fails("nodes", 1000);
  fails("texels", 3);
  fails("texels", 1e18);
  fails("distance", 0.5);
  fails("overlap", -1);
  fails("triangles", -1);
}

} // namespace
} // namespace surflect::lumigraph
