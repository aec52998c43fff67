// Opacity light field maps of random numbers: half-transparent, equal on both sides of an edge.
#pragma once

#include "render/lightfield/olf/opacity_maps.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/render/lightfield/olf/painted_field.h"

#include <utility>

namespace surflect::olf {

inline OpacityMaps paintedMaps(TriangleMesh mesh, unsigned seed = 1) {
  OpacityMaps maps;
  maps.white = 1.25;
  maps.maps = lfm::testing::syntheticMaps(std::move(mesh), {.seed = seed, .channels = kMapChannels});
  maps.maps.meanWhite = 0.8f;
  for (lfm::Term& term : maps.maps.terms)
    for (float& scale : term.scale) scale *= 0.25f;
  return maps;
}

} // namespace surflect::olf
