// Mends faults of meshes from other programs where the remedy is clear, and reports them.
#pragma once

#include "srf/capture/camera.h"
#include "srf/capture/capture.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/mesh_topology.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace surflect::proxy {

// Sides of a mesh, front or back, that cameras see.

// Area of a part's triangles that cameras see from the front, and from the back, counted once for each
// camera. `front` and `back` are for triangles as they are wound; `frontAlike` and `backAlike` for triangles
// all wound like the majority of the part, by area.
struct SeenSides {
  double front = 0, back = 0;
  double frontAlike = 0, backAlike = 0;
};

// Returns the seen sides of each part, estimated by rays from the middles of at most 16384 triangles, but at
// least four per part. Rays go to at most 32 evenly chosen cameras, or to all cameras for parts with
// `asksAll` (#parts). Triangles outside of the picture, or seen at an angle of less than 6 degrees, are
// ignored.
std::vector<SeenSides> seenSides(const TriangleMesh& mesh, const MeshParts& parts,
                                 const std::vector<bool>& asksAll,
                                 std::span<const capture::Camera<AcquisitionSpace>> cameras,
                                 const Progress& progress);

// Stray triangles far from the object: specks and spikes that reconstruction leaves behind. They would
// enlarge the mesh's box, to which other lengths are scaled.
struct Spikes {
  std::vector<uint32_t> triangles; // in rising order
  Vec3<double> farthest = Vec3<double>::Zero();
  bool areSeen = false; // true if they cover over a tenth of the mesh in the pictures: part of the object
};

// Triangles with a corner farther from the box of most vertices (98 % along each axis) than ten times its
// diagonal.
Spikes spikesIn(const TriangleMesh& mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras,
                const Progress& progress);

// Returns the indices of specks, in rising order. The body is the largest parts that together have 99 % of
// the area. A speck is any other part that is farther from the body's box than the box's diagonal, and whose
// middle is in the picture of fewer than half of the cameras.
std::vector<size_t> specksAmong(const std::vector<MeshParts::Part>& parts,
                                std::span<const capture::Camera<AcquisitionSpace>> cameras);

struct MendedMesh {
  TriangleMesh mesh;
  std::vector<std::string> notes; // what was left out, turned or looks odd; sentences without a full stop
};

// Returns a sound mesh unchanged and without notes, except that unused vertices inside its box are removed
// silently. In any other mesh,
// - triangles without area and vertices that no triangle uses are left out;
// - spikes and specks far from the rest are left out;
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
