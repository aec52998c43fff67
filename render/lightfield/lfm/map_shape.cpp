#include "render/lightfield/lfm/map_shape.h"

#include "render/lightfield/lfm/patch_blend.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace surflect::lfm {

namespace {

MapTable emptyTable(size_t users, const MapShape& shape) {
  MapTable table;
  table.maps.count = users;
  table.maps.data.resize(users * shape.bytes());
  table.mapOf.resize(users);
  std::iota(table.mapOf.begin(), table.mapOf.end(), 0u);
  return table;
}

} // namespace

LightFieldMaps emptyMaps(TriangleMesh mesh, std::vector<VertexFrame> frames, Method method, int samples,
                         int viewSize, size_t terms) {
  assert(frames.size() == mesh.positions.size());
  LightFieldMaps maps;
  maps.mesh = std::move(mesh);
  maps.frames = std::move(frames);
  maps.method = method;
  maps.samples = samples;
  maps.viewSize = viewSize;
  const size_t vertices = maps.mesh.positions.size(), triangles = maps.mesh.triangles.size();
  for (size_t k = 0; k < terms; ++k)
    maps.terms.push_back({emptyTable(triangles, surfaceShape(maps)), emptyTable(vertices, viewShape(maps)),
                          std::vector<float>(vertices, 0)});
  maps.mean = emptyTable(method == Method::pca ? triangles : 0, meanShape(maps));
  return maps;
}

MapTable scalarTable(const MapTable& packed, int samples) {
  assert(packed.maps.coding == Coding::bytes);
  const PatchGrid grid(samples);
  const size_t count = grid.samples();
  MapTable table{{Coding::bytes, 3 * packed.maps.count, std::vector<uint8_t>(packed.maps.data.size())}, {}};
  for (size_t corner = 0; corner < 3; ++corner)
    for (size_t sample = 0; sample < count; ++sample) {
      const size_t to = grid.index(turned(samples, grid.place(sample), corner));
      for (size_t map = 0; map < packed.maps.count; ++map)
        table.maps.data[(3 * map + corner) * count + to] =
            packed.maps.data[3 * (map * count + sample) + corner];
    }
  for (const uint32_t map : packed.mapOf)
    for (uint32_t corner = 0; corner < 3; ++corner)
      table.mapOf.push_back(map == kNoMap ? kNoMap : 3 * map + corner);
  return table;
}

} // namespace surflect::lfm
