#include "render/lightfield/olf/opacity_file.h"
#include "srf/capture/capture.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

namespace {

using namespace surflect;

constexpr int kTexels = 4; // along each side of a view

// Two pinholes that look at a square.
capture::Capture twoViews() {
  capture::Capture capture;
  for (const char* name : {"a", "b"}) {
    capture::View view;
    view.identity = name;
    view.camera.lens.width = view.camera.lens.height = kTexels;
    view.camera.lens.focalX = view.camera.lens.focalY = kTexels;
    view.camera.lens.centerX = view.camera.lens.centerY = kTexels / 2.0;
    view.camera.cameraFromWorld = {Mat3<double>::Identity(), Vec3<double>(0, 0, name[0] == 'a' ? -2 : -3)};
    capture.views.push_back(view);
    capture::Frame frame;
    frame.view = capture.views.size() - 1;
    frame.picture = std::string(name) + ".png";
    capture.frames.push_back(frame);
  }
  return capture;
}

TriangleMesh square() {
  TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair{0.f, 0.f}, {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
    mesh.positions.emplace_back(x, y, 0.f);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

} // namespace

// The two binary files of a field of two views of 4 x 4 texels. Checksums are made right, or no damage would
// come past them.
void surflect::fuzz(std::string_view input) {
  static const FuzzFolder folder;
  static const capture::Capture capture = twoViews();
  const TwoFiles files = twoFilesOf(input);
  lightfield::LightFieldWriter writer(folder / "field", olf::kFormat, olf::kVersion);
  for (const auto& [name, content] : {std::pair{"views.bin", files.first}, {"texels.bin", files.second}})
    std::ofstream(writer.file(name), std::ios::binary) << content;
  writer.commit(capture, square(),
                {{"method", 0},
                 {"domain", 0},
                 {"order", 0},
                 {"bsp_trees", 1},
                 {"unseen_vertices", 0},
                 {"width", kTexels},
                 {"height", kTexels}});
  const olf::OpacityField field =
      olf::readField(lightfield::LightFieldFolder(folder / "field", olf::kFormat, olf::kVersion));
  for (uint32_t vertex = 0; vertex < field.mesh.positions.size(); ++vertex)
    for (const uint32_t view : field.visible.of(vertex))
      if (field.packed.layer(view).size() != size_t{kTexels * kTexels}) __builtin_trap();
}
