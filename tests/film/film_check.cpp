// Checks that a film shows the whole object and nothing else. Each frame is compared with a ray-cast of the
// mesh under the same warp: it must be opaque everywhere inside, with the same outline.
//
//   film_check SCRIPT FRAMES MESH [STEP]
//
// Checks every STEP-th frame of the script (default 1), at any rendered size, and exits with 1 if one is
// missing or wrong. The mesh must be fine enough to be bent by moving its vertices.

#include "render/evaluation/measure.h"
#include "render/scene/scene.h"
#include "srf/capture/silhouette.h"
#include "srf/image/exr.h"
#include "surfel/base/error.h"
#include "surfel/geometry/ray_caster.h"
#include "warp/deform.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

using namespace surflect;

namespace {

constexpr int kErosion = 2; // pixels
constexpr double kLeastAlpha = 0.999;
constexpr double kLeastOverlap = 0.99; // intersection over union

struct Agreement {
  double leastAlpha = 1; // on the eroded mask
  int x = 0, y = 0;      // where it is
  double overlap = 1;

  bool holds() const { return leastAlpha >= kLeastAlpha && overlap >= kLeastOverlap; }
};

Agreement agreement(const image::Image& rendered, const image::Mask& truth) {
  const image::Mask interior = image::eroded(truth, kErosion);
  if (std::ranges::count(interior.inside, 1) == 0) throw Error("the mesh is not in the picture");
  Agreement result;
  for (size_t i = 0; i < interior.inside.size(); ++i) {
    const double alpha = rendered.values[4 * i + 3];
    if (!interior.inside[i] || alpha >= result.leastAlpha) continue;
    result.leastAlpha = std::isfinite(alpha) ? alpha : 0;
    result.x = static_cast<int>(i % static_cast<size_t>(interior.width));
    result.y = static_cast<int>(i / static_cast<size_t>(interior.width));
  }
  result.overlap = image::intersectionOverUnion(truth, image::objectMask(rendered));
  return result;
}

Agreement checkFrame(const scene::Script& script, const TriangleMesh& mesh, const std::filesystem::path& path,
                     int frame) {
  const image::Image rendered = image::ExrFile(path).read({"R", "G", "B", "A"});
  const warp::ShotTime time = scene::shotTime(script, frame);
  capture::Camera<ObjectSpace> camera = scene::cameraAt(script, time);
  camera.lens = capture::resized(camera.lens, rendered.width, rendered.height);
  const RayCaster<ObjectSpace> caster(warp::deform(mesh, *scene::warpAt(script, time)));
  try {
    return agreement(rendered, image::objectMask(capture::silhouette(camera, caster)));
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

int checkFilm(const std::filesystem::path& scriptPath, const std::filesystem::path& frames,
              const std::filesystem::path& meshPath, int step) {
  const scene::Script script = scene::readScript(scriptPath);
  scene::requireShot(script);
  if (std::holds_alternative<scene::NamedCamera>(*script.camera))
    throw Error::mismatch("a camera with position or orbit", "a captured one")
        .at("camera.from")
        .in(scriptPath);
  const TriangleMesh mesh = readMesh(meshPath);

  Agreement worst;
  int checked = 0, failed = 0;
  for (int frame = script.frames->first; frame <= script.frames->last; frame += step) {
    const auto path = scene::framePath(*script.output, frames, frame);
    const Agreement found = checkFrame(script, mesh, path, frame);
    std::printf("%s: least alpha inside %.5f at (%d, %d), mask IoU %.5f%s\n", path.c_str(), found.leastAlpha,
                found.x, found.y, found.overlap, found.holds() ? "" : "  FAILED");
    worst.leastAlpha = std::min(worst.leastAlpha, found.leastAlpha);
    worst.overlap = std::min(worst.overlap, found.overlap);
    ++checked;
    failed += !found.holds();
  }
  std::printf(
      "%d frames: least alpha inside %.5f (at least %.3f), least mask IoU %.5f (at least %.2f); %d failed\n",
      checked, worst.leastAlpha, kLeastAlpha, worst.overlap, kLeastOverlap, failed);
  return failed == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  const int step = argc == 5 ? std::atoi(argv[4]) : 1;
  if (argc < 4 || argc > 5 || step < 1) {
    std::fprintf(stderr, "usage: film_check SCRIPT FRAMES MESH [STEP]\n");
    return 2;
  }
  try {
    return checkFilm(argv[1], argv[2], argv[3], step);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "film_check: %s\n", error.what());
    return 1;
  }
}
