// The same look-up without splats: radiance is asked for at the very points of the deformed mesh that a
// pixel's rays meet. What splatting adds to the error is the difference.
#pragma once

#include "render/surfels/frame.h"
#include "surfel/geometry/ray_caster.h"
#include "warp/deform.h"

#include <functional>
#include <memory>

namespace surflect::bench {

class RayCastSurface {
public:
  // `mesh` is the one that the model was made of, and fine enough for the warp, which must outlive this.
  RayCastSurface(const model::Model& model, const TriangleMesh& mesh, const warp::Warp& warp,
                 const Progress& progress);
  ~RayCastSurface();

  // raysAcross^2 rays a pixel, each with a surfel of its own where it meets the mesh: its place, the smooth
  // normal, and the fades of the views there. A pixel is the mean of its rays: RGBA, premultiplied.
  std::function<image::Image(std::span<const scene::ShotLight>)>
  view(const capture::Camera<ObjectSpace>& camera, int raysAcross, const model::ShadeOptions& options,
       codec::BlockCache& cache, const Progress& progress) const;

private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

} // namespace surflect::bench
