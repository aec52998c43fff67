#include "srf/proxy/one_view.h"

#include "srf/capture/photograph.h"
#include "srf/proxy/relief/photometric.h"
#include "srf/proxy/relief/relief.h"
#include "surfel/base/error.h"

#include <cassert>
#include <numeric>

namespace surflect::proxy {

TriangleMesh meshOfOneView(const capture::Capture& training, bool asRelief, const Progress& progress) {
  assert(training.views.size() == 1);
  const auto& camera = training.views[0].camera;
  std::vector<size_t> frames(training.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  const capture::ViewPhotographs photographs = capture::readViewPhotographs(training, frames, progress);
  const image::Mask mask = image::objectMask(photographs.alpha);
  TriangleMesh mesh;
  if (asRelief) {
    std::vector<capture::Light> lights;
    for (const capture::Frame& frame : training.frames)
      if (frame.light) lights.push_back(training.lights[*frame.light]);
    if (lights.empty()) throw Error("fixed illumination: it does not tell a relief").in(training.file);
    try {
      const relief::LambertImage fits =
          relief::fitLambert(camera, lights, photographs.radiance, mask, progress);
      mesh = relief::reliefMesh(camera, relief::integrateNormals(camera, fits.normal, mask, progress));
    } catch (Error& error) {
      throw std::move(error).at("lights").in(training.file);
    }
  } else {
    mesh = relief::planeMesh(camera, mask);
  }
  if (mesh.triangles.empty()) throw Error("no photograph shows anything of the object").in(training.file);
  return mesh;
}

} // namespace surflect::proxy
