// An opacity light field in memory, with painted views: each view has waves of colour and alpha of its own.
#pragma once

#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/s3tc.h"
#include "render/lightfield/olf/opacity_field.h"
#include "render/lightfield/olf/packing.h"
#include "srf/image/half_float.h"
#include "tests/render/lightfield/common/bumpy_sphere.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace surflect::olf {

// Spheres that intersect, along a diagonal: up to as many layers.
inline TriangleMesh rowOfSpheres(int count, int slices = 12) {
  TriangleMesh row;
  const TriangleMesh sphere = lightfield::bumpySphere(0, slices);
  for (int k = 0; k < count; ++k) {
    const auto shift = static_cast<uint32_t>(row.positions.size());
    const float along = 0.28f * (static_cast<float>(k) - static_cast<float>(count - 1) / 2);
    for (const auto& p : sphere.positions)
      row.positions.emplace_back(0.4f * p.raw()[0] + along, 0.4f * p.raw()[1] + 0.9f * along,
                                 0.4f * p.raw()[2] + 0.8f * along);
    for (const auto& [a, b, c] : sphere.triangles) row.triangles.push_back({a + shift, b + shift, c + shift});
  }
  return row;
}

inline float painted(size_t view, int x, int y, size_t channel) {
  const double wave = std::sin(0.31 * x + static_cast<double>(view) + static_cast<double>(channel)) *
                      std::cos(0.23 * y - 0.7 * static_cast<double>(view * channel));
  return static_cast<float>(0.5 + 0.4 * wave);
}

// Views around the object; those that face all triangles around a vertex are its visible views.
inline OpacityField paintedField(TriangleMesh mesh, int views, int size, Blending method,
                                 Domain domain = Domain::sphere) {
  OpacityField field;
  field.method = method, field.domain = domain;
  field.mesh = std::move(mesh);
  field.packed.width = field.packed.height = size;
  for (const Vec3<double>& direction : studio::spiral(views)) {
    field.cameras.push_back(studio::cameraFrom<AcquisitionSpace>(direction, size));
    field.packed.views.push_back({{0, 0}, {1, 1}, size, size});
    const size_t view = field.cameras.size() - 1;
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) {
        const float alpha = painted(view, x, y, 3);
        Texel texel{};
        for (size_t c = 0; c < 3; ++c) texel[c] = image::nearestHalf(alpha * painted(view, x, y, c));
        texel[3] = image::nearestHalf(alpha);
        field.packed.texels.push_back(texel);
      }
  }
  const lfm::Rings rings(field.mesh);
  field.visible.first.push_back(0);
  for (uint32_t vertex = 0; vertex < field.mesh.positions.size(); ++vertex) {
    for (uint32_t view = 0; view < field.cameras.size(); ++view) {
      bool faces = !rings.around(vertex).empty();
      for (const lfm::RingTriangle& around : rings.around(vertex)) {
        const Vec3<double> corner =
            field.mesh.positions[field.mesh.triangles[around.triangle][0]].cast<double>().raw();
        faces &= areaVector(field.mesh, around.triangle).dot(field.cameras[view].center().raw() - corner) > 0;
      }
      if (faces) field.visible.views.push_back(view);
    }
    field.visible.first.push_back(static_cast<uint32_t>(field.visible.views.size()));
  }
  return field;
}

// Views of half floats as blocks.
inline PackedViews withBlocks(const PackedViews& packed) {
  PackedViews result{lfm::wholeBlocks(packed.width), lfm::wholeBlocks(packed.height), packed.views, {}, {}};
  const auto width = static_cast<size_t>(packed.width), height = static_cast<size_t>(packed.height);
  for (size_t view = 0; view < packed.views.size(); ++view) {
    std::vector<Texel> layer(result.layerTexels(), Texel{});
    for (size_t y = 0; y < height; ++y)
      for (size_t x = 0; x < width; ++x)
        layer[y * static_cast<size_t>(result.width) + x] = packed.layer(view)[y * width + x];
    const ViewBlocks blocks = viewBlocks(std::move(layer), result.width, result.height);
    result.views[view].white = blocks.white;
    result.blocks.insert(result.blocks.end(), blocks.blocks.begin(), blocks.blocks.end());
  }
  return result;
}

// Pixels at which two pictures differ by more than 1/255 in any channel, as a share of those that either
// covers.
inline double shareThatDiffers(const image::Image& a, const image::Image& b) {
  double differ = 0, covered = 0;
  for (size_t i = 0; i < a.values.size(); i += 4) {
    if (a.values[i + 3] == 0 && b.values[i + 3] == 0) continue;
    ++covered;
    for (size_t c = 0; c < 4; ++c)
      if (!(std::abs(a.values[i + c] - b.values[i + c]) <= 1.f / 255)) {
        ++differ;
        break;
      }
  }
  return covered > 0 ? differ / covered : 0;
}

} // namespace surflect::olf
