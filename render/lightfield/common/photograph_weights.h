// Weights of a view's photographs under single lights (OLAT), with which their sum is its photograph under
// other light.
//
// Radiance is linear in light: L = sum_l w_l L_l, with w_l = E_l / C_l per channel.
//   L_l  photograph under captured light l         C_l  irradiance of captured light l at the object's middle
//   E_l  irradiance, of the new light, that is assigned to captured light l
//
// [Weyrich 2005, Fig. 2] assigns each texel of an environment to its nearest captured light. A directional or
// point light is shared by the nearest captured lights with the weights of unstructured lumigraph rendering
// (srf/weights/ulr.h) for its direction from the object's middle.
#pragma once

#include "render/scene/scene.h"
#include "srf/capture/photograph.h"
#include "srf/capture/rig.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::lightfield {

// Index of the captured light nearest to a direction; the first of equally near ones. Directions are unit,
// and there is at least one light.
size_t nearestLight(std::span<const Direction3<AcquisitionSpace, double>> lights,
                    const Direction3<AcquisitionSpace, double>& towards);

// Weights of the photographs under captured lights (#captured, at least one) for the sum of the lights of a
// shot. The shot's object space is the acquisition space, as nothing is warped. A direction within 1e-5
// radians of a captured light is that light: all other weights are 0. Throws Error for a weight that is not
// finite, as of a light at the object's middle, and Cancelled.
std::vector<Rgb> photographWeights(std::span<const capture::Light> captured,
                                   const Point3<AcquisitionSpace, double>& middle,
                                   std::span<const scene::ShotLight> lights, const Progress& progress = {});

// Sum of photographs of one view, each multiplied by its weight (#photographs, at least one); in double
// precision, so that a single photograph becomes exactly its product. Alpha is the maximum over the
// photographs; colours are summed premultiplied, as a photograph shows nothing where its own alpha is 0.
capture::Photograph weightedSum(std::span<const capture::Photograph> photographs,
                                std::span<const Rgb> weights);

} // namespace surflect::lightfield
