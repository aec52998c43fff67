// Builds opacity light field maps from views with alpha.  [Vlasic 2003, §6.1]
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/factors.h"
#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/view_blend.h"
#include "render/lightfield/olf/opacity_field.h"
#include "render/lightfield/olf/opacity_hull.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "render/lightfield/olf/view_triangulation.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::olf {

// Vertex light field matrices with opacity: roots of colour and alpha around a vertex, resampled to a grid of
// surface points and a grid of viewing directions, times the hat function of the vertex.
//
// [Vlasic 2003, §6.1, Fig. 6] Vlasic et al.: Opacity Light Fields, I3D.
//
// The views of a vertex are those of VisibleViews above the horizon of its frame, or all where none is.
// Unlike those of lfm/vertex_matrix.h, they are the same for all its rows: where the object is transparent, a
// view sees that, too. So cells are observed for all rows or for none.

// Frames whose view maps hold the views of each vertex: along the mean direction to the visible views that
// face a triangle around it. Along its normal, which the paper takes, many of these views are below the
// horizon of a vertex at the outline, and share the rim of the map with views from above. Vertices that no
// view faces, or whose directions cancel, have the frames of the rings.
std::vector<lfm::VertexFrame> viewFrames(const OpacityField& field, const lfm::Rings& rings);

// A field, and how it is resampled. What it refers to must outlive it.
struct Resampling {
  const OpacityField& field;
  const lfm::Rings& rings;                     // of the field's mesh
  const std::vector<lfm::VertexFrame>& frames; // #positions
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

struct MapBuildOptions {
  MeshChoice mesh = {};
  std::optional<Visible> visible = {}; // none: all for an opacity hull, ring for another mesh
  Order order = Order::list;
  size_t terms = 3;  // of each vertex, at most
  int samples = 0;   // along a triangle's edge; 0: as fine as the photographs, in buildMaps()
  int viewSize = 16; // cells of a view map along each side
};

struct MapBuildReport {
  bool isHull = false;
  size_t triangles = 0, vertices = 0, views = 0;
  int samples = 0;
  double white = 1;
  double meanTerms = 0; // of a vertex
  // Errors of roots, of which those of alpha are at most 1, after 0, 1, ... terms; over all vertices and
  // before quantisation
  std::vector<lfm::FactorError> errors;
  uint64_t resampledBytes = 0;           // a byte for each channel of each sample in each cell
  std::map<std::string, double> seconds; // by step; of matrices and factors, summed over threads
};

// Maps of coding `bytes` of a field and the rings of its mesh, by the options for terms, samples, view size
// and order. Equal for any number of threads. Throws Error for options out of range, and Cancelled.
OpacityMaps mapsOf(const OpacityField& field, const lfm::Rings& rings, const MapBuildOptions& options,
                   MapBuildReport& report, const Progress& progress = {});

// Maps of the training views. A capture without a mesh has an opacity hull. The mesh of `views` may be
// replaced. Throws Error and Cancelled.
OpacityMaps buildMaps(lightfield::Views& views, MapBuildOptions options, MapBuildReport& report,
                      const Progress& progress = {});

} // namespace surflect::olf
