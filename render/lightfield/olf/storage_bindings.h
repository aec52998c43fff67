// Bindings of the shaders' storage buffers.
#pragma once

namespace surflect::olf {

enum Binding : unsigned { kPieces, kDrawn, kBlends, kPlaces, kHeads, kNodes, kCounter };

} // namespace surflect::olf
