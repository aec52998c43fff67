// Light field maps by rays, in double precision.
#pragma once

#include "render/lightfield/lfm/edge_corrections.h"
#include "render/lightfield/lfm/maps.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <optional>

namespace surflect::lfm {

class Reference {
public:
  // Throws Error where the mesh does not fit into memory, and Cancelled.
  explicit Reference(LightFieldMaps maps, const Progress& progress = {});

  // RGBA, premultiplied: radianceAt() where the ray through a pixel's middle meets the front of the surface,
  // with alpha 1; 0 elsewhere. All kinds of lenses. Throws Cancelled.
  image::Image render(const capture::Camera<AcquisitionSpace>& camera, std::optional<size_t> terms = {},
                      const Progress& progress = {}) const;

private:
  LightFieldMaps maps_; // of coding `bytes`
  EdgeCorrections edges_;
  RayCaster<AcquisitionSpace> rays_;
};

// Factorisation as the appendix has it, plainly, in double precision.
//
// [Chen 2002, Appendix]; symbols as there: F is M x N, U is M x K, V is N x K.
struct ReferenceFactors {
  Eigen::MatrixXd u, v; // F ~ U V'
};

// "PCA Algorithm": power iteration for one term after another, until v changes by less than `convergence`.
// Terms of a residual that is 0 are 0. Maps are not quantised.
ReferenceFactors referencePca(const Eigen::MatrixXd& f, int terms, double convergence = 1e-12);

// "NMF algorithm": `iterations` updates of both factors from both old ones, then of the sums of the columns
// of U. Quotients 0 / 0 are 0.
ReferenceFactors referenceNmf(const Eigen::MatrixXd& f, int terms, int iterations, uint64_t seed = 1);

} // namespace surflect::lfm
