// Light field maps of several objects as those of one scene.  [Chen et al. 2002, Fig. 1]
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/placement.h"
#include "srf/capture/capture.h"

#include <cstddef>
#include <span>

namespace surflect::lfm {

// An object of a scene.
struct PlacedObject {
  size_t model = 0; // index of its maps
  Placement placement = {};
};

// Maps of all objects, in their order. Each model's maps are stored once, for any number of objects. Models
// have equal method, layout, samples and view size, and coding `bytes`. A model with fewer terms than others
// has no maps in the remaining terms. Bytes of means are rounded anew for the largest meanWhite of all
// models.
// Throws Error naming model and field if models do not fit together.
LightFieldMaps joined(std::span<const LightFieldMaps> models, std::span<const PlacedObject> objects);

// Views of all objects, without lights. View V of object N, counted from 0, is called "N/V".
capture::Capture joinedRig(std::span<const capture::Capture* const> rigs,
                           std::span<const PlacedObject> objects);

} // namespace surflect::lfm
