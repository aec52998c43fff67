// Pencils that a camera sees: counted one by one, and estimated.
//
// [Domingo 2007, §4.2]   Symbols: N number of pencils in the window; Omega solid angle of the window; a that
// of a pencil; L_w, L_t lengths of the borders of window and pencil.
//
// The paper's p = D fov / (2 pi) sin(fov / 2) takes a window for a patch of latitudes and longitudes, and
// leaves out the pencils that the window's border cuts. estimatedPencils() counts by the solid angle of the
// window, and has a term for its border.
#pragma once

#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/pencil_image.h"
#include "srf/capture/camera.h"
#include "surfel/base/time.h"

#include <array>
#include <cstddef>
#include <vector>

namespace surflect::spherical {

// Directions from what is seen towards the viewer.
struct Window {
  std::array<Vec3<double>, 4> corners; // of the picture; unit, counter-clockwise seen from outside
  // Cone of the directions whose lines through the viewer meet the object's sphere.
  Vec3<double> axis = Vec3<double>::UnitZ();
  double angle = 4; // between axis and side, radians; over pi: all directions
};

// Window of a pinhole without distortion. Throws Error for other lenses.
Window windowOf(const capture::Camera<AcquisitionSpace>& camera, const Sphere& sphere);
// Window without the object's cone.
Window wholeWindow(Window window);

// Pencils of a level whose directions overlap the window and the cone, by their indices.
// Throws Cancelled.
std::vector<Pencil> visiblePencils(const DirectionTree& tree, size_t level, const Window& window,
                                   const Progress& progress = {});

// Expected number of pencils that a randomly turned window overlaps, N = Omega / a + 1 + L_w L_t / (2 pi a).
// The cone does not count.
double estimatedPencils(size_t level, const Window& window);

} // namespace surflect::spherical
