// A surface reflectance field: surfels, the rig that photographed them, and one reflectance image for each
// view and light.  [Weyrich 2005, §3]
#pragma once

#include "srf/capture/capture.h"
#include "srf/codec/view_file.h"
#include "srf/ulr/light_blend.h"
#include "srf/ulr/visibility_weights.h"
#include "surfel/cloud.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace surflect::shading {

struct ReflectanceField {
  std::filesystem::path folder;
  uint64_t identity = 0; // hash of all content
  capture::Capture rig;  // training views and lights only
  SurfelCloud cloud;
  Point3<AcquisitionSpace, double> middle;    // of the cloud's box
  ulr::VisibilityWeights fades;               // per surfel and view
  std::vector<codec::ViewFile> files;         // reflectance images, one file per view of the rig
  std::vector<std::vector<uint32_t>> columns; // per view: the light of each column; empty: fixed illumination
  double white = 1;                           // radiance of a white pixel
  double tolerance = 0;                       // of every block
  ulr::LightBlend lightBlend;                 // chosen when the photographs were packed

  // Every view holds every light, in the order of the rig: cameras and lights are then weighted separately.
  bool isFullProduct = false;

  // Neither the pairs of a capture with gaps nor its lights have to be weighted together.
  bool hasSeparateWeights() const { return rig.lights.empty() || isFullProduct; }
};

} // namespace surflect::shading
