#include "render/lightfield/lfm/map_textures.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/s3tc.h"
#include "render/lightfield/lfm/tile.h"
#include "render/lightfield/lfm/tiling.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

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

size_t sizeOf(const gl::Texture& texture) {
  const gl::TextureShape& shape = texture.shape();
  return gl::bytesOf(shape.format, shape.width, shape.height) *
         static_cast<size_t>(std::max(1, shape.layers));
}

} // namespace

MapTextures::MapTextures(const LightFieldMaps& maps, const gl::Limits& limits)
    : surface_(textureOf(surfaceSets(maps), surfaceShape(maps), maps.method == Method::pca, limits)),
      view_(textureOf(viewSets(maps), viewShape(maps), maps.method == Method::pca, limits)),
      mean_(textureOf({&maps.mean.maps}, meanShape(maps), false, limits)), places_(placesOf(maps, limits)) {}

size_t MapTextures::layers() const {
  return static_cast<size_t>(surface_.shape().layers + view_.shape().layers + mean_.shape().layers);
}

size_t MapTextures::bytes() const {
  return sizeOf(surface_) + sizeOf(view_) + sizeOf(mean_) + sizeOf(places_);
}

} // namespace surflect::lfm
