#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/lfm/tile.h"
#include "tests/fuzz/fuzz.h"

#include <span>

// The maps of two triangles; the first byte says whether they have four channels.
void surflect::fuzz_light_field_maps(std::string_view input) {
  if (input.empty()) return;
  TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair{0.f, 0.f}, {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
    mesh.positions.emplace_back(x, y, 0.f);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const lfm::LightFieldMaps maps = lfm::parseMaps(std::as_bytes(std::span(input.substr(1))), mesh,
                                                  input[0] == '4' ? size_t{4} : size_t{3});
  const lfm::LightFieldMaps plain = lfm::decoded(maps);
  for (size_t triangle = 0; triangle < 2; ++triangle)
    if (!lfm::radianceAt(plain, {triangle, 0.2, 0.3}, {0, 0, 1}, plain.terms.size()).allFinite())
      __builtin_trap();
}
