#include "render/lightfield/lfm/map_drawing.h"

#include "render/lightfield/lfm/edge_corrections.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/s3tc.h"
#include "render/lightfield/lfm/tile.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace surflect::lfm {

namespace {

size_t dividedUp(size_t a, size_t b) { return (a + b - 1) / b; }

} // namespace

Tiling::Place Tiling::placeOf(size_t tileNumber) const {
  const auto n = static_cast<int>(tileNumber), inLayer = columns * rows;
  const int within = n % inLayer;
  return {within % columns * tile.width, within / columns * tile.height, n / inLayer};
}

Tiling tilingOf(const TileShape& tile, size_t tiles, const TilingLimits& limits) {
  Tiling tiling{tile};
  if (tiles == 0) return tiling;
  for (int side = limits.side;; side *= 2) {
    side = std::min(side, limits.largestSide);
    const int columns = std::max(1, side / tile.width), rows = std::max(1, side / tile.height);
    const size_t layers = dividedUp(tiles, static_cast<size_t>(columns) * static_cast<size_t>(rows));
    if (layers > static_cast<size_t>(limits.layers)) {
      if (side == limits.largestSide)
        throw Error(std::to_string(tiles) + " tiles of " + std::to_string(tile.width) + " x " +
                    std::to_string(tile.height) + " texels do not fit into a texture");
      continue;
    }
    // Near squares that hold an equal share each.
    const size_t share = dividedUp(tiles, layers);
    const double across = std::sqrt(static_cast<double>(share) * tile.height / tile.width);
    tiling.columns = std::clamp(static_cast<int>(std::ceil(across)), 1, columns);
    tiling.rows = static_cast<int>(dividedUp(share, static_cast<size_t>(tiling.columns)));
    if (tiling.rows > rows) {
      tiling.columns = columns;
      tiling.rows = static_cast<int>(dividedUp(share, static_cast<size_t>(columns)));
    }
    tiling.layers = static_cast<int>(layers);
    return tiling;
  }
}

namespace {

using Sets = std::vector<const MapSet*>;

Coding codingOf(const Sets& sets) { return sets.empty() ? Coding::bytes : sets.front()->coding; }

// First tile of each set, when all are counted together; and the number of all.
std::vector<size_t> firstTiles(const Sets& sets, const MapShape& shape) {
  std::vector<size_t> first{0};
  for (const MapSet* set : sets) first.push_back(first.back() + tilesOf(shape, codingOf(sets), set->count));
  return first;
}

Tiling tilingOf(const Sets& sets, const MapShape& shape, const gl::Limits& limits) {
  return tilingOf(tileShapeOf(shape, codingOf(sets)), firstTiles(sets, shape).back(),
                  {.side = std::min(2048, limits.textureSize),
                   .layers = std::min(256, limits.arrayLayers),
                   .largestSide = limits.textureSize});
}

gl::Format formatOf(Coding coding, bool isSigned) {
  if (coding == Coding::dxt1) return gl::Format::dxt1;
  if (coding == Coding::dxt5) return gl::Format::dxt5;
  return isSigned ? gl::Format::rgba8s : gl::Format::rgba8;
}

// Rows of texels, or of blocks, of a tile.
struct TileRows {
  std::vector<uint8_t> bytes;
  size_t rowBytes = 0, rows = 0;
};

TileRows rowsOf(const MapSet& set, const MapShape& shape, size_t tile) {
  const TileShape tileShape = tileShapeOf(shape, set.coding);
  if (set.coding == Coding::bytes)
    return {tileTexels(shape, set, tile), 4 * static_cast<size_t>(tileShape.width),
            static_cast<size_t>(tileShape.height)};
  const size_t bytes = bytesOf(shape, set.coding, 1);
  const auto blocks = std::span(set.data).subspan(tile * bytes, bytes);
  return {{blocks.begin(), blocks.end()},
          blockBytes(set.coding == Coding::dxt5 ? Blocks::dxt5 : Blocks::dxt1) *
              static_cast<size_t>(tileShape.width / kBlockSide),
          static_cast<size_t>(tileShape.height / kBlockSide)};
}

gl::Texture textureOf(const Sets& sets, const MapShape& shape, bool isSigned, const gl::Limits& limits) {
  const Tiling tiling = tilingOf(sets, shape, limits);
  const gl::Format format = formatOf(codingOf(sets), isSigned);
  gl::Texture texture({format, tiling.width(), tiling.height(), tiling.layers});
  std::vector<std::byte> layer(gl::bytesOf(format, tiling.width(), tiling.height()));
  int current = 0;
  const auto upload = [&] {
    texture.upload(layer, tiling.width(), tiling.height(), {.layer = current});
    std::ranges::fill(layer, std::byte{0});
  };
  const std::vector<size_t> first = firstTiles(sets, shape);
  for (size_t s = 0; s < sets.size(); ++s)
    for (size_t tile = first[s]; tile < first[s + 1]; ++tile) {
      const Tiling::Place place = tiling.placeOf(tile);
      if (place.layer != current) upload(), current = place.layer;
      const TileRows rows = rowsOf(*sets[s], shape, tile - first[s]);
      const auto column = static_cast<size_t>(place.x / tiling.tile.width);
      const auto row = static_cast<size_t>(place.y / tiling.tile.height) * rows.rows;
      const size_t stride = static_cast<size_t>(tiling.columns) * rows.rowBytes;
      for (size_t y = 0; y < rows.rows; ++y)
        std::ranges::copy(std::as_bytes(std::span(rows.bytes)).subspan(y * rows.rowBytes, rows.rowBytes),
                          &layer[(row + y) * stride + column * rows.rowBytes]);
    }
  upload();
  return texture;
}

Sets surfaceSets(const LightFieldMaps& maps) {
  Sets sets;
  for (const Term& term : maps.terms) sets.push_back(&term.surface.maps);
  return sets;
}

Sets viewSets(const LightFieldMaps& maps) {
  Sets sets;
  for (const Term& term : maps.terms) sets.push_back(&term.view.maps);
  return sets;
}

using PlaceTexel = std::array<float, 4>;

// Texel of MapTextures::places() for a map; the code, or scale, is 0 where there is none.
PlaceTexel placeTexel(const Tiling& tiling, const MapShape& shape, size_t firstTile, uint32_t map) {
  if (map == kNoMap) return {0, 0, 0, 0};
  const TilePlace within = placeOf(shape, map);
  const Tiling::Place place = tiling.placeOf(firstTile + within.tile);
  return {static_cast<float>(place.x + within.x), static_cast<float>(place.y + within.y),
          static_cast<float>(place.layer), static_cast<float>(within.step * (1 + within.channel))};
}

gl::Texture placesOf(const LightFieldMaps& maps, const gl::Limits& limits) {
  const Sets surfaces = surfaceSets(maps), views = viewSets(maps);
  const MapShape surface = surfaceShape(maps), view = viewShape(maps), mean = meanShape(maps);
  const Tiling surfaceTiling = tilingOf(surfaces, surface, limits),
               viewTiling = tilingOf(views, view, limits),
               meanTiling = tilingOf({&maps.mean.maps}, mean, limits);
  const std::vector<size_t> firstSurface = firstTiles(surfaces, surface), firstView = firstTiles(views, view);
  const bool isPacked = maps.layout == SurfaceLayout::packed;
  std::vector<PlaceTexel> texels;
  for (size_t t = 0; t < maps.mesh.triangles.size(); ++t) {
    texels.push_back(placeTexel(meanTiling, mean, 0, maps.mean.mapOf.empty() ? kNoMap : maps.mean.mapOf[t]));
    for (size_t k = 0; k < maps.terms.size(); ++k) {
      const Term& term = maps.terms[k];
      for (size_t i = 0; i < (isPacked ? 1 : 3); ++i)
        texels.push_back(placeTexel(surfaceTiling, surface, firstSurface[k],
                                    term.surface.mapOf[isPacked ? t : 3 * t + i]));
      for (const uint32_t vertex : maps.mesh.triangles[t]) {
        texels.push_back(placeTexel(viewTiling, view, firstView[k], term.view.mapOf[vertex]));
        texels.back()[3] *= term.scale[vertex];
      }
    }
  }
  const size_t width = MapTextures::kPlacesWidth,
               height = std::max<size_t>(1, (texels.size() + width - 1) / width);
  texels.resize(width * height);
  gl::Texture texture(
      {gl::Format::rgba32f, static_cast<int>(width), static_cast<int>(height), 0, 1, gl::Filter::nearest});
  texture.upload(std::as_bytes(std::span(texels)), static_cast<int>(width), static_cast<int>(height));
  return texture;
}

// Texture of corrections of edges, texel after texel.
gl::Texture edgesTexture(std::span<const int8_t> corrections, gl::Format format) {
  constexpr size_t kSide = 2048;
  const size_t texels = corrections.size() / static_cast<size_t>(gl::channelsOf(format));
  const size_t width = std::clamp<size_t>(texels, 1, kSide);
  const size_t height = std::clamp<size_t>(dividedUp(texels, width), 1, kSide);
  const size_t layers = std::max<size_t>(1, dividedUp(texels, width * height));
  gl::Texture texture({format, static_cast<int>(width), static_cast<int>(height), static_cast<int>(layers), 1,
                       gl::Filter::nearest});
  std::vector<std::byte> layer(gl::bytesOf(format, texture.shape().width, texture.shape().height));
  std::span<const std::byte> rest = std::as_bytes(corrections);
  for (int i = 0; i < texture.shape().layers; ++i) {
    const auto part = rest.first(std::min(rest.size(), layer.size()));
    std::ranges::copy(part, layer.begin());
    texture.upload(layer, texture.shape().width, texture.shape().height, {.layer = i});
    rest = rest.subspan(part.size());
  }
  return texture;
}

size_t sizeOf(const gl::Texture& texture) {
  const gl::TextureShape& shape = texture.shape();
  return gl::bytesOf(shape.format, shape.width, shape.height) *
         static_cast<size_t>(std::max(1, shape.layers));
}

} // namespace

MapTextures::MapTextures(const LightFieldMaps& maps, const gl::Limits& limits)
    : MapTextures(maps, edgeCorrections(maps), limits) {}

MapTextures::MapTextures(const LightFieldMaps& maps, const EdgeCorrections& edges, const gl::Limits& limits)
    : hasSurfaceEdges_(!edges.surface.empty()), hasMeanEdges_(!edges.mean.empty()),
      surface_(textureOf(surfaceSets(maps), surfaceShape(maps), maps.method == Factorization::pca, limits)),
      view_(textureOf(viewSets(maps), viewShape(maps), maps.method == Factorization::pca, limits)),
      mean_(textureOf({&maps.mean.maps}, meanShape(maps), false, limits)), places_(placesOf(maps, limits)),
      surfaceEdges_(edgesTexture(edges.surface, gl::Format::rg8s)),
      meanEdges_(edgesTexture(edges.mean, gl::Format::rgba8s)) {}

size_t MapTextures::layers() const {
  return static_cast<size_t>(surface_.shape().layers + view_.shape().layers + mean_.shape().layers);
}

size_t MapTextures::bytes() const {
  return sizeOf(surface_) + sizeOf(view_) + sizeOf(mean_) + sizeOf(places_) + sizeOf(surfaceEdges_) +
         sizeOf(meanEdges_);
}

namespace {

Vec3<double> middleOfMesh(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  return box.isEmpty() ? Vec3<double>(0, 0, 0) : Vec3<double>(box.center());
}

// Attributes: 0 position; 1 to 3 x axis, 4 to 6 y axis of the frames of the triangle's corners.
gl::VertexArray vertexArrayOf(const LightFieldMaps& maps, const Vec3<double>& middle) {
  std::array<std::vector<Vec3<float>>, 7> values;
  for (const auto& triangle : maps.mesh.triangles)
    for (const uint32_t vertex : triangle) {
      const Vec3<double> p = maps.mesh.positions[vertex].cast<double>().raw() - middle;
      values[0].push_back(p.cast<float>());
      for (size_t corner = 0; corner < 3; ++corner) {
        values[1 + corner].push_back(maps.frames[triangle[corner]].x.cast<float>());
        values[4 + corner].push_back(maps.frames[triangle[corner]].y.cast<float>());
      }
    }
  std::vector<gl::VertexAttribute> attributes;
  for (unsigned location = 0; location < values.size(); ++location)
    attributes.push_back({location, 3, std::as_bytes(std::span(values[location]))});
  return gl::VertexArray(attributes);
}

// Value of the largest correction, 127 steps, of bytes that are not signed.
constexpr float kUnsignedEdge = 127.f / 255;

// Factor and summand that give the value of a texel as OpenGL reads it.
Eigen::Vector2f valueOf(Coding coding, bool isSigned) {
  // 8-bit textures are signed themselves; signed bytes of blocks are stored plus 128.
  return isSigned && coding != Coding::bytes ? Eigen::Vector2f(255.f / 127, -128.f / 127)
                                             : Eigen::Vector2f(1, 0);
}

} // namespace

MapDrawing::MapDrawing(const LightFieldMaps& maps, const gl::Limits& limits)
    : middle_(middleOfMesh(maps.mesh)), boxCentred_(boundsOf(maps.mesh.positions).translated(-middle_)),
      isSigned_(maps.method == Factorization::pca), hasMean_(maps.mean.maps.count > 0),
      isPacked_(maps.layout == SurfaceLayout::packed), terms_(maps.terms.size()), samples_(maps.samples),
      viewSize_(maps.viewSize), meanWhite_(maps.meanWhite),
      surfaceCoding_(terms_ ? maps.terms[0].surface.maps.coding : Coding::bytes),
      viewCoding_(terms_ ? maps.terms[0].view.maps.coding : Coding::bytes), textures_(maps, limits),
      mesh_(vertexArrayOf(maps, middle_)) {}

std::array<const gl::Texture*, 6> MapDrawing::textures() const {
  return {&textures_.surface(), &textures_.view(),         &textures_.mean(),
          &textures_.places(),  &textures_.surfaceEdges(), &textures_.meanEdges()};
}

Eigen::Isometry3d MapDrawing::cameraFromCentred(const capture::Camera<AcquisitionSpace>& camera) const {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = camera.cameraFromWorld.rotation();
  isometry.translation() = camera.cameraFromWorld.translation();
  return isometry * Eigen::Translation3d(middle_);
}

gl::DepthRange MapDrawing::depthRange(const capture::Camera<AcquisitionSpace>& camera) const {
  return boxCentred_.isEmpty() ? gl::DepthRange{}
                               : gl::depthRangeOf(boxCentred_.transformed(cameraFromCentred(camera)));
}

void MapDrawing::setPosition(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera,
                             const gl::DepthRange& range) const {
  const Eigen::Matrix4d clipFromCamera = gl::clipFromCamera(camera.lens, range);
  program.set("clipFromCentred",
              Eigen::Matrix4f((clipFromCamera * cameraFromCentred(camera).matrix()).cast<float>()));
}

void MapDrawing::setViewer(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera) const {
  program.set("viewerCentred", Eigen::Vector3f((camera.center().raw() - middle_).cast<float>()));
}

void MapDrawing::setMaps(gl::Program& program) const {
  program.set("samples", samples_);
  program.set("viewSize", static_cast<float>(viewSize_));
  program.set("isPacked", isPacked_ ? 1 : 0);
  program.set("surfaceValue", valueOf(surfaceCoding_, isSigned_));
  program.set("viewValue", valueOf(viewCoding_, isSigned_));
  program.set("meanWhite", meanWhite_);
  program.set("surfaceEdgeCorners", textures_.hasSurfaceEdges() ? 3 : 0);
  program.set("meanEdgeCorners", textures_.hasMeanEdges() ? 3 : 0);
  program.set("surfaceEdgeUnit", isSigned_ ? 1.f : kUnsignedEdge);
  program.set("meanEdgeUnit", kUnsignedEdge);
  program.set("termCount", static_cast<int>(terms_));
}

void MapDrawing::setTerms(gl::Program& program, const TermRange& range) {
  program.set("withMean", range.withMean ? 1 : 0);
  program.set("firstTerm", static_cast<int>(range.first));
  program.set("endTerm", static_cast<int>(range.end));
}

} // namespace surflect::lfm
