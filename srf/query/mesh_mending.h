// Faults that meshes of other programs come with, mended where it is clear how, and named.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/mesh.h"
#include "surfel/progress.h"

#include <span>
#include <string>
#include <vector>

namespace surflect {

struct MendedMesh {
  TriangleMesh mesh;
  std::vector<std::string> notes; // what was left out, turned, or is odd; sentences without a full stop
};

// A sound mesh comes back as it is, without notes, but for vertices inside its box that no triangle uses. Of
// any other,
// - triangles without area and vertices that no triangle uses are left out;
// - spikes and specks far from the rest are left out, see mesh_strays.h;
// - of triangles with the same three corners, one stays; and the first that is wound the other way where
//   cameras see its part of the mesh from both sides;
// - triangles wound against their neighbours are turned, unless cameras would see more backs than before;
// - parts of the mesh of which cameras see the back more than twice as often as the front are turned.
// Throws Error where no triangle has an area, and Cancelled.
MendedMesh mended(TriangleMesh mesh, std::span<const Camera<AcquisitionSpace>> cameras,
                  const Progress& progress = {});

} // namespace surflect
