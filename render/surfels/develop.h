// Pictures from the shaded surfels of a raster.
#pragma once

#include "render/splat/splat_raster.h"
#include "srf/shading/shade.h"
#include "surfel/base/time.h"
#include "surfel/cloud.h"
#include "surfel/math/space.h"

#include <array>
#include <span>

namespace surflect::surfels {

// Composite of the layers of a translucent object in each pixel, front to back.
//
// The alpha of a photograph is that of a whole ray: of the layer that the ray meets first, and of all behind
// it. At rest the first layer is therefore all that a pixel shows. Once the object is bent, layers may lie
// behind others that were elsewhere at rest. Such layers are added by `over`, in proportion to their novelty:
//
//   A_k = A_(k-1) + c_k a_k + h_k n_k a_k (1 - A_(k-1) / C_(k-1)),     colours likewise
//   n_k = 1 - min(1, sum over layers j < k of s_j (1 - n_kj))
//
// Symbols: s_k area that layer k covers, as part of the pixel; c_k the part of it that earlier layers leave
// open, h_k = s_k - c_k; C_k = c_1 + .. + c_k; a_k blended alpha of the layer; A_k alpha of the composite;
// n_k novelty of layer k; n_kj how much of layer k the photographs of layer j do not show. Many thin layers
// of the same total depth t cover 1 - exp(-t).

// n_kj: 0 if the layer behind lies on the ray from the captured place of the front layer away from the
// viewer, and 1 if it lies more than 30 degrees aside. The clearance lowers n_kj for layers that are close
// together, as they belong to one sheet. towardsView is the unit direction in which photographs were looked
// up.
float novelty(const Vec3<float>& front, const Vec3<float>& towardsView, const Vec3<float>& behind,
              float clearance);

// The composite of a pixel so far; colour is premultiplied.
struct PixelComposite {
  std::array<float, 4> color{}; // the last is A
  float covered = 0;            // C

  // Adds a layer of blended, premultiplied colour: `open` is c, `hidden` h n.
  void add(const std::array<float, 4>& layer, float open, float hidden);
};

// Captured places, directions of look-up and clearances of the visible splats.
struct LayerPlaces {
  std::span<const Point3<AcquisitionSpace>> p0;
  std::span<const Direction3<AcquisitionSpace>> towardsView;
  std::span<const float> clearance;
};

// RGBA, premultiplied, from values of four channels for each visible splat, premultiplied too. The raster has
// hidden layers (SplatOptions::keepsHidden). confidence, kept: as in splat::blend. Throws Cancelled, as the
// functions below.
image::Image compositeLayers(const splat::SplatRaster& raster, std::span<const float> values,
                             std::span<const float> confidence, const LayerPlaces& places,
                             image::Image kept = {}, const Progress& progress = {});

// RGBA picture, premultiplied, from radiance, confidence and alpha of each entry of raster.visible; `shaded`
// may lack the last two. Layers hide what is behind them. `memory` is reused.
image::Image developRadiance(const splat::SplatRaster& raster, const shading::Shaded& shaded,
                             image::Image memory = {}, const Progress& progress = {});

// RGBA picture, premultiplied, of a translucent object, whose layers are composited.
// towardsView: for each visible surfel, the direction to the viewer in which its photographs were looked up.
image::Image developLayers(const splat::SplatRaster& raster, const SurfelCloud& cloud,
                           std::span<const Direction3<AcquisitionSpace>> towardsView,
                           const shading::Shaded& shaded, image::Image memory = {},
                           const Progress& progress = {});

} // namespace surflect::surfels
