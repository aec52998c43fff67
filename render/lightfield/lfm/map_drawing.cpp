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
#include <utility>
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

// Sets of maps of one shape, and where their tiles are in a texture that holds several such groups.
struct Group {
  MapShape shape;
  std::vector<const MapSet*> sets;
  Coding coding = Coding::bytes;
  Tiling tiling = {};
  int firstLayer = 0;
  std::vector<size_t> firstTile = {}; // of each set, and the number of all

  Group(const MapShape& groupShape, std::vector<const MapSet*> groupSets)
      : shape(groupShape), sets(std::move(groupSets)),
        coding(sets.empty() ? Coding::bytes : sets.front()->coding) {}

  Tiling::Place placeOf(size_t tile) const {
    Tiling::Place place = tiling.placeOf(tile);
    place.layer += firstLayer;
    return place;
  }
};

using Groups = std::vector<Group>;

// Groups with their tilings and layers. All layers of a texture have the side that the largest group needs.
Groups tiled(Groups groups, const gl::Limits& limits) {
  for (Group& group : groups) {
    group.firstTile = {0};
    for (const MapSet* set : group.sets)
      group.firstTile.push_back(group.firstTile.back() + tilesOf(group.shape, group.coding, set->count));
  }
  int side = std::min(2048, limits.textureSize);
  const auto tile = [&](int leastSide) {
    int layers = 0;
    for (Group& group : groups) {
      group.tiling = tilingOf(tileShapeOf(group.shape, group.coding), group.firstTile.back(),
                              {.side = leastSide,
                               .layers = std::min(256, limits.arrayLayers / static_cast<int>(groups.size())),
                               .largestSide = limits.textureSize});
      side = std::max({side, group.tiling.width(), group.tiling.height()});
      group.firstLayer = layers;
      layers += group.tiling.layers;
    }
  };
  tile(side);
  if (const int least = std::min(2048, limits.textureSize); side > least) tile(side);
  return groups;
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

gl::Texture textureOf(const Groups& groups, bool isSigned) {
  const gl::Format format = formatOf(groups.front().coding, isSigned);
  int width = 1, height = 1;
  for (const Group& group : groups)
    width = std::max(width, group.tiling.width()), height = std::max(height, group.tiling.height());
  gl::Texture texture({format, width, height, groups.back().firstLayer + groups.back().tiling.layers});
  std::vector<std::byte> layer(gl::bytesOf(format, width, height));
  int current = 0;
  const auto upload = [&] {
    texture.upload(layer, width, height, {.layer = current});
    std::ranges::fill(layer, std::byte{0});
  };
  for (const Group& group : groups)
    for (size_t s = 0; s < group.sets.size(); ++s)
      for (size_t tile = group.firstTile[s]; tile < group.firstTile[s + 1]; ++tile) {
        const Tiling::Place place = group.placeOf(tile);
        if (place.layer != current) upload(), current = place.layer;
        const TileShape& tileShape = group.tiling.tile;
        const TileRows rows = rowsOf(*group.sets[s], group.shape, tile - group.firstTile[s]);
        const auto column = static_cast<size_t>(place.x / tileShape.width);
        const auto row = static_cast<size_t>(place.y / tileShape.height) * rows.rows;
        const size_t stride =
            rows.rowBytes * static_cast<size_t>(width) / static_cast<size_t>(tileShape.width);
        for (size_t y = 0; y < rows.rows; ++y)
          std::ranges::copy(std::as_bytes(std::span(rows.bytes)).subspan(y * rows.rowBytes, rows.rowBytes),
                            &layer[(row + y) * stride + column * rows.rowBytes]);
      }
  upload();
  return texture;
}

Groups surfaceGroups(const LightFieldMaps& maps, const gl::Limits& limits) {
  std::vector<const MapSet*> sets;
  for (const Term& term : maps.terms) sets.push_back(&term.surface.maps);
  return tiled({Group(surfaceShape(maps), std::move(sets))}, limits);
}

// View maps of all terms, or of the first and of the others if these have another size.
Groups viewGroups(const LightFieldMaps& maps, const gl::Limits& limits) {
  Groups groups;
  for (size_t k = 0; k < maps.terms.size(); ++k) {
    const MapSet* const set = &maps.terms[k].view.maps;
    const MapShape shape = viewShape(maps, k);
    if (groups.empty() || groups.back().shape.size != shape.size)
      groups.emplace_back(shape, std::vector{set});
    else
      groups.back().sets.push_back(set);
  }
  if (groups.empty()) groups.emplace_back(viewShape(maps, 0), std::vector<const MapSet*>());
  return tiled(std::move(groups), limits);
}

Groups meanGroups(const LightFieldMaps& maps, const gl::Limits& limits) {
  return tiled({Group(meanShape(maps), {&maps.mean.maps})}, limits);
}

using PlaceTexel = std::array<float, 4>;

// Texel of MapTextures::places() for a map of a set; the code, or scale, is 0 where there is none.
PlaceTexel placeTexel(const Group& group, size_t set, uint32_t map) {
  if (map == kNoMap) return {0, 0, 0, 0};
  const TilePlace within = placeOf(group.shape, map);
  const Tiling::Place place = group.placeOf(group.firstTile[set] + within.tile);
  return {static_cast<float>(place.x + within.x), static_cast<float>(place.y + within.y),
          static_cast<float>(place.layer), static_cast<float>(within.step * (1 + within.channel))};
}

gl::Texture placesOf(const LightFieldMaps& maps, const gl::Limits& limits) {
  const Groups surfaces = surfaceGroups(maps, limits), views = viewGroups(maps, limits),
               means = meanGroups(maps, limits);
  const auto viewTexel = [&](size_t term,
                             uint32_t map) { // of one group, or of the first term's and the others'
    return views.size() == 1 || term == 0 ? placeTexel(views.front(), term, map)
                                          : placeTexel(views.back(), term - 1, map);
  };
  const bool isPacked = maps.layout == SurfaceLayout::packed;
  std::vector<PlaceTexel> texels;
  for (size_t t = 0; t < maps.mesh.triangles.size(); ++t) {
    texels.push_back(placeTexel(means[0], 0, maps.mean.mapOf.empty() ? kNoMap : maps.mean.mapOf[t]));
    for (size_t k = 0; k < maps.terms.size(); ++k) {
      const Term& term = maps.terms[k];
      for (size_t i = 0; i < (isPacked ? 1 : 3); ++i)
        texels.push_back(placeTexel(surfaces[0], k, term.surface.mapOf[isPacked ? t : 3 * t + i]));
      for (const uint32_t vertex : maps.mesh.triangles[t]) {
        texels.push_back(viewTexel(k, term.view.mapOf[vertex]));
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
      surface_(textureOf(surfaceGroups(maps, limits), maps.method == Factorization::pca)),
      view_(textureOf(viewGroups(maps, limits), maps.method == Factorization::pca)),
      mean_(textureOf(meanGroups(maps, limits), false)), places_(placesOf(maps, limits)),
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
      viewSize_(maps.viewSize), higherViewSize_(maps.higherViewSize), meanWhite_(maps.meanWhite),
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
  program.set("higherViewSize", static_cast<float>(higherViewSize_));
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
