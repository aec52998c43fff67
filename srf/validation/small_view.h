// Reduced view for checks: one photograph and the mesh's silhouette, at a size that is quickly read.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/mask.h"
#include "surfel/base/time.h"
#include "surfel/geometry/ray_caster.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace surflect::validation {

struct SmallView {
  size_t view = 0, frame = 0;               // indices into the capture
  capture::Camera<AcquisitionSpace> camera; // with the small picture's lens
  image::Image radiance;                    // 3 channels, means over squares
  std::optional<image::Mask> matte;         // of the photograph, if it has one
  image::Mask outline;                      // silhouette of the mesh

  // Object pixels: the matte, or else the mesh's silhouette.
  const image::Mask& object() const { return matte ? *matte : outline; }
};

// Calls look(view) for up to `most` views that have frames, evenly chosen, one after the other, at no more
// than 512 pixels per side. Reads one photograph of each view: the one whose light is nearest to the camera's
// direction, seen from `middle`. Progress names the stage "photographs".
void forEachSmallView(const capture::Capture& capture, const RayCaster<AcquisitionSpace>& mesh,
                      const Point3<AcquisitionSpace, double>& middle, size_t most, const Progress& progress,
                      const std::function<void(SmallView)>& look);

// Names of cameras and lights in findings.

// A faulty camera or light, with the size of its fault.
struct Offender {
  double badness;
  std::string text;
};

// The worst three: "C03 (31 %), C07 (12 %), C01 (9 %)".
inline std::string worst(std::vector<Offender> offenders) {
  std::ranges::stable_sort(offenders, std::ranges::greater(), &Offender::badness);
  std::string list;
  for (size_t i = 0; i < std::min<size_t>(3, offenders.size()); ++i)
    list += (i > 0 ? ", " : "") + offenders[i].text;
  return list;
}

// Thresholds for the contrast at the mesh's outline (ViewMeasures); misplaced meshes have 0.9 to 1.7.
inline constexpr double kSteepOutline = 2, kFlatOutline = 1.5;

} // namespace surflect::validation
