// Pixel grid: the geometry of a model of one view, whose surfels are corners of squares of the view's pixels.
// The pixels between the corners need no surfels: each is drawn by itself, at its place in its square.
#pragma once

#include "srf/capture/camera.h"
#include "srf/codec/view_file.h"
#include "srf/weights/reflectance_field.h"
#include "surfel/base/time.h"
#include "surfel/cloud.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"

#include <cstddef>

namespace surflect::model {

// Grid over the pictures of a lens. step: 1, 2, 4 or 8 pixels.
weights::PixelGrid pixelGrid(const capture::Lens& lens, int step);

// The finest grid, from steps of `finest` pixels on, with about `most` corners, or else the coarsest one.
weights::PixelGrid pixelGridWithin(const capture::Lens& lens, int finest, size_t most);

// Surfels at the corners of a grid: where their rays meet the mesh, with its normals. A ray beside the mesh
// has depth and normal of the nearest corner on it, so that squares at outlines are whole. Throws Error if no
// ray meets the mesh, and Cancelled.
SurfelCloud cornersOf(const weights::PixelGrid& grid, const capture::Camera<AcquisitionSpace>& camera,
                      const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& caster,
                      const Progress& progress = {});

// Marks corners beside the object, none of whose squares meet a stored texel: coverage and visibility become
// 0. cloud: surfels of the grid; visibility: of the only view. Reads the whole file. Throws Error as
// ViewFile::read, and Cancelled.
void markBesideObject(const weights::PixelGrid& grid, const codec::ViewFile& view, SurfelCloud& cloud,
                      weights::VisibilityWeights& visibility, const Progress& progress = {});

} // namespace surflect::model
