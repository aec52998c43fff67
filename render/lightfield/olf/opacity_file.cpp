#include "render/lightfield/olf/opacity_file.h"

#include "render/lightfield/common/binary.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

namespace surflect::olf {

namespace {

constexpr const char* kViewsFile = "views.bin";
constexpr const char* kTexelsFile = "texels.bin";
constexpr size_t kLongestSide = 16384; // texels; of textures of OpenGL
constexpr size_t kMostViews = 100000;

void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw Error("cannot be written").in(path);
}

// Bytes of a file of the format's own, whose size the manifest states.
std::vector<std::byte> checkedBytes(const lightfield::LightFieldFolder& folder, const char* name,
                                    const Progress& progress) {
  folder.check(name, progress);
  const std::filesystem::path path = folder.file(name);
  std::error_code failure;
  std::vector<std::byte> bytes(std::filesystem::file_size(path, failure));
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (failure || !file) throw Error("cannot be read").in(path);
  return bytes;
}

PackedView packedView(lightfield::Reader& reader, const PackedViews& packed, const std::string& field) {
  const std::vector<double> place = reader.takeMany<double>(4, field);
  PackedView view;
  view.low = {place[0], place[1]}, view.scale = {place[2], place[3]};
  for (const double low : {place[0], place[1]})
    if (!(std::abs(low) <= 1e6)) throw Error::mismatch("-1e6..1e6", numberText(low)).at("low").at(field);
  for (const double scale : {place[2], place[3]})
    if (!(scale > 0 && scale <= 1))
      throw Error::mismatch("above 0, 1 at most", numberText(scale)).at("scale").at(field);
  view.width = static_cast<int>(reader.take(1, static_cast<uint64_t>(packed.width), field + ".width"));
  view.height = static_cast<int>(reader.take(1, static_cast<uint64_t>(packed.height), field + ".height"));
  return view;
}

void requirePlain(const capture::Capture& rig, const std::filesystem::path& path) {
  for (const capture::View& view : rig.views)
    if (view.camera.lens.model != capture::Lens::Model::pinhole || view.camera.lens.distorts())
      throw Error::mismatch("a pinhole without distortion", "another lens")
          .at("view " + view.identity)
          .in(path);
}

VisibleViews visibleViewsOf(lightfield::Reader& reader, size_t vertices, size_t views) {
  VisibleViews visible;
  visible.first = reader.takeMany<uint32_t>(vertices + 1, "visible views");
  if (visible.first[0] != 0) throw Error::mismatch("0", std::to_string(visible.first[0])).at("first[0]");
  for (size_t vertex = 0; vertex < vertices; ++vertex)
    if (visible.first[vertex + 1] < visible.first[vertex])
      throw Error::mismatch(std::to_string(visible.first[vertex]) + " or more",
                            std::to_string(visible.first[vertex + 1]))
          .at("first[" + std::to_string(vertex + 1) + "]");
  visible.views = reader.takeMany<uint32_t>(visible.first.back(), "visible views");
  for (size_t vertex = 0; vertex < vertices; ++vertex) {
    const auto of = visible.of(static_cast<uint32_t>(vertex));
    const std::string field = "vertex " + std::to_string(vertex);
    for (size_t i = 0; i < of.size(); ++i) {
      if (of[i] >= views)
        throw Error::mismatch("a view below " + std::to_string(views), std::to_string(of[i])).at(field);
      if (i > 0 && of[i] <= of[i - 1])
        throw Error::mismatch("views in rising order", std::to_string(of[i])).at(field);
    }
  }
  return visible;
}

} // namespace

void writeField(const OpacityField& field, const capture::Capture& capture,
                const std::filesystem::path& folder, const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kFormat, kVersion);
  std::vector<std::byte> bytes;
  for (const PackedView& view : field.packed.views) {
    const std::array place{view.low[0], view.low[1], view.scale[0], view.scale[1]};
    lightfield::append(bytes, std::span<const double>(place));
    lightfield::append(bytes, static_cast<uint64_t>(view.width));
    lightfield::append(bytes, static_cast<uint64_t>(view.height));
  }
  lightfield::append(bytes, std::span<const uint32_t>(field.visible.first));
  lightfield::append(bytes, std::span<const uint32_t>(field.visible.views));
  writeBytes(writer.file(kViewsFile), bytes);
  writeBytes(writer.file(kTexelsFile), std::as_bytes(std::span(field.packed.texels)));
  writer.commit(capture, field.mesh,
                {{"method", static_cast<double>(field.method)},
                 {"domain", static_cast<double>(field.domain)},
                 {"order", static_cast<double>(field.order)},
                 {"bsp_trees", static_cast<double>(field.bspTrees)},
                 {"unseen_vertices", static_cast<double>(field.visible.unseenVertices)},
                 {"width", field.packed.width},
                 {"height", field.packed.height}},
                progress);
}

void parseViews(std::span<const std::byte> bytes, OpacityField& field) {
  lightfield::Reader reader(bytes);
  const size_t views = field.cameras.size();
  for (size_t view = 0; view < views; ++view)
    field.packed.views.push_back(packedView(reader, field.packed, "view " + std::to_string(view)));
  field.visible = visibleViewsOf(reader, field.mesh.positions.size(), views);
  reader.requireEnd();
}

void parseTexels(std::span<const std::byte> bytes, OpacityField& field) {
  const uint64_t expected = sizeof(Texel) * static_cast<uint64_t>(field.packed.width) *
                            static_cast<uint64_t>(field.packed.height) * field.cameras.size();
  if (bytes.size() != expected)
    throw Error::mismatch(std::to_string(expected) + " bytes", std::to_string(bytes.size()) + " bytes");
  field.packed.texels = lightfield::Reader(bytes).takeMany<Texel>(bytes.size() / sizeof(Texel), "texels");
  for (size_t i = 0; i < field.packed.texels.size(); ++i)
    if (std::ranges::any_of(field.packed.texels[i], [](uint16_t half) { return (half & 0x7fff) > 0x7bff; }))
      throw Error("is not finite").at("texel " + std::to_string(i));
}

OpacityField readField(const lightfield::LightFieldFolder& folder, const Progress& progress) {
  OpacityField field;
  field.method = static_cast<Method>(folder.count("method", 0, 1));
  field.domain = static_cast<Domain>(folder.count("domain", 0, 1));
  field.order = static_cast<Order>(folder.count("order", 0, 2));
  field.bspTrees = folder.count("bsp_trees", 1, kMostTrees);
  field.mesh = folder.mesh();
  field.packed.width = static_cast<int>(folder.count("width", 1, kLongestSide));
  field.packed.height = static_cast<int>(folder.count("height", 1, kLongestSide));
  const capture::Capture& rig = folder.rig();
  requirePlain(rig, folder.path() / "transforms.json");
  const size_t views = rig.frames.size();
  if (views < 1 || views > kMostViews)
    throw Error::mismatch("1.." + std::to_string(kMostViews), std::to_string(views))
        .at("frames")
        .in(folder.path() / "transforms.json");
  for (const capture::Frame& frame : rig.frames) field.cameras.push_back(rig.views[frame.view].camera);
  if (field.mesh.triangles.empty()) throw Error("has no triangles").in(folder.path() / "mesh.bin");

  const std::vector<std::byte> bytes = checkedBytes(folder, kViewsFile, progress);
  try {
    parseViews(bytes, field);
  } catch (Error& error) {
    throw std::move(error).in(folder.file(kViewsFile));
  }
  field.visible.unseenVertices = folder.count("unseen_vertices", 0, field.mesh.positions.size());

  const std::vector<std::byte> texels = checkedBytes(folder, kTexelsFile, progress);
  try {
    parseTexels(texels, field);
  } catch (Error& error) {
    throw std::move(error).in(folder.file(kTexelsFile));
  }
  return field;
}

} // namespace surflect::olf
