// Light field maps: a surface light field as a sum of products of maps of places and maps of directions.
//
// [Chen 2002] Chen, Bouguet, Chu, Grzeszczuk: Light Field Mapping: Efficient Representation and
// Hardware Rendering of Surface Light Fields.
//
//   root(p, d) = mean(p) + sum over terms k, over corners v of p's triangle, of s_vk hat_v(p) g_vk(p) h_vk(d)
//                                                                      [Chen 2002, Eqs. 3 and 6]
//   hat  hat function of a corner: its barycentric coordinate. The paper stores hat g in one map, which no
//        longer vanishes at the far edge once it is compressed
//   g  surface map of a triangle and one of its corners: a number for each sample (rings.h)
//   h  view map of a vertex: channels of each cell of a square grid around the disc of directions. In the
//      coordinates of discPoint(), cell (x, y) has its centre at ((x + 0.5) / size, (y + 0.5) / size)
//   s  scale of a vertex and term; g and h are within -1..1
//
// Triangles that share an edge may have different g or means on it, after compression by triangle; then their
// mean counts (edge_corrections.h).
//
// Radiance is the square of the root (root_radiance.h); roots below 0 are black. There are three channels,
// RGB; or four, where the last is a root of opacity and the others are of radiance times opacity. Between
// samples g and the mean are interpolated linearly (blendAt()), h bilinearly between cell centres, constant
// beyond the outermost.
//
// Sizes: a byte for each channel of a cell of a view map, 3 for each sample of a triangle and term (one for
// each corner).
#pragma once

#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/lfm/factors.h"
#include "render/lightfield/lfm/rings.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

enum class SurfaceLayout {
  packed, // a map has the surface maps of all three corners of a triangle, in red, green and blue
  scalar  // each corner has a map of its own, whose samples count as if the corner were the first
};

// Coding of maps: one for all surface maps, one for all view maps, and one for the mean.
enum class Coding {
  bytes, // maps one after another. Surface maps: bytes of a sample together; view maps: row by row
  dxt1,  // tiles (tile.h) one after another, as blocks of 8 bytes (s3tc.h); signed bytes plus 128
  dxt5   // as dxt1, with blocks of 16 bytes, for maps of four channels
};

// Maps of equal size.
struct MapSet {
  Coding coding = Coding::bytes;
  size_t count = 0; // maps
  std::vector<uint8_t> data;
};

// Maps, and the index of each user's map. There are as many maps as users, or a codebook of fewer.
struct MapTable {
  MapSet maps;
  std::vector<uint32_t> mapOf;
};

inline constexpr uint32_t kNoMap = UINT32_MAX; // a map of zeros

// One approximation term.
struct Term {
  MapTable surface;         // users: triangles if packed, else corners: 3 * triangle + corner
  MapTable view;            // users: vertices
  std::vector<float> scale; // by vertex; 0 where the vertex has fewer terms
};

struct LightFieldMaps {
  TriangleMesh mesh;               // vertices at one position are one vertex
  std::vector<VertexFrame> frames; // by vertex
  // PCA: bytes are int8_t, value max(byte / 127, -1). NMF: value byte / 255; there is no mean.
  Factorization method = Factorization::pca;
  SurfaceLayout layout = SurfaceLayout::packed;
  int samples = 24;  // along a triangle's edge
  int viewSize = 32; // cells of a view map of the first term along each side
  // Cells of view maps from the second term on, which change less with the direction  [Chen 2002, §4]
  int higherViewSize = 32;
  size_t channels = 3; // of view maps and means: 3 or 4
  std::vector<Term> terms;
  MapTable mean;       // users: triangles; channels of each sample: meanWhite byte / 255. None for NMF
  float meanWhite = 1; // root of the radiance of byte 255
};

inline constexpr int kLeastViewSize = 2, kLargestViewSize = 256;
inline constexpr size_t kMostTerms = 64;

// Bytes of the maps as they are stored, without mesh and frames.
struct MapBytes {
  size_t surface = 0, view = 0, mean = 0;
  size_t indices = 0; // of codebooks, indexBytes() for each user; 0 where each user has a map of its own
  size_t scales = 0;
  size_t total() const { return surface + view + mean + indices + scales; }
};
MapBytes bytesOf(const LightFieldMaps& maps);

// Bytes of the index of a user: 2 if that is enough for all maps and kNoMap, else 4.
inline size_t indexBytes(const MapTable& table) { return table.maps.count < UINT16_MAX ? 2 : 4; }
// Whether user i has map i.
bool isIdentity(const MapTable& table);

// Throws Error naming the field unless sizes, indices and numbers fit together.
void requireComplete(const LightFieldMaps& maps);

// Light field maps from the factors of vertices.
class MapStore {
public:
  // Packed maps without content (emptyMaps()), and the rings of their mesh, which must outlive this object.
  MapStore(LightFieldMaps empty, const Rings& rings);

  // Writes the factors of a vertex. Different vertices may be written by several threads at once.
  void put(const Factors& factors, const RingRows& rows, uint32_t vertex);

  // All maps, without those that are 0. Means above twice the root of `white`, a radiance, are cut off.
  LightFieldMaps maps(double white) &&;

private:
  // Share of a corner of a triangle in the mean of a sample, for each channel.
  std::span<float> meanShare(size_t triangle, size_t sample, size_t corner);
  // Sum over the corners, of one channel.
  float meanOf(size_t triangle, size_t sample, size_t channel) const;
  void storeMeans(double white);

  LightFieldMaps maps_;
  const Rings& rings_;
  size_t samples_;                // of a triangle
  std::vector<float> meanShares_; // [triangle][sample][corner][channel]; empty for NMF
};

} // namespace surflect::lfm
