// Pixels of the photographs that light checks compare with shading of the mesh.
#pragma once

#include "srf/capture/capture.h"
#include "srf/validation/validation.h"

#include <cstddef>
#include <vector>

namespace surflect::validation {

// One photograph at the selected pixels of its view.
struct LitShot {
  size_t light;
  std::vector<float> luminance; // per pixel of the view
};

// Selected pixels of one view, inside all of its masks.
struct LightSamples {
  std::vector<Point3<AcquisitionSpace, double>> points;
  std::vector<Vec3<double>> normals; // towards the camera's side
  std::vector<size_t> pixels;        // index in the picture
  std::vector<LitShot> shots;
  size_t seen = 0, turned = 0; // pixels of the mesh, inside masks or not; those showing backs
};

// Samples of the views that the effort selects.
std::vector<LightSamples> readLightSamples(const capture::Capture& capture, const TriangleMesh& mesh,
                                           const RayCaster<AcquisitionSpace>& caster,
                                           const CheckEffort& effort, const Progress& progress);

} // namespace surflect::validation
