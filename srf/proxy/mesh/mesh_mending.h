// Faults that meshes of other programs come with, mended where it is clear how, and named.
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace surflect::proxy {

struct MendedMesh {
  TriangleMesh mesh;
  std::vector<std::string> notes; // what was left out, turned, or is odd; sentences without a full stop
};

// Returns a sound mesh unchanged and without notes; only unused vertices inside its box go silently. In any
// other mesh,
// - triangles without area and vertices that no triangle uses are left out;
// - spikes and specks far from the rest are left out, see mesh_strays.h;
// - of triangles with the same three corners, one stays; and the first that is wound the other way where any
//   camera sees more of the back of its part of the mesh than cracks let through;
// - triangles wound against their neighbours are turned, unless cameras would see more backs than before;
// - parts of the mesh of which cameras see the back more than twice as often as the front are turned.
// Throws Error where no triangle has an area, and Cancelled.
MendedMesh mended(TriangleMesh mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras,
                  const Progress& progress = {});

// A mesh file in the capture's coordinates, mended by its cameras: as pack and inspect use it, which take
// part with training frames only. Throws Error, which names the file, and Cancelled.
MendedMesh readMended(const std::filesystem::path& path, const capture::Capture& training,
                      const Progress& progress = {});

} // namespace surflect::proxy
