// Reflectance shared over a surface: everything that its photographs say of the kinds of surface it has, and
// of where they are.
//
//   1. Clusters of surfels                                             clusters.h
//   2. Fibre directions of each cluster; frames are turned to them     fibres.h
//   3. A table for each cluster                                        shared_table.h
//   4. Mixtures of tables at each surfel, by how well each predicts the surfel and its neighbours
//   5. The tables anew, each surfel a member by its weight in the mixture
//   6. Tilts of the normals, if tables predict better with them, and then the tables anew, twice    tilts.h
//   7. Gains by the mixtures                                           gains.h
//
// Steps 1 to 6 look at a sample of the surfels; then each surfel of the surface gets fibre and tilt of the
// sampled surfels near it, and a mixture and gains by its own photographs.
#pragma once

#include "srf/reflectance/fibres.h"
#include "srf/reflectance/photographs.h"
#include "srf/reflectance/reflectance_table.h"
#include "srf/reflectance/tilts.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace surflect::reflectance {

struct SharingOptions {
  float white = 1;                 // reflectance of a white pixel, > 0
  TableGrid grid;                  // of the tables
  size_t mostTables = 8;           // at least 1; merged to as few as the object needs
  size_t photographsInPatch = 500; // about as many find a fibre direction together
  size_t photographs = 120'000; // about as many are looked at for each table in step 5, a quarter in step 3
};

struct SharedReflectance {
  float white = 1; // of SharingOptions
  ReflectanceTables tables;
  // Trust in each table, 0..1: how much better it predicts photographs that are left out than the choice
  // without tables does (tableShare).
  std::vector<float> trust;
  // All below have one entry a surfel.
  std::vector<Tilt> tilts;   // the tables' frame is the given one, tilted (tiltedFrame)
  std::vector<Angle> fibres; // and then turned by this angle (turnedFrame)
  std::vector<TableMixture> mixtures;
  std::vector<Rgb> gains;

  // Frame of the tables at a surfel of the given frame.
  SurfelFrame frameOf(size_t surfel, const SurfelFrame& frame) const {
    return turnedFrame(tiltedFrame(frame, tilts[surfel]), fibres[surfel]);
  }
};

// Surfels of a surface.
struct SurfelPlaces {
  std::span<const Point3<AcquisitionSpace>> places; // scene units
  std::span<const SurfelFrame> frames;              // with the surfels' normals, and any u

  size_t size() const { return places.size(); }
};

// Fits tables, mixtures and gains to photographs, whose directions are in the surfels' frames; every table
// has trust 1. Throws Cancelled.
SharedReflectance shareReflectance(const Photographs& photographs, const SurfelPlaces& surfels,
                                   const SharingOptions& options, const Progress& progress = {});

// The same clusters, fibres and mixtures, with tables and gains from other photographs of the surfels, a
// quarter of options.photographs for each table. Throws Cancelled.
SharedReflectance refitReflectance(const SharedReflectance& shared, const Photographs& photographs,
                                   const SharingOptions& options, const Progress& progress = {});

// Photographs of the surfels [begin, end), whose directions are in their frames.
using PhotographsOf = std::function<PhotographArrays(size_t begin, size_t end)>;

// The tables of a sample, with fibres, mixtures and gains of all surfels. Gains are those by each table
// alone, mixed as the tables are. A surfel with n < kEnough photographs takes 1 - n / kEnough of its errors
// and gains from the nearest surfels with kEnough. Asks for the photographs of kSurfelsAtOnce surfels at a
// time. Throws Cancelled.
inline constexpr size_t kSurfelsAtOnce = 1 << 16;
inline constexpr size_t kEnough = 8;
SharedReflectance spreadReflectance(const SharedReflectance& sample, const SurfelPlaces& sampled,
                                    const SurfelPlaces& surfels, const PhotographsOf& photographsOf,
                                    const Progress& progress = {});

} // namespace surflect::reflectance
