// Opacity hulls: coarse meshes around all that views show.
//
// [Matusik 2002] Matusik et al.: Image-Based 3D Photography Using Opacity Hulls, SIGGRAPH.
#pragma once

#include "render/lightfield/common/views.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>

namespace surflect::olf {

// A mesh of at most `triangles` triangles, with its vertices moved outwards until it holds the given mesh: by
// the largest height of the mesh's vertices above the triangles around each, or by a twentieth of the mesh's
// diagonal. 0 triangles: the mesh as it is.
TriangleMesh coarseAround(const TriangleMesh& mesh, size_t triangles);

// Visual hull of the silhouettes of the training views, in which every pixel with alpha above 0 counts, and a
// pixel around them; so that the tips of hairs are inside. Throws Error as hull::visualHull() does, and if no
// view has a pixel without alpha; and Cancelled.
TriangleMesh opacityHull(const lightfield::Views& views, const Progress& progress = {});

struct MeshChoice {
  bool hull = false;    // an opacity hull, even if the capture has a mesh
  size_t triangles = 0; // of the mesh, at most; 0: as it is
};

// Replaces the mesh of views by the mesh that is asked for; a capture without a mesh has an opacity hull.
// Returns whether the mesh is one. Throws Error and Cancelled.
bool replaceMesh(lightfield::Views& views, const MeshChoice& choice, const Progress& progress = {});

} // namespace surflect::olf
