// Reflectance shared over a surface: everything that its photographs say of the kinds of surface it has, and
// of where they are.
//
//   1. Clusters of surfels                                             clusters.h
//   2. Fibre directions of each cluster; frames are turned to them     fibres.h
//   3. A table for each cluster                                        shared_table.h
//   4. Mixtures of tables at each surfel, by how well each predicts the surfel and its neighbours
//   5. The tables anew, each surfel a member by its weight in the mixture
//   6. Gains by the mixtures                                           gains.h
#pragma once

#include "srf/reflectance/fibres.h"
#include "srf/reflectance/photographs.h"
#include "srf/reflectance/reflectance_table.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::reflectance {

struct SharingOptions {
  float white = 1;                 // reflectance of a white pixel, > 0
  TableGrid grid;                  // of the tables
  size_t mostTables = 8;           // at least 1; merged to as few as the object needs
  size_t photographsInPatch = 500; // about as many find a fibre direction together
  size_t photographs = 300'000;    // about as many are looked at for each table; surfels are left out evenly
};

struct SharedReflectance {
  ReflectanceTables tables;
  // All below have one entry a surfel.
  std::vector<Angle> fibres; // the tables' frame is the given one, turned by this angle (turnedFrame)
  std::vector<TableMixture> mixtures;
  std::vector<Rgb> gains;
  std::vector<float>
      errors; // leftOutErrors of its photographs by mixture and gain, for tableShare; 0 without photographs
};

// Fits tables, mixtures and gains to photographs. places: in scene units (#surfels). frames: with the
// surfels' normals, and any u (#surfels); directions of photographs are in these frames. Throws Cancelled.
SharedReflectance shareReflectance(const Photographs& photographs,
                                   std::span<const Point3<AcquisitionSpace>> places,
                                   std::span<const SurfelFrame> frames, const SharingOptions& options,
                                   const Progress& progress = {});

} // namespace surflect::reflectance
