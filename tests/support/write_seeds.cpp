// write_seeds FOLDER: valid files for the targets of tests/fuzz whose formats are not text, in
// FOLDER/TARGET/.

#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/tile.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "srf/codec/block_encoder.h"
#include "srf/codec/view_encoder.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "srf/model/manifest.h"
#include "srf/model/model_files.h"
#include "surfel/base/file.h"
#include "surfel/geometry/ply.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/support/color_files.h"
#include "tests/warp/gltf_files.h"

#include <OpenImageIO/imageio.h>

#include <array>
#include <cstdio>
#include <limits>
#include <random>
#include <string>

namespace {

using namespace surflect;
namespace fs = std::filesystem;

std::mt19937 randomBits(1);

image::Image noise(int width, int height, int channels) {
  image::Image image(width, height, channels);
  for (float& value : image.values) value = static_cast<float>(randomBits() % 256) / 255;
  return image;
}

std::string textOf(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void writeExrs(const fs::path& folder) {
  for (const int channels : {1, 3, 4})
    image::writeExr(folder / std::to_string(channels), noise(5, 4, channels));
  const image::Image rgb = noise(9, 3, 3), depth = noise(9, 3, 1);
  image::writeExr(folder / "layers",
                  std::array{image::ExrLayer{{"L0.R", "L0.G", "L0.B"}, &rgb, image::Precision::half},
                             image::ExrLayer{{"depth.Z"}, &depth, image::Precision::single}},
                  {{"surflect.identity", "film"}});
}

void writePngs(const fs::path& folder) {
  for (const int channels : {1, 2, 3, 4})
    for (const int bits : {8, 16})
      image::writePng(folder / (std::to_string(channels) + "." + std::to_string(bits)), noise(5, 4, channels),
                      bits);
  const std::string plain = readFile(folder / "3.8");
  const auto write = [&](const std::string& name, const std::string& content) {
    writeFileAtomically(folder / name, withChunk(plain, name, content));
  };
  write("sRGB", std::string(1, '\0'));
  write("gAMA", gamaContent(0.5));
  write("cHRM", chrmContent(image::kAdobeRgb));
  write("cICP", {9, 8, 0, 1});
  write("iCCP", iccpContent(profileBytes(image::kDisplayP3, ProfileCurve::srgb)));
}

void writeBlocks(const fs::path& folder) {
  constexpr size_t lights = 3;
  for (const uint64_t present : {~uint64_t{0}, uint64_t{0x183}})
    for (const double tolerance : {0.0, 0.03}) {
      const Eigen::MatrixXf radiance = Eigen::MatrixXf::NullaryExpr(
          3 * std::popcount(present), lights, [] { return static_cast<float>(randomBits() % 100); });
      std::string seed(1, static_cast<char>(lights - 1));
      seed += textOf(codec::encodeBlock(present, radiance, tolerance, 100).record);
      writeFileAtomically(folder / (std::to_string(present) + "." + std::to_string(tolerance)), seed);
    }
}

void writeViews(const fs::path& folder) {
  for (const int size : {7, 20}) {
    codec::ReflectanceStack stack{
        size, size, {noise(size, size, 3), noise(size, size, 3)}, image::Image(size, size, 1)};
    for (int i = 0; i < size; ++i) stack.alpha.at(i, size - 1 - i)[0] = 1;
    writeFileAtomically(folder / std::to_string(size), codec::encodeView(stack, {}).file);
  }
}

void writeFades(const fs::path& folder) {
  for (const uint32_t surfels : {0u, 1u, 50u}) {
    const uint32_t views = 3;
    weights::VisibilityWeights visibility{views, std::vector<uint8_t>(surfels * views)};
    for (uint8_t& fade : visibility.values) fade = static_cast<uint8_t>(randomBits());
    std::string seed =
        textOf(std::as_bytes(std::span(&surfels, 1))) + textOf(std::as_bytes(std::span(&views, 1)));
    writeFileAtomically(folder / std::to_string(surfels), seed + textOf(model::packVisibility(visibility)));
  }
}

// The cloud is that of levels_fuzz.cpp.
void writeLevels(const fs::path& folder) {
  const LevelsOfDetail levels{3, {0, 1, 3, 4, 7}, {{1, 1}, {1, 1}, {2, 1}, {1, 1}, {1, 1}, {2, 1}, {3, 1}}};
  writeFileAtomically(folder / "four", model::packLevels(levels));
}

void writeManifests(const fs::path& folder) {
  writeFileAtomically(folder / "one", model::manifestText({.white = 0.5,
                                                           .tolerance = 0.03,
                                                           .lightBlend = {},
                                                           .interpolation = {},
                                                           .surfels = 10,
                                                           .views = 1,
                                                           .lights = 2,
                                                           .rig = "0123456789abcdef",
                                                           .cloud = "0123456789abcdef",
                                                           .visibility = "0123456789abcdef",
                                                           .levels = "0123456789abcdef",
                                                           .viewChecksums = {"0123456789abcdef"}}));
}

void writeMeshes(const fs::path& folder) {
  writePly(folder / "binary", "vertex",
           std::array<PlyColumn, 3>{{{"x", {0, 1, 0}}, {"y", {0, 0, 1}}, {"z", {0, 0, 0}}}}, "without faces");
}

void writeGltfs(const fs::path& folder) {
  warp::GltfMaker tube = warp::tubeFile(3, 3);
  writeFileAtomically(folder / "tube.glb", tube.glb());
  writeFileAtomically(folder / "tube.gltf", tube.json("a.png"));
  tube.document["animations"][0]["samplers"][0]["interpolation"] = "STEP";
  tube.document["nodes"][1] = {{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1}},
                               {"children", {2}}};
  tube.document["animations"][0]["channels"].erase(0);
  writeFileAtomically(folder / "matrix.glb", tube.glb());
}

// The mesh and the first character are those of light_field_maps_fuzz.cpp.
void writeLightFieldMaps(const fs::path& folder) {
  for (const size_t channels : {3, 4})
    for (const bool isCompressed : {false, true}) {
      lfm::LightFieldMaps maps = lfm::testing::syntheticMaps(
          lfm::testing::squarePatch(1), {.samples = 3, .viewSize = 4, .terms = 2, .channels = channels});
      maps.terms[1].view.mapOf[2] = lfm::kNoMap; // of a codebook
      if (isCompressed) maps = lfm::encoded(std::move(maps));
      const std::string kind = std::to_string(channels);
      writeFileAtomically(folder / (kind + (isCompressed ? "blocks" : "bytes")),
                          kind + textOf(lfm::mapsBytes(maps)));
    }
}

// Two views as opacity_views_fuzz.cpp has them, both visible from four vertices.
void writeOpacityViews(const fs::path& folder) {
  std::string views, texels(2 * 16 * 8, '\x38');
  const auto append = [&](const auto& value) { views += textOf(std::as_bytes(std::span(&value, 1))); };
  for (int view = 0; view < 2; ++view) {
    for (const double number : {0.0, 0.0, 1.0, 1.0}) append(number);
    for (const uint64_t size : {4, 3}) append(size);
  }
  for (uint32_t vertex = 0; vertex <= 4; ++vertex) append(2 * vertex);
  for (uint32_t vertex = 0; vertex < 4; ++vertex)
    for (const uint32_t view : {0u, 1u}) append(view);
  const std::string start = std::to_string(views.size()) + "0" + views;
  writeFileAtomically(folder / "two", start + texels);
  std::string blocks;
  for (const float white : {1.f, 2.f}) blocks += textOf(std::as_bytes(std::span(&white, 1)));
  writeFileAtomically(folder / "blocks", start + blocks + std::string(2 * 16, '\x55'));
}

// Two images of 8 x 8 texels, as spherical_fuzz.cpp has them.
void writeSpherical(const fs::path& folder) {
  spherical::TileWriter writer(folder / "two", 8);
  for (int image = 0; image < 2; ++image) {
    spherical::Tile tile{std::vector<spherical::Texel>(64), std::vector<spherical::Height>(64)};
    for (spherical::Texel& texel : tile.colors)
      for (uint16_t& half : texel) half = static_cast<uint16_t>(randomBits() % 0x3c00);
    for (spherical::Height& height : tile.heights) height = static_cast<spherical::Height>(randomBits());
    writer.append(spherical::encoded(tile, 8));
  }
  writer.commit();
}

// The name decides which of OpenImageIO's formats a file has.
std::string fileOf(const fs::path& path, const image::Image& image, OIIO::TypeDesc type) {
  const auto output = OIIO::ImageOutput::create(path.string());
  if (!output ||
      !output->open(path.string(), OIIO::ImageSpec(image.width, image.height, image.channels, type)) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, image.values.data()) || !output->close())
    throw Error("OpenImageIO cannot write it: " + OIIO::geterror()).in(path);
  std::string content = readFile(path);
  fs::remove(path);
  return content;
}

// The first characters are those of environment_fuzz.cpp.
void writeEnvironments(const fs::path& folder) {
  const fs::path picture = folder / "picture";
  for (const int height : {2, 4}) {
    image::Image image = noise(8, height, 3);
    image.values[7] = -1, image.values[20] = std::numeric_limits<float>::infinity();
    image::writeExr(picture, image);
    const std::string exr = readFile(picture);
    fs::remove(picture);
    const auto write = [&](const std::string& kind, const std::string& content) {
      writeFileAtomically(folder / (kind + std::to_string(height)), kind + content);
    };
    for (const char* kind : {"1", "3", "7"}) write(kind, exr);
    write("0", fileOf(folder / "a.hdr", noise(16, 8, 3), OIIO::TypeDesc::FLOAT));
  }
}

// The order of formats is that of foreign_fuzz.cpp.
void writeForeign(const fs::path& folder) {
  char format = 0;
  for (const char* extension : {"jpg", "tif", "hdr", "bmp", "tga", "ppm", "webp"}) {
    const fs::path path = folder / (std::string("a.") + extension);
    const std::string content = fileOf(path, noise(6, 5, 3), OIIO::TypeDesc::UINT8);
    writeFileAtomically(folder / extension, std::string(1, format++) + content);
  }
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: write_seeds FOLDER\n", stderr);
    return 2;
  }
  constexpr std::pair<const char*, void (*)(const fs::path&)> writers[] = {
      {"exr", writeExrs},
      {"png", writePngs},
      {"block", writeBlocks},
      {"view_file", writeViews},
      {"fades", writeFades},
      {"manifest", writeManifests},
      {"levels", writeLevels},
      {"ply", writeMeshes},
      {"foreign", writeForeign},
      {"gltf", writeGltfs},
      {"environment", writeEnvironments},
      {"light_field_maps", writeLightFieldMaps},
      {"opacity_views", writeOpacityViews},
      {"spherical", writeSpherical}};
  try {
    for (const auto& [target, write] : writers) {
      const fs::path folder = fs::path(argv[1]) / target;
      fs::create_directories(folder);
      write(folder);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "write_seeds: %s\n", error.what());
    return 1;
  }
}
