// Pictures of an opacity light field in double precision: every triangle that the ray of a pixel's centre
// meets from its front, in the exact order of depths.
//
// [Vlasic 2003] Vlasic et al.: Opacity Light Fields, I3D.   [Porter 1984] Porter, Duff: Compositing Digital
// Images, SIGGRAPH.
// Symbols: alpha_i, c_i opacity and premultiplied colour of the fragment i, counted from the viewer; a, c
// those of the fragments before; w_k, C_k weights and colours of the views of a triangle.
#pragma once

#include "render/lightfield/olf/opacity_field.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "render/lightfield/olf/triangle_blends.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

namespace surflect::olf {

// Premultiplied colour and alpha of a packed view at a pixel position of its photograph: bilinear between the
// stored texels; beyond the used part the edge's.
Eigen::Vector4d texelAt(const PackedViews& packed, size_t view, const capture::Pixel& pixel);

// sum_k w_k C_k at a point of a triangle, with w_k interpolated between the corners.
Eigen::Vector4d blendAt(const OpacityField& field, const TriangleBlend& blend, const Vec3<double>& point,
                        const Vec3<double>& barycentric);

// Composites of a fragment behind nearer ones; colours are premultiplied.

// c + (1 - a) c_i  [Porter 1984, over; Vlasic 2003, §3]: layers are independent of each other.
inline Eigen::Vector4d over(const Eigen::Vector4d& nearer, const Eigen::Vector4d& fragment) {
  return nearer + (1 - nearer[3]) * fragment;
}

// c + max(0, 1 - a / alpha_i) c_i: the opacity is max(a, alpha_i). A photograph's alpha is that of all layers
// along its ray, so each layer has an estimate of the same opacity; a farther one shows only what its
// estimate has beyond those before. From the place of a camera, all layers estimate the same.
inline Eigen::Vector4d inFrontOf(const Eigen::Vector4d& nearer, const Eigen::Vector4d& fragment) {
  return fragment[3] > nearer[3] ? Eigen::Vector4d(nearer + (1 - nearer[3] / fragment[3]) * fragment)
                                 : nearer;
}

// A triangle that a ray meets from its front.
struct FrontHit {
  double distance = 0;
  uint32_t triangle = 0;
  Vec3<double> barycentric = Vec3<double>::Zero();
};

struct ReferencePicture {
  image::Image color;    // RGBA, premultiplied
  size_t mostLayers = 0; // fragments of a pixel, at most
};

using Composite = Eigen::Vector4d(const Eigen::Vector4d& nearer, const Eigen::Vector4d& fragment);

// Composite of premultiplied colorOf(hit, direction of the ray) of all hits, nearest first. Triangles at
// equal depth are in the order of the mesh. The camera is a plain pinhole.
ReferencePicture
composited(const TriangleMesh& mesh, const capture::Camera<AcquisitionSpace>& camera,
           const std::function<Eigen::Vector4d(const FrontHit& hit, const Vec3<double>& direction)>& colorOf,
           Composite& composite = inFrontOf);

// Picture of blended views; by over(), as a BSP tree needs it, if so asked.
ReferencePicture referencePicture(const OpacityField& field, const ViewBlender& blender,
                                  const capture::Camera<AcquisitionSpace>& camera,
                                  Composite& composite = inFrontOf);

// Picture of opacity light field maps: colorAt() of the first `terms` terms. Maps may be compressed.
ReferencePicture referencePicture(const OpacityMaps& maps, const capture::Camera<AcquisitionSpace>& camera,
                                  std::optional<size_t> terms = {});

} // namespace surflect::olf
