// Queries of a frame: for each visible surfel the directions to viewer and lights, and the lights'
// irradiance, brought back to acquisition space by L [Weyrich 2005, Eq. 10].
#pragma once

#include "render/scene/scene.h"
#include "render/surfels/prepared_environment.h"
#include "srf/weights/query.h"
#include "surfel/cloud.h"

#include <cstdint>
#include <span>

namespace surflect::surfels {

// L of one surfel [Weyrich 2005, Eq. 10], in double precision. The surfel must not be dead.
LookUp<double> lookUpAt(const SurfelCloud& rest, const DeformedCloud& deformed, size_t surfel);

// A cloud whose tangents are the orthonormal ones of [Weyrich 2005, Eqs. 8 and 9], for L alone: splats keep
// the warped tangents. Throws Cancelled.
DeformedCloud withBisectorFrames(DeformedCloud deformed, const Progress& progress = {});

// A cloud with orthonormal tangents, for L alone, that turn with the image of a line under J, not by the
// polar factor: L takes a groove that the warp carries back to where it was. lines: angle of each surfel's
// line from u0 towards v0 (#surfels). Throws Cancelled.
DeformedCloud withCarriedLines(DeformedCloud deformed, std::span<const Angle> lines,
                               const Progress& progress = {});

// One query per entry of `surfels`, none of which may be dead. Environments are rotated by L; `environments`
// has one entry per ShotEnvironment of the lights, in order, and must outlive the result. In double
// precision; the same bits for any number of threads, and for AVX2 and AVX-512. Throws Cancelled.
weights::QueryBatch queriesAt(const SurfelCloud& rest, const DeformedCloud& deformed,
                              std::span<const uint32_t> surfels, const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights,
                              std::span<const PreparedEnvironment* const> environments = {},
                              const Progress& progress = {});

// queriesAt, in the memory of a batch that is no longer needed.
void writeQueries(const SurfelCloud& rest, const DeformedCloud& deformed, std::span<const uint32_t> surfels,
                  const capture::Camera<ObjectSpace>& camera, std::span<const scene::ShotLight> lights,
                  std::span<const PreparedEnvironment* const> environments, const Progress& progress,
                  weights::QueryBatch& batch);

} // namespace surflect::surfels
