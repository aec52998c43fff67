// Geometry that corrects the depth of a lumigraph's rays.
#pragma once

#include "surfel/geometry/mesh.h"

#include <cstddef>

namespace surflect::lumigraph {

// A surface around an object, for pixels that a simplified geometry just misses: the simplified geometry with
// each vertex moved outwards by the mean height of the object's vertices above its triangles, along their
// normals. A surface that holds all of the object would stand off so far that nodes disagree on its outline.
TriangleMesh fringeAround(const TriangleMesh& object, const TriangleMesh& simplified);

} // namespace surflect::lumigraph
