// Visibility weights of surfels in views: 1 where a view sees the surfel well, falling smoothly to 0 where
// the surfel becomes hidden, turns away or leaves the image. A view's penalty is divided by its weight, so
// that the view leaves the blend without a jump along camera paths and along the surface. A weight belongs to
// the captured place p0: it is computed once and does not change in an animation.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/base/time.h"
#include "surfel/cloud.h"
#include "surfel/geometry/ray_caster.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect::weights {

// Encoded fades, one row per surfel with one byte per view. Fades are stored as logarithms: equal ratios of
// fades change the blend equally, and for a view of small penalty p even fades as small as p matter.
struct VisibilityWeights {
  size_t views = 0;
  std::vector<uint8_t> values; // 0 if the view does not see the surfel

  std::span<const uint8_t> of(size_t surfel) const { return {values.data() + surfel * views, views}; }

  // Code 255 stands for 1 and code 1 for 2^-20, in steps of 5.6 %; code 0 stands for anything smaller.
  static uint8_t encode(double fade);
  static float decode(uint8_t value);
};

// 1 if the line of sight from a surfel to a view is free, else 0; 0 for surfels that face away from the view.
// Rows as in VisibilityWeights.
std::vector<uint8_t> lineOfSight(const SurfelCloud& cloud,
                                 std::span<const capture::Viewpoint<AcquisitionSpace>> views,
                                 const RayCaster<AcquisitionSpace>& impostor, const Progress& progress);

// Smoothed visibility of views, or of lights, at a surface point: the fraction of free lines of sight among
// nearby surfels, weighted by a smooth kernel of the given radius (scene units). Continuous in the point.
// Only surfels that face the view and whose normals agree with the point's are counted; 0 if there are none.
class SmoothedVisibility {
public:
  SmoothedVisibility(const SurfelCloud& cloud, std::span<const capture::Viewpoint<AcquisitionSpace>> views,
                     std::vector<uint8_t> lineOfSight, float radius, const Progress& progress = {});
  ~SmoothedVisibility();

  // Visibility in each view (#views).
  void at(const Point3<AcquisitionSpace>& p, const Normal3<AcquisitionSpace>& n,
          std::span<float> visibility) const;

private:
  struct Votes;
  std::unique_ptr<const Votes> votes_;
};

// Visibility weight of a view at a surface point with unit normal n; `visibility` is from SmoothedVisibility
// at this point.
double visibilityWeight(const capture::Camera<AcquisitionSpace>& camera,
                        const capture::Viewpoint<AcquisitionSpace>& viewpoint,
                        const Point3<AcquisitionSpace>& p, const Normal3<AcquisitionSpace>& n,
                        double visibility);

// Kernel radius of SmoothedVisibility: four times the median splat radius of the cloud.
float visibilityRadius(const SurfelCloud& cloud);

// Visibility weights of all surfels. Throws Cancelled.
VisibilityWeights visibilityWeights(const SurfelCloud& cloud,
                                    std::span<const capture::Camera<AcquisitionSpace>> views,
                                    const RayCaster<AcquisitionSpace>& impostor, const Progress& progress);

// Visibility weights of all surfels of an opacity hull. The hull is not the object: what it hides may be air,
// and near its outline photographs from both sides of the horizon must blend. So a view counts wherever its
// picture holds the surfel, and only the border of the picture and its resolution lower the weight. Throws
// Cancelled.
VisibilityWeights opacityHullWeights(const SurfelCloud& cloud,
                                     std::span<const capture::Camera<AcquisitionSpace>> views,
                                     const Progress& progress = {});

} // namespace surflect::weights
