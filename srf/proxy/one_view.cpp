#include "srf/proxy/one_view.h"

#include "srf/capture/photograph.h"
#include "srf/proxy/relief/photometric.h"
#include "srf/proxy/relief/relief.h"
#include "surfel/base/error.h"

#include <cassert>
#include <numeric>

namespace surflect {

TriangleMesh meshOfOneView(const Capture& training, bool asRelief, const Progress& progress) {
  assert(training.views.size() == 1);
  const auto& camera = training.views[0].camera;
  std::vector<size_t> frames(training.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  const ViewPhotographs photographs = readViewPhotographs(training, frames, progress);
  const Mask mask = objectMask(photographs.alpha);
  TriangleMesh mesh;
  if (asRelief) {
    std::vector<Light> lights;
    for (const Frame& frame : training.frames)
      if (frame.light) lights.push_back(training.lights[*frame.light]);
    if (lights.empty()) throw Error("fixed illumination: it does not tell a relief").in(training.file);
    try {
      const LambertImage fits = fitLambert(camera, lights, photographs.radiance, mask, progress);
      mesh = reliefMesh(camera, integrateNormals(camera, fits.normal, mask, progress));
    } catch (Error& error) {
      throw std::move(error).at("lights").in(training.file);
    }
  } else {
    mesh = planeMesh(camera, mask);
  }
  if (mesh.triangles.empty()) throw Error("no photograph shows anything of the object").in(training.file);
  return mesh;
}

} // namespace surflect
