// Photographs that see a point of the surface, and the radiance that they show.
//
// A photograph sees a point if the point faces it by more than kGrazing, projects into the picture, the
// pixels around show this part of the surface, and nothing is in the way. Observations fade towards these
// limits.
#pragma once

#include "render/lightfield/common/photographs.h"
#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::lightfield {

// Least cosine between the triangle's normal and the direction to the viewer: that of 85 degrees.
inline constexpr double kGrazing = 0.087;

struct SurfacePoint {
  Point3<AcquisitionSpace, double> position;
  Vec3<double> face;   // normal of the triangle; unit, on the side that is asked for
  Vec3<double> normal; // of the smooth surface, by which views fade at grazing angles; unit
};
// A point of a triangle that has an area.
SurfacePoint surfacePoint(const TriangleMesh& mesh, const SmoothNormals& normals, size_t triangle,
                          const Point3<AcquisitionSpace, double>& position);

struct Observation {
  uint32_t photograph = 0;
  Direction3<AcquisitionSpace> towards; // from the surface towards the viewer; unit
  Vec3<float> radiance = Vec3<float>::Zero();
  float fade = 1; // 0..1, above 0; falls at grazing angles, near the picture's border and near edges
};

class Sight {
public:
  // Both must outlive this object. The rays are those of the mesh on which points lie.
  Sight(const Photographs& photographs, const RayCaster<AcquisitionSpace>& rays);

  size_t photographs() const { return viewpoints_.size(); }
  // Unit direction from a point towards the viewer of a photograph.
  Direction3<AcquisitionSpace, double> towards(size_t photograph,
                                               const Point3<AcquisitionSpace, double>& point) const {
    return viewpoints_[photograph].towards(point);
  }
  // A point in a photograph; empty if the photograph does not see it.
  std::optional<Observation> observe(size_t photograph, const SurfacePoint& point) const;
  // Observations of a point, in the order of photographs.
  std::vector<Observation> observations(const SurfacePoint& point) const;

private:
  const Photographs& photographs_;
  const RayCaster<AcquisitionSpace>& rays_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  std::vector<capture::Projector<AcquisitionSpace>> projectors_;
};

// Size of a photograph's pixel on the surface.

// Median width of a pixel at the surface, in scene units: over points spread evenly by area, and for each
// point over the cameras that it faces and projects into. Zero if no camera sees a point.
double pixelFootprint(const TriangleMesh& mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras);

} // namespace surflect::lightfield
