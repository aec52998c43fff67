// Animations of a glTF file, as far as they move a skin.
#pragma once

#include "warp/gltf.h"
#include "warp/gltf_document.h"

#include <vector>

namespace surflect::warp {

// Animations in the file's order. A fault in an animation does not throw; the animation keeps it.
std::vector<GltfAnimation> readAnimations(GltfDocument& document, const Skeleton& skeleton);

} // namespace surflect::warp
