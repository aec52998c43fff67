// Light field maps as a method.  [Chen 2002]
#pragma once

#include "render/lightfield/lfm/joined.h"
#include "render/method/method.h"

#include <memory>
#include <span>

namespace surflect::lfm {

// Frames have the AOV "depth". Terms of NMF have no order, so that only maps of PCA have the option "terms".
const method::Method& lfmMethod();

// Opens several models, placed, as one scene. Throws Error as Method::open and joined() do, and Cancelled.
std::unique_ptr<method::Renderer> openScene(std::span<const std::filesystem::path> models,
                                            std::span<const PlacedObject> objects,
                                            const method::Setting& setting, const Progress& progress = {});

} // namespace surflect::lfm
