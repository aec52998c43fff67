// Patches: the samples of a triangle with what photographs see at each. The corners of a triangle share its
// patch.
//
// [Chen 2002, §5.2] Chen et al.: Light Field Mapping, SIGGRAPH.
#pragma once

#include "render/lightfield/common/sight.h"
#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/view_blend.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

namespace surflect::lfm {

// Observations of a surface point, as a function that tests can replace by a closed form.
using lightfield::Observation;

// Returns the photographs that see a point of a triangle, in rising order. Called from several threads.
using Observe =
    std::function<std::vector<Observation>(uint32_t triangle, const Point3<AcquisitionSpace, double>& point)>;

// Observations in photographs. Arguments must outlive the function; a triangle without an area is not seen.
Observe observeIn(const lightfield::Sight& sight, const TriangleMesh& mesh, const SmoothNormals& normals);

// Photographs that count at a sample.
enum class Visible {
  sample,  // those that see the sample
  triangle // those that see every sample of its triangle  [Chen 2002, §5.2]
};

// A light field that is seen in photographs. Mesh and rings must outlive it.
struct SeenLightField {
  const TriangleMesh& mesh;
  const Rings& rings; // of the mesh
  PatchGrid patch;
  ViewGrid views;
  Observe observe;
  Visible visible = Visible::sample;
};

struct Patch {
  std::vector<std::vector<Observation>> samples; // of each sample of the grid
  std::vector<uint32_t> wholeViews;              // photographs that see every sample, rising
};

// Holds the patches that vertices need until all vertices of a triangle have been released.
class Patches {
public:
  // `field` must outlive this object.
  explicit Patches(const SeenLightField& field) : field_(field), released_(field.mesh.triangles.size(), 0) {}

  // Observes the triangles around vertices, in parallel, unless they are held. Throws Cancelled.
  void observe(std::span<const uint32_t> vertices, const Progress& progress = {});
  // A triangle around a vertex that was observed.
  const Patch& at(uint32_t triangle) const { return held_.at(triangle); }
  // Drops triangles whose three vertices have all been released; each vertex is released once.
  void release(std::span<const uint32_t> vertices);
  size_t held() const { return held_.size(); }

private:
  const SeenLightField& field_;
  std::vector<uint8_t> released_; // corners of each triangle
  std::map<uint32_t, Patch> held_;
};

} // namespace surflect::lfm
