// Plan of a frame: which of a field's passes can change a pixel, and what each must draw.
//
// [Azuma 1999, §3.1 and §3.2]. A pass is one texture region with the texture of one of its directions. The
// paper turns the direction mesh around and looks from the camera; here directions run from the region to
// the camera instead, which is the same with the sign of all directions changed.
#pragma once

#include "render/gl/framebuffer.h"
#include "render/lightfield/slf/blackout_cone.h"
#include "render/lightfield/slf/field.h"
#include "srf/capture/camera.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::slf {

struct PlanOptions {
  bool regionCulling = true;    // leaves out regions that face away or are outside the picture
  bool directionCulling = true; // leaves out directions whose hat function is 0 all over the region
  bool scissor = true;          // limits drawing to a rectangle around the region
};

struct RegionPasses {
  uint32_t region = 0;
  gl::Rect scissor;
  std::vector<uint32_t> triangles;  // of the direction mesh that the view cone may meet, ascending
  std::vector<uint32_t> directions; // their corners, ascending: one pass each
};

struct PassPlan {
  std::vector<RegionPasses> regions; // ascending

  size_t passes() const {
    size_t sum = 0;
    for (const RegionPasses& region : regions) sum += region.directions.size();
    return sum;
  }
};

// Triangles of a direction mesh that hold a direction of the view, and perhaps some beside them, ascending:
// a traversal of neighbours from the triangle at the view's axis, across edges that the view may meet.
// `margin` is in radians. The result does not depend on `start`; on return that is the axis's triangle.
std::vector<uint32_t> trianglesInView(const DirectionMesh& mesh, const RegionView& view, double margin,
                                      uint32_t& start);

class PassPlanner {
public:
  // The field must outlive the planner.
  explicit PassPlanner(const Field& field);

  // For pinholes without distortion. Remembers where traversals started, which makes the next plan faster and
  // does not change it.
  PassPlan plan(const capture::Camera<AcquisitionSpace>& camera, const PlanOptions& options = {});

private:
  const Field* field_;
  std::vector<RegionBound> bounds_; // by region
  std::vector<uint32_t> starts_;    // by region: triangle of the direction mesh
};

// Number of pixels that the basis stage of a plan fills [Azuma 1999, §3.2], up to those at edges. With
// `visitedOnly` each pass draws the triangles at its direction that the plan lists; else all triangles at its
// direction.
double basisFill(const Field& field, const PassPlan& plan, const capture::Camera<AcquisitionSpace>& camera,
                 bool visitedOnly);

} // namespace surflect::slf
