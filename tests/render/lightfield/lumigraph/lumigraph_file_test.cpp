#include "render/lightfield/lumigraph/lumigraph_file.h"

#include "render/lightfield/lumigraph/build.h"
#include "tests/support/synthetic_capture.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

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
  Lumigraph read(const char* folder = "") const { return readLumigraph(opened(folder_.path() / folder)); }
  std::string errorOfReading() const {
    return image::errorOf([&] { read(); });
  }
  // Writes a file that the manifest agrees with again.
  void replaceTexels(const std::string& content) const {
    const lightfield::LightFieldFolder before = opened(*shared_ / "lumigraph");
    const Lumigraph lumigraph = readLumigraph(before);
    LumigraphWriter writer(folder_.path());
    std::vector<Texel> texels(content.size() / sizeof(Texel));
    std::memcpy(texels.data(), content.data(), texels.size() * sizeof(Texel));
    writer.append(texels);
    writer.commit(before.rig(), before.mesh(), lumigraph);
  }

  static inline std::unique_ptr<image::TemporaryFolder> shared_;
  static inline BuildReport report_;
  image::TemporaryFolder folder_;
};

TEST_F(LumigraphFileTest, IsReadAsItWasBuilt) {
  const Lumigraph lumigraph = read();
  EXPECT_EQ(lumigraph.slabs, report_.slabs);
  EXPECT_EQ(lumigraph.overlap, kSlabOptions.overlap);
  EXPECT_TRUE(lumigraph.geometry.exactOutline);
  EXPECT_EQ(lumigraph.geometry.mesh.triangles.size(), report_.triangles);
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

TEST_F(LumigraphFileTest, SimplifiedGeometryIsReadAsItWasBuilt) {
  const lightfield::Views views(*shared_ / "capture");
  const BuildReport report =
      build(views, {.slabs = kSlabOptions, .triangles = 100}, folder_.path() / "simple");
  const DepthGeometry built = depthGeometry(views.mesh(), 100), found = read("simple").geometry;
  EXPECT_FALSE(found.exactOutline);
  EXPECT_LE(found.mesh.triangles.size(), 100u);
  EXPECT_EQ(found.mesh.triangles.size(), report.triangles);
  for (const auto& [a, b] : {std::pair(&built.mesh, &found.mesh), {&built.fringe, &found.fringe}}) {
    EXPECT_EQ(a->triangles, b->triangles);
    ASSERT_EQ(a->positions.size(), b->positions.size());
    for (size_t i = 0; i < a->positions.size(); ++i) EXPECT_EQ(a->positions[i].raw(), b->positions[i].raw());
  }
  ASSERT_TRUE(report.errors);
  EXPECT_GT(report.errors->meanDepth, 0);
  EXPECT_FALSE(report_.errors);
}

// Cameras on one side of the sphere see less than half of it.
TEST_F(LumigraphFileTest, PicturesOfSidesThatNoPhotographSeesAreCounted) {
  const fs::path capture = folder_.path() / "capture";
  studio::photograph({.cameras = 8,
                      .lights = 0,
                      .size = 24,
                      .split =
                          [](size_t view, size_t) {
                            return std::optional(view == 0 ? capture::Split::train : capture::Split::test);
                          }},
                     capture);
  const BuildReport report =
      build(lightfield::Views(capture), {.slabs = kSlabOptions}, folder_.path() / "one");
  const Lumigraph lumigraph = read("one");
  size_t black = 0;
  for (size_t k = 0; k < kSlabs; ++k)
    for (int node = 0; node < 4; ++node)
      black += std::ranges::all_of(lumigraph.picture(k, node % 2, node / 2), [](const Texel& texel) {
        return texel[0] == 0 && texel[1] == 0 && texel[2] == 0;
      });
  EXPECT_GT(report.blackPictures, 0u);
  EXPECT_LT(report.blackPictures, 24u);
  EXPECT_EQ(report.blackPictures, black);
  EXPECT_EQ(report_.blackPictures, 0u);
}

TEST_F(LumigraphFileTest, EveryTruncationIsAnError) {
  build(lightfield::Views(*shared_ / "capture"), {.slabs = kSlabOptions, .triangles = 100}, folder_.path());
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder_.path())) files.push_back(entry.path());
  EXPECT_EQ(files.size(), 6u);
  for (const fs::path& file : files) {
    const std::string name = file.filename(), content = readFile(file);
    const size_t step = std::max<size_t>(1, content.size() / 50);
    for (size_t size = 0; size + 1 < content.size();
         size += step) { // without its last newline it is complete
      image::writeBytes(file, content.substr(0, size));
      const std::string line = errorOfReading();
      EXPECT_NE(line.find(name), std::string::npos) << line;
    }
    image::writeBytes(file, content);
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
    EXPECT_NE(line.find("texels.bin: texel 5: is not finite"), std::string::npos) << line;
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
  const lightfield::LightFieldFolder before = opened(folder_.path());
  const std::string texels = readFile(folder_ / "texels.bin");
  lightfield::Numbers good{{"nodes", 2}, {"overlap", 0.1}, {"exact_outline", 1}};
  for (size_t k = 0; k < kSlabs; ++k) {
    const Slab& slab = report_.slabs[k];
    const std::string name = "slab" + std::to_string(k) + ".";
    good[name + "st_plane"] = slab.stPlane, good[name + "uv_plane"] = slab.uvPlane;
    good[name + "uv_spacing"] = slab.uvSpacing;
    good[name + "width"] = slab.width, good[name + "height"] = slab.height;
    for (const size_t i : {size_t{0}, size_t{1}})
      for (const auto& [field, values] :
           {std::pair("st_low.", &slab.stLow), {"st_spacing.", &slab.stSpacing}, {"uv_low.", &slab.uvLow}})
        good[name + field + "uv"[i]] = (*values)[i];
  }
  const auto write = [&](const lightfield::Numbers& numbers) {
    lightfield::LightFieldWriter writer(folder_.path(), kFormat, kVersion);
    image::writeBytes(writer.file("texels.bin"), texels);
    writer.commit(before.rig(), before.mesh(), numbers);
  };
  write(good);
  EXPECT_NO_THROW(read());
  const auto fails = [&](const std::string& name, std::optional<double> value) {
    lightfield::Numbers numbers = good;
    numbers.erase(name);
    if (value) numbers[name] = *value;
    write(numbers);
    const std::string line = errorOfReading();
    EXPECT_NE(line.find("manifest.json: "), std::string::npos) << line;
    EXPECT_NE(line.find(name), std::string::npos) << line;
  };
  for (const auto& [name, value] : good) fails(name, std::nullopt);
  fails("nodes", 1);
  fails("nodes", 2.5);
  fails("nodes", 1000);
  fails("overlap", -1);
  fails("exact_outline", 2);
  fails("slab0.st_plane", 0.9); // inside the sphere
  fails("slab1.st_plane", 100); // on the other side
  fails("slab2.uv_plane", 1e16);
  fails("slab3.st_spacing.u", 0);
  fails("slab4.uv_spacing", -1);
  fails("slab5.width", 1);
  fails("slab5.height", 1e6);
}

TEST_F(LumigraphFileTest, AnOlderVersionIsRefusedByItsNumber) {
  const lightfield::LightFieldFolder before = opened(folder_.path());
  lightfield::LightFieldWriter(folder_.path(), kFormat, 1).commit(before.rig(), before.mesh(), {});
  EXPECT_NE(errorOfReading().find("manifest.json: version: found 1, expected 2"), std::string::npos)
      << errorOfReading();
}

} // namespace
} // namespace surflect::lumigraph
