// A surface light field with a closed form, of any size: a bumpy sphere, cut into cells of a cube's faces,
// with a matte pattern and highlights under three lights.
#pragma once

#include "render/lightfield/slf/field.h"

#include <array>
#include <cstddef>
#include <vector>

namespace surflect::bench {

struct SyntheticOptions {
  int cells = 2;        // along an edge of the cube: 6 cells^2 regions
  int quads = 8;        // along an edge of a region: 2 quads^2 triangles
  int texels = 16;      // along an edge of a texture, at least 2
  int subdivisions = 1; // of the octahedron of directions
  double bump = 0.15;   // height of the bumps over a sphere of radius 1
  Vec3<double> middle = {0, 0, 0};
};

slf::Field syntheticField(const SyntheticOptions& options = {});

// Textures of a syntheticField() with the same options, in memory. Texels are observed in directions in front
// of the surface.
class SyntheticTextures : public slf::Textures {
public:
  SyntheticTextures(const slf::Field& field, const SyntheticOptions& options);
  std::vector<slf::Texel> read(size_t region, size_t direction) const override {
    return texels_[region][direction];
  }

private:
  std::vector<std::vector<std::vector<slf::Texel>>> texels_; // by region, by direction
};

// One value for all texels of a field.
class ConstantTextures : public slf::Textures {
public:
  ConstantTextures(const slf::Field& field, const std::array<float, 4>& value);
  std::vector<slf::Texel> read(size_t region, size_t direction) const override;

private:
  const slf::Field* field_;
  slf::Texel texel_{};
};

} // namespace surflect::bench
