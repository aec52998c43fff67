// Mends faults of meshes from other programs where the remedy is clear, and reports them.
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
  std::vector<std::string> notes; // what was left out, turned or looks odd; sentences without a full stop
};

// Returns a sound mesh unchanged and without notes, except that unused vertices inside its box are removed
// silently. In any other mesh,
// - triangles without area and vertices that no triangle uses are left out;
// - spikes and specks far from the rest are left out, see mesh_strays.h;
// - of triangles with the same three corners, one is kept; so is the first with the opposite winding, if any
//   camera sees more of the back of its part of the mesh than cracks let through;
// - triangles wound against their neighbours are turned, unless cameras would see more backs than before;
// - parts of the mesh of which cameras see the back more than twice as often as the front are turned.
// Throws Error if no triangle has an area, and Cancelled.
MendedMesh mended(TriangleMesh mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras,
                  const Progress& progress = {});

// Reads a mesh file, in the capture's coordinates, and mends it by the capture's cameras. Pack and inspect
// both use this function, with the training frames only. Throws Error naming the file, and Cancelled.
MendedMesh readMended(const std::filesystem::path& path, const capture::Capture& training,
                      const Progress& progress = {});

} // namespace surflect::proxy
