#include "render/lightfield/olf/opacity_file.h"

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lfm/s3tc.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace surflect::olf {

namespace {

constexpr const char* kViewsFile = "views.bin";
constexpr const char* kTexelsFile = "texels.bin";
constexpr const char* kBlocksFile = "blocks.bin"; // in place of texels.bin
constexpr double kLongestSide = 16384;            // texels; of textures of OpenGL
constexpr size_t kMostViews = 100000;

// Numbers of the manifest. When they are read, the field has its mesh.
void describeNumbers(lightfield::NumberArchive& archive, OpacityField& field) {
  archive.number("method", field.method, {0, static_cast<double>(Blending::ulr)});
  archive.number("domain", field.domain, {0, 1});
  archive.number("order", field.order, {0, static_cast<double>(Order::bsp)});
  archive.number("unseen_vertices", field.visible.unseenVertices,
                 {0, static_cast<double>(field.mesh.positions.size())});
  archive.number("width", field.packed.width, {1, kLongestSide});
  archive.number("height", field.packed.height, {1, kLongestSide});
}

// views.bin. When it is read, the field has its mesh, its cameras and the size of a layer.
void describeViews(Archive& archive, OpacityField& field) {
  PackedViews& packed = field.packed;
  const size_t views = field.cameras.size(), vertices = field.mesh.positions.size();
  archive.each("views", packed.views, views, [&](PackedView& view) {
    archive.numbers<double>("low", std::span(view.low.data(), 2), {-1e6, 1e6});
    archive.numbers<double>("scale", std::span(view.scale.data(), 2), {1e-9, 1});
    archive.number<uint64_t>("width", view.width, {1, static_cast<uint64_t>(packed.width)});
    archive.number<uint64_t>("height", view.height, {1, static_cast<uint64_t>(packed.height)});
  });
  VisibleViews& visible = field.visible;
  archive.array<uint32_t>("first", visible.first, vertices + 1);
  archive.array<uint32_t>("visibleViews", visible.views, visible.first.back(), Below(views));
}

// Start of blocks.bin. When it is read, there are the views.
void describeWhites(Archive& archive, PackedViews& packed) {
  std::vector<float> whites;
  for (const PackedView& view : packed.views) whites.push_back(view.white);
  archive.array<float>("white", whites, packed.views.size(), {1e-30f});
  if (archive.isReading())
    for (size_t view = 0; view < whites.size(); ++view) packed.views[view].white = whites[view];
}

// Throws Error unless layers are whole blocks.
void requireWholeBlocks(const PackedViews& packed, const std::filesystem::path& manifest) {
  for (const auto& [name, size] :
       {std::pair{"numbers.width", packed.width}, {"numbers.height", packed.height}})
    if (size % lfm::kBlockSide != 0)
      throw Error::mismatch("a multiple of 4 for blocks", std::to_string(size)).at(name).in(manifest);
}

// Throws Error unless the views of each vertex follow those of the vertex before, and rise.
void requireRising(const VisibleViews& visible, size_t vertices) {
  const auto require = [](bool isRight, const char* expected, size_t found, const char* field, size_t i) {
    if (!isRight)
      throw Error::mismatch(expected, std::to_string(found)).at(field + ('[' + std::to_string(i) + ']'));
  };
  require(visible.first[0] == 0, "0", visible.first[0], "first", 0);
  for (size_t vertex = 0; vertex < vertices; ++vertex) {
    const uint32_t begin = visible.first[vertex], end = visible.first[vertex + 1];
    require(begin <= end && end <= visible.views.size(), "rising places", end, "first", vertex + 1);
    for (uint32_t i = begin + 1; i < end; ++i)
      require(visible.views[i - 1] < visible.views[i], "views in rising order", visible.views[i],
              "visibleViews", i);
  }
}

void requirePlain(const capture::Capture& rig, const std::filesystem::path& path) {
  for (const capture::View& view : rig.views)
    if (view.camera.lens.model != capture::Lens::Model::pinhole || view.camera.lens.distorts())
      throw Error::mismatch("a pinhole without distortion", "another lens")
          .at("view " + view.identity)
          .in(path);
}

} // namespace

void writeField(const OpacityField& field, const capture::Capture& capture,
                const std::filesystem::path& folder, const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kFormat, kVersion);
  writer.write(kViewsFile, written(field, describeViews));
  if (field.packed.isCompressed()) {
    AtomicFile blocks(writer.file(kBlocksFile));
    blocks.write(written(field.packed, describeWhites));
    blocks.write(std::as_bytes(std::span(field.packed.blocks)));
    blocks.commit();
  } else {
    writer.write(kTexelsFile, std::as_bytes(std::span(field.packed.texels)));
  }
  writer.commit(capture, field.mesh, lightfield::numbersOf(field, describeNumbers), progress);
}

void parseViews(std::span<const std::byte> bytes, OpacityField& field) {
  parse(bytes, [&](Archive& archive) { describeViews(archive, field); });
  requireRising(field.visible, field.mesh.positions.size());
}

void readBlocks(const OpenFile& file, PackedViews& packed, const Progress& progress) {
  constexpr size_t kPortion = size_t{1} << 24;
  const size_t start = packed.views.size() * sizeof(float),
               count = packed.views.size() * packed.layerTexels();
  if (file.bytes() != start + count)
    throw Error::mismatch(std::to_string(start + count) + " bytes", std::to_string(file.bytes()) + " bytes")
        .in(file.path());
  std::vector<std::byte> whites(start);
  file.read(0, whites);
  try {
    parse(whites, [&](Archive& archive) { describeWhites(archive, packed); });
  } catch (Error& error) {
    throw std::move(error).in(file.path());
  }
  packed.blocks.resize(count);
  for (size_t begin = 0; begin < count; begin += kPortion) {
    progress.checkpoint();
    const auto portion = std::span(packed.blocks).subspan(begin, std::min(kPortion, count - begin));
    file.read(start + begin, std::as_writable_bytes(portion));
  }
}

OpacityField readField(const lightfield::LightFieldFolder& folder, const Progress& progress) {
  OpacityField field;
  field.mesh = folder.mesh();
  if (field.mesh.triangles.empty()) throw Error("has no triangles").in(folder.path() / "mesh.bin");
  lightfield::NumberArchive numbers(folder);
  describeNumbers(numbers, field);
  const capture::Capture& rig = folder.rig();
  requirePlain(rig, folder.path() / "transforms.json");
  const size_t views = rig.frames.size();
  if (views < 1 || views > kMostViews)
    throw Error::mismatch("1.." + std::to_string(kMostViews), std::to_string(views))
        .at("frames")
        .in(folder.path() / "transforms.json");
  for (const capture::Frame& frame : rig.frames) field.cameras.push_back(rig.views[frame.view].camera);
  folder.read(kViewsFile, progress, [&](std::span<const std::byte> bytes) { parseViews(bytes, field); });
  if (folder.has(kBlocksFile)) {
    requireWholeBlocks(field.packed, folder.path() / "manifest.json");
    readBlocks(folder.checked(kBlocksFile, progress), field.packed, progress);
    return field;
  }
  const OpenFile texels = folder.checked(kTexelsFile, progress);
  const size_t count = views * field.packed.layerTexels();
  lightfield::requireTexels(texels, count);
  field.packed.texels.resize(count);
  lightfield::readTexels(texels, 0, field.packed.texels, progress);
  return field;
}

} // namespace surflect::olf
