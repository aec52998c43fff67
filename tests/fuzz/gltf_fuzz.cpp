#include "surfel/base/error.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"
#include "warp/skeletal_rig.h"

// A .glb, or a .gltf whose buffers are in it or are the folder's pictures, taken for numbers.
void surflect::fuzz_gltf(std::string_view input) {
  static const FuzzFolder folder;
  constexpr size_t fewVertices = 1000; // a field of more takes its time
  folder.write("a.gltf", input);
  try {
    warp::readGltfMesh(folder / "a.gltf");
  } catch (const Error&) { // and yet there may be a skin
  }
  const warp::GltfFile file = warp::readGltf(folder / "a.gltf");
  for (const warp::GltfAnimation& animation : file.animations)
    for (const double seconds : {-1.0, 0.5, 1e9}) warp::pose(file.skeleton, animation.channels, seconds);
  if (file.skeleton.vertices.size() > fewVertices) return;
  const warp::Rig rig(folder / "a.gltf", file.animations.empty() ? "" : file.animations[0].name);
  for (const double seconds : {0.5, 1e9}) rig.at(seconds)->position({0.1, -0.2, 0.3});
}
