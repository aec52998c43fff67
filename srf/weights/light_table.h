// Blending weights of captured lights, tabulated over all directions, for rigs of directional lights. Their
// ULR weights do not depend on the surfel, and an environment needs hundreds of directions per surfel.
#pragma once

#include "srf/weights/environment_map.h"
#include "srf/weights/irradiance_ratio.h"
#include "srf/weights/light_blend.h"
#include "srf/weights/nearest_kernels.h"
#include "surfel/base/memory.h"
#include "surfel/math/rgb.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::weights {

// Light rows: captured lights with their weights, by which the photographs of one camera are blended.

// Weight of a captured light, given by its column.
struct LightWeight {
  uint32_t light;
  float weight;
};

// Colour of a light, and the captured lights blended for it: a range of weights.
struct BlendedLight {
  Rgb color;
  uint32_t begin = 0, end = 0;
};

// Light rows of surfels: a row is a range of `lights`. Captured lights are blended before they are coloured:
// n captured lights cost n + 3 products for each term of a block, and would cost 4 n if each had its own
// colour.
struct LightRows {
  std::vector<BlendedLight> lights;
  UninitializedVector<LightWeight> weights; // by light, in order

  void clear() {
    lights.clear();
    weights.clear();
  }
  // Appends a captured light with its own colour.
  void add(uint32_t light, Rgb color) {
    const auto begin = static_cast<uint32_t>(weights.size());
    weights.push_back({light, 1});
    lights.push_back({color, begin, begin + 1});
  }
  // Weights of the row [begin, end).
  std::span<const LightWeight> weightsOf(size_t begin, size_t end) const {
    if (begin == end) return {};
    return {weights.data() + lights[begin].begin, weights.data() + lights[end - 1].end};
  }
};

// Surface normal, and the cosine of each captured light to it.
struct Foreshortened {
  Normal3<AcquisitionSpace> normal;
  std::span<const float> cosines;
};

// Parts of an environment's lights that reach a surfel (ReachedPart): cosines and shadow states of the
// captured lights, and the parts (#lights of the environment), which are written.
struct ReachedParts {
  std::span<const float> cosines, states;
  std::span<float> parts;
};

// Lights of an environment, with directions also as arrays for vector instructions.
class EnvironmentDirections {
public:
  EnvironmentDirections(std::span<const EnvironmentLight> lights); // lights must outlive this

private:
  friend class LightTable;
  std::span<const EnvironmentLight> lights_;
  std::vector<float> towards_; // in groups of 16 lights: x of all, y of all, z of all
};

class LightTable {
public:
  // Tabulates blendOfLights for captured lights at unit directions `lights`. The octahedral grid has about 54
  // cells between neighbouring lights and at most 512 x 512 cells; a cell takes 80 bytes for every four
  // lights with weight at a corner.
  LightTable(std::span<const Direction3<AcquisitionSpace, double>> lights, const LightBlend& how,
             LightExtrapolation extrapolation);

  // Adds to row[l] the part (r, g, b) of an environment's irradiance that captured light l represents; #row =
  // #captured lights. The weights are those of blendOfLights, interpolated and continuous in the rotation,
  // times the foreshortening of irradiance_ratio.h if foreshortened. The fourth number of an entry is r + g +
  // b before foreshortening. Writes the parts that reach a surfel if asked for.
  void spread(const EnvironmentDirections& environment,
              const Rotation<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment,
              std::span<Eigen::Array4f> row, const Foreshortened* surface = nullptr,
              const ReachedParts* reached = nullptr) const;

private:
  // Weights of four captured lights at the corners (0,0), (1,0), (0,1), (1,1) of a cell; unused lights have
  // weight 0.
  struct Shares {
    alignas(16) std::array<std::array<float, 4>, 4> atCorner{};
    std::array<uint32_t, 4> light{};
  };
  size_t cells_ = 0;            // along a side of the octahedral square
  std::vector<uint32_t> first_; // first entry in shares_ of each cell, row by row; then the end
  std::vector<Shares> shares_;
};

} // namespace surflect::weights
