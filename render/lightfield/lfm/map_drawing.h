// Light field maps in the driver's memory, and the values that programs need to draw them (maps.vert,
// maps.glsl).
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/context.h"
#include "render/gl/program.h"
#include "render/gl/projection.h"
#include "render/gl/texture.h"
#include "render/lightfield/lfm/edge_corrections.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/tile.h"
#include "srf/capture/camera.h"
#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <array>
#include <cstddef>

namespace surflect::lfm {

// Collections of tiles: layers of an array texture, each with columns x rows tiles.
//
// [Chen 2002, §5.3] tiles light field maps of one size together, and draws triangle after triangle
// without a change of textures. Array textures hold all collections, of all terms: layers of one size of
// tiles, then those of the next.
struct Tiling {
  TileShape tile;
  int columns = 1, rows = 1, layers = 1;

  int width() const { return columns * tile.width; }
  int height() const { return rows * tile.height; }

  struct Place {
    int x = 0, y = 0, layer = 0; // the tile's first texel
  };
  Place placeOf(size_t tileNumber) const;
};

struct TilingLimits {
  int side = 2048;  // of a layer, texels
  int layers = 256; // at most; sides grow beyond `side` before there are more
  int largestSide = 16384;
};

// Layers of equal size with little left over. Throws Error if the tiles do not fit.
Tiling tilingOf(const TileShape& tile, size_t tiles, const TilingLimits& limits = {});

// Light field maps in the driver's memory.
class MapTextures {
public:
  // Throws Error if the maps do not fit into the driver's textures, or memory.
  MapTextures(const LightFieldMaps& maps, const gl::Limits& limits);

  const gl::Texture& surface() const { return surface_; }
  const gl::Texture& view() const { return view_; }
  const gl::Texture& mean() const { return mean_; }

  // Where the maps of each triangle are, in floats: texel n is (n % kPlacesWidth, n / kPlacesWidth). A
  // triangle has one texel for its mean map, then for each term those of its surface maps (1 if packed, else
  // 3, by corner) and of the view maps of its 3 corners:
  //   mean, surface  x and y of sample (0, 0) of its map, layer, and a code: 1 if samples go on to the right
  //                  and up, -1 if to the left and down; times 1, 2 or 3 for red, green or blue
  //   view           x and y of the map's first texel, layer, and the scale of vertex and term
  const gl::Texture& places() const { return places_; }
  static constexpr int kPlacesWidth = 2048;

  // Corrections of surface maps and means (edge_corrections.h), in their order: texel n is (n % width,
  // n / width % height, n / (width height)). A texel has two sides of a surface map, or the channels of a
  // mean. A single texel if there are none.
  const gl::Texture& surfaceEdges() const { return surfaceEdges_; }
  const gl::Texture& meanEdges() const { return meanEdges_; }
  bool hasSurfaceEdges() const { return hasSurfaceEdges_; }
  bool hasMeanEdges() const { return hasMeanEdges_; }

  size_t layers() const; // of all textures of maps
  size_t bytes() const;  // of all textures, as the driver holds them

private:
  MapTextures(const LightFieldMaps& maps, const EdgeCorrections& edges, const gl::Limits& limits);

  bool hasSurfaceEdges_, hasMeanEdges_;
  gl::Texture surface_, view_, mean_, places_, surfaceEdges_, meanEdges_;
};

// Terms first..end - 1, and the mean before them.
struct TermRange {
  bool withMean = false;
  size_t first = 0, end = 0;
};

class MapDrawing {
public:
  // Throws Error if the maps do not fit into the driver's memory.
  MapDrawing(const LightFieldMaps& maps, const gl::Limits& limits);

  size_t terms() const { return terms_; }
  bool hasMean() const { return hasMean_; }
  const MapTextures& maps() const { return textures_; }
  // Units 0..5 of maps.glsl.
  std::array<const gl::Texture*, 6> textures() const;
  // Three vertices for each triangle.
  const gl::VertexArray& mesh() const { return mesh_; }

  // Depths of the mesh in a camera's pictures.
  gl::DepthRange depthRange(const capture::Camera<AcquisitionSpace>& camera) const;
  // Sets the camera of position.glsl. Throws Error for a lens that is not a pinhole or distorts.
  void setPosition(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera,
                   const gl::DepthRange& range) const;
  // Sets the viewer of maps.vert.
  void setViewer(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera) const;
  // Sets the uniforms of maps.glsl that are the same for each frame.
  void setMaps(gl::Program& program) const;
  static void setTerms(gl::Program& program, const TermRange& range);

private:
  Eigen::Isometry3d cameraFromCentred(const capture::Camera<AcquisitionSpace>& camera) const;

  Vec3<double> middle_;
  Eigen::AlignedBox3d boxCentred_;
  bool isSigned_, hasMean_, isPacked_;
  size_t terms_;
  int samples_, viewSize_, higherViewSize_;
  float meanWhite_;
  Coding surfaceCoding_, viewCoding_;
  MapTextures textures_;
  gl::VertexArray mesh_;
};

} // namespace surflect::lfm
