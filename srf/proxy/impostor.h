// The impostor: the geometry that stands in for the captured object.
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::proxy {

struct ImpostorOptions {
  std::filesystem::path mesh; // instead of the capture's geometry, in original coordinates; empty: that
  bool relief = false;        // from the shading of the only view, instead of either
};

struct Impostor {
  enum class Origin {
    given,  // a file
    hull,   // carved from the masks of several views
    plane,  // faces the only view
    relief, // a height field over the plane
  };

  // How well the silhouette of a hull is that of a view's matte.
  struct Fit {
    std::string view;
    double intersectionOverUnion = 0;
    bool leftOut = false; // its matte had no say: it is empty, or cuts away what others show
  };

  TriangleMesh mesh;
  Origin origin = Origin::given;
  std::vector<Fit> fits = {};          // of a hull, per view with a matte
  std::vector<std::string> notes = {}; // of a file: what was mended, see mesh_mending.h
};

// As reports say it: mesh, hull, plane or relief.
std::string_view nameOf(Impostor::Origin origin);

// The geometry that pack samples and inspect draws. Only training frames may take part: hand over a capture
// of these. With nothing else, one view gives a plane, see one_view.h, and several with mattes a visual hull,
// see visual_hull.h. A mesh from a file is mended, see mesh_mending.h. Throws Error and Cancelled.
Impostor impostorOf(const capture::Capture& training, const ImpostorOptions& options,
                    const Progress& progress);

} // namespace surflect::proxy
