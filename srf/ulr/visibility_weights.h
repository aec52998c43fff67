// Visibility of surfels in views: a weight that is 1 where a view sees the surfel well and falls smoothly to
// 0 where the surfel becomes hidden, turns away or leaves the image. A view's penalty is divided by it, so
// that the view leaves the blend without a jump, along camera paths and along the surface. The weight belongs
// to the captured place p0: it is computed once, and nothing switches while an animation runs.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/base/progress.h"
#include "surfel/cloud.h"
#include "surfel/geometry/ray_caster.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect::ulr {

// 0 for x <= from, 1 for x >= to, continuously differentiable between.
double smoothStep(double from, double to, double x);

// Fade at grazing angles, from the cosine between normal and direction to the camera: 0 from 90 degrees on, 1
// from a cosine of 0.3 on, smooth between.
double grazingFade(double cosine);

// Smooth fall over the last pixels before the border of the image; 0 outside.
double borderFade(const capture::Lens& lens, capture::Pixel pixel);

// A row per surfel of one byte per view, the logarithm of the fade: near a camera of small penalty p a fade
// still moves the weights when it is as small as p, and equal ratios of fades move them by equal amounts.
struct VisibilityWeights {
  size_t views = 0;
  std::vector<uint8_t> values; // 0 where the view does not see the surfel

  std::span<const uint8_t> of(size_t surfel) const { return {values.data() + surfel * views, views}; }

  // 255 for 1, then down to 1 for 2^-20 in steps of 5.6 %; 0 for less.
  static uint8_t encode(double fade);
  static float decode(uint8_t value);
};

// 1 where the line of sight from a surfel to a view is free, else 0; 0 for surfels that face away from the
// view. Rows as in VisibilityWeights.
std::vector<uint8_t> lineOfSight(const SurfelCloud& cloud,
                                 std::span<const capture::Camera<AcquisitionSpace>> views,
                                 const RayCaster<AcquisitionSpace>& impostor, const Progress& progress);

// The share of free lines of sight among the surfels around a point, weighted by a smooth kernel of the given
// radius (scene units), as seen by each view; a continuous function of the point. Only surfels of the same
// sheet that face the view have a vote. 0 where none has.
class SmoothedVisibility {
public:
  SmoothedVisibility(const SurfelCloud& cloud, std::span<const capture::Camera<AcquisitionSpace>> views,
                     std::vector<uint8_t> lineOfSight, float radius, const Progress& progress = {});
  ~SmoothedVisibility();

  // One value per view.
  void at(const Point3<AcquisitionSpace>& p, const Normal3<AcquisitionSpace>& n,
          std::span<float> visibility) const;

private:
  struct Votes;
  std::unique_ptr<const Votes> votes_;
};

// The fade of a view at any point of the surface with unit normal n; `openness` from SmoothedVisibility at
// this point.
double visibilityWeight(const capture::Camera<AcquisitionSpace>& camera,
                        const capture::Viewpoint<AcquisitionSpace>& viewpoint,
                        const Point3<AcquisitionSpace>& p, const Normal3<AcquisitionSpace>& n,
                        double visibility);

// How far the kernel of the openness reaches: four splat radii, of which the median of the cloud is taken.
float visibilityRadius(const SurfelCloud& cloud);

// The fades at all surfels.
VisibilityWeights visibilityWeights(const SurfelCloud& cloud,
                                    std::span<const capture::Camera<AcquisitionSpace>> views,
                                    const RayCaster<AcquisitionSpace>& impostor, const Progress& progress);

} // namespace surflect::ulr
