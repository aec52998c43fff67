#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"
#include "warp/mesh_sequence.h"

// A mesh at rest, and a key before another one that is at rest; of kind 'p' they are PLY, else OBJ. Of kind
// 'c', a mesh in OBJ and a point cache.
void surflect::fuzz_mesh_sequence(std::string_view input) {
  static const FuzzFolder folder;
  const TwoFiles files = twoFilesOf(input);
  if (files.kind == 'c') {
    folder.write("rest.obj", files.first);
    folder.write("cache", files.second);
    const warp::MeshSequence sequence = warp::MeshSequence::ofCache(folder / "rest.obj", folder / "cache");
    for (const double time : {0.0, 1.5, 9.0}) sequence.at(time)->position({0.1, -0.2, 0.3});
    return;
  }
  const std::string extension = files.kind == 'p' ? ".ply" : ".obj",
                    other = files.kind == 'p' ? ".obj" : ".ply";
  for (const char* key : {"key.3", "key.7"}) std::filesystem::remove(folder / (key + other));
  folder.write("rest" + extension, files.first);
  folder.write("key.3" + extension, files.second);
  folder.write("key.7" + extension, files.first);
  const warp::MeshSequence sequence(folder / ("rest" + extension), folder / ("key.#" + extension));
  for (const double frame : {0.0, 4.5, 9.0}) sequence.at(frame)->position({0.1, -0.2, 0.3});
}
