// The impostor: the geometry that stands in for the captured object.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::proxy {

// Power of two by which photographs of one view are shrunk (readViewPart) before a relief is made of them, so
// that they have at most four megapixels; at most 8.
int reliefShrink(const capture::Lens& lens);

struct ImpostorOptions {
  std::filesystem::path mesh; // replaces the capture's geometry; in original coordinates; or empty
  bool hull = false;          // true: an opacity hull, of all pixels with alpha above 0, instead of a mesh
  bool relief = false;        // true: a relief from the shading of the only view, instead of a mesh or plane
};

struct Impostor {
  enum class Origin {
    given,  // a file
    hull,   // carved from the masks of several views
    plane,  // faces the only view
    relief, // a height field over the plane
  };

  // Agreement of a hull's silhouette with a view's matte.
  struct Fit {
    std::string view;
    double intersectionOverUnion = 0;
    bool leftOut = false; // matte ignored: empty, or it cuts away what other views show
  };

  TriangleMesh mesh;
  Origin origin = Origin::given;
  std::vector<Fit> fits = {}; // for a hull, per view with a matte
  // Notes for the user: what was mended of a file (mesh_mending.h), and meshes that were not used.
  std::vector<std::string> notes = {};
  std::optional<image::Image> matte = {}; // readViewMatte of the only view, for a plane or relief
};

// Returns the part of the frontal plane (frontal_plane.h) that mattes show or, without mattes, that the
// picture shows. If `asRelief`, the surface follows the normals found by photometric stereo (photometric.h).
// Throws Error, also if the lights do not determine normals, and Cancelled.
Impostor impostorOfOneView(const capture::Capture& training, bool asRelief, const Progress& progress);

// Note for the user that OBJ or PLY files lie beside a capture that names no geometry; nullopt if there are
// none.
std::optional<std::string> noteOnUnusedMeshes(const capture::Capture& capture);

// Name in reports: mesh, hull, plane or relief.
std::string_view nameOf(Impostor::Origin origin);

// Returns the geometry that pack samples and inspect draws. `training` must contain training frames only.
// Without a mesh file, a single view gives a plane or relief, and several views with mattes give
// a visual hull (visual_hull.h), by default of the pixels with alpha above 1/2. A mesh from a file is mended
// (mesh_mending.h). Throws Error and Cancelled.
Impostor impostorOf(const capture::Capture& training, const ImpostorOptions& options,
                    const Progress& progress);

} // namespace surflect::proxy
