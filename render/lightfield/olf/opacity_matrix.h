// Vertex light field matrices with opacity: roots of colour and alpha around a vertex, resampled to a grid of
// surface points and a grid of viewing directions, times the hat function of the vertex.
//
// [Vlasic 2003, §6.1, Fig. 6] Vlasic et al.: Opacity Light Fields, I3D.
//
// The views of a vertex are those of VisibleViews above its horizon, or all where none is. Unlike those of
// lfm/vertex_matrix.h, they are the same for all its rows: where the object is transparent, a view sees that,
// too. So cells are observed for all rows or for none.
#pragma once

#include "render/lightfield/lfm/factors.h"
#include "render/lightfield/lfm/patch_grid.h"
#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/view_grid.h"
#include "render/lightfield/olf/opacity_field.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::olf {

// A field, and how it is resampled. What it refers to must outlive it.
struct Resampling {
  const OpacityField& field;
  const lfm::Rings& rings; // of the field's mesh
  lfm::PatchGrid patch;
  lfm::ViewGrid grid;
  double white = 1; // radiance
};

struct OpacityMatrix {
  size_t rows = 0, cells = 0;
  std::vector<float> values;  // [rows][cells][kMapChannels]
  std::vector<float> weights; // [rows][cells]: 1 in the hull of the views, else 0

  lfm::LightFieldMatrix view() const;
};

// Matrix of a vertex that has triangles; its rows are those of `rows`. Throws Cancelled.
OpacityMatrix opacityMatrix(const Resampling& resampling, const lfm::RingRows& rows, uint32_t vertex,
                            const Progress& progress = {});

// Radiance that 99.5 % of the texels which are more opaque than transparent do not exceed, in any channel; 1
// if all are black.
double whiteLevel(const PackedViews& packed);

} // namespace surflect::olf
