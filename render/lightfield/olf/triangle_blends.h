// Blends of views for each triangle: the closest views of its three corners, combined.
//
// [Vlasic 2003, §4.1, Fig. 3] Vlasic et al.: Opacity Light Fields, I3D.
#pragma once

#include "render/lightfield/olf/opacity_field.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace surflect::olf {

// The union of the corners' closest views. A corner keeps the weights of its own and has 0 for the others, so
// weights are continuous across edges.
struct TriangleBlend {
  static constexpr size_t kMost = 3 * ClosestViews::kMost;

  uint32_t count = 0;
  std::array<uint32_t, kMost> views{};
  std::array<std::array<float, kMost>, 3> weights{}; // of each corner; sum to one
};

TriangleBlend combined(const std::array<ClosestViews, 3>& corners);

// Throws Error unless triangulations of all vertices' views fit into so many bytes.
void requireTriangulable(const VisibleViews& visible, size_t mostBytes = size_t{4} << 30);

// Asks the views of a field; the field must outlive it.
class ViewBlender {
public:
  // Triangulates the views of each vertex for VDTM. Throws Error as lfm::Rings and requireTriangulable() do,
  // and Cancelled.
  explicit ViewBlender(const OpacityField& field, const Progress& progress = {});

  // Closest views of a vertex that has triangles, as seen from a point; from the vertex itself they are those
  // along its normal.
  ClosestViews closest(uint32_t vertex, const Vec3<double>& viewer) const;
  // Blend of each triangle. Equal for any number of threads. Adds seconds by stage: "closest views" of
  // vertices, and "blends" of triangles. Throws Cancelled.
  std::vector<TriangleBlend> blends(const Vec3<double>& viewer,
                                    std::map<std::string, double>* seconds = nullptr,
                                    const Progress& progress = {}) const;

  // Bytes of what is kept beside mesh and pictures, by name.
  std::map<std::string, size_t> bytes() const;

private:
  const OpacityField& field_;
  std::vector<uint32_t> vertices_;                // that have triangles
  std::vector<std::array<uint32_t, 3>> corners_;  // of each triangle
  std::vector<Vec3<double>> centers_;             // of the cameras
  std::vector<Vec3<double>> directions_;          // to the visible views of each vertex, for ULR
  std::vector<ViewTriangulation> triangulations_; // of each vertex, for VDTM
};

} // namespace surflect::olf
