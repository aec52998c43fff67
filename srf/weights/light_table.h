// Blending weights of captured lights, tabulated over all directions, for rigs of directional lights. Their
// ULR weights do not depend on the surfel, and an environment needs hundreds of directions per surfel.
#pragma once

#include "srf/weights/environment_map.h"
#include "srf/weights/irradiance_ratio.h"
#include "srf/weights/light_blend.h"
#include "srf/weights/nearest_kernels.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::weights {

// Surface normal, and the cosine of each captured light to it.
struct Foreshortened {
  Normal3<AcquisitionSpace> normal;
  std::span<const float> cosines;
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
  // b before foreshortening.
  void spread(const EnvironmentDirections& environment,
              const Rotation<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment,
              std::span<Eigen::Array4f> row, const Foreshortened* surface = nullptr) const;

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
