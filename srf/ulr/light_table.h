// The captured lights that answer for a direction, tabulated over all directions, for rigs whose lights are
// directional: there ULR weights do not depend on the surfel, and an environment asks for hundreds of
// directions per surfel.
#pragma once

#include "srf/ulr/environment_map.h"
#include "srf/ulr/foreshortening.h"
#include "srf/ulr/light_blend.h"
#include "srf/ulr/nearest_kernels.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::ulr {

// A surface by which light is foreshortened: its normal, and the cosine of each captured light to it.
struct Foreshortened {
  Normal3<AcquisitionSpace> normal;
  std::span<const float> cosines;
};

// The lights of an environment, their directions also as arrays for vector instructions.
class EnvironmentDirections {
public:
  EnvironmentDirections(std::span<const EnvironmentLight> lights); // which must outlive this

private:
  friend class LightTable;
  std::span<const EnvironmentLight> lights_;
  std::vector<float> towards_; // x of 16 lights, their y, their z, and so on
};

class LightTable {
public:
  // blendOfLights of these (unit directions). A grid about 54 times finer than the lights are dense, of at
  // most 512 x 512 cells of 80 bytes for each four lights that have weight at a corner.
  LightTable(std::span<const Direction3<AcquisitionSpace, double>> lights, const LightBlend& how,
             LightExtrapolation extrapolation);

  // row[l] += the irradiance (r, g, b) that captured light l takes over from an environment; a row has one
  // entry per captured light. The weights behind it are continuous in the turn and those of
  // blendOfLights; where they are foreshortened, times the ratio of foreshortening.h. The fourth number is
  // r + g + b as it is before that.
  void spread(const EnvironmentDirections& environment,
              const Rotation<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment,
              std::span<Eigen::Array4f> row, const Foreshortened* surface = nullptr) const;

private:
  // Weights of four captured lights at the corners (0,0), (1,0), (0,1), (1,1) of a cell; 0 where it has fewer
  // lights.
  struct Shares {
    alignas(16) std::array<std::array<float, 4>, 4> atCorner{};
    std::array<uint32_t, 4> light{};
  };
  size_t cells_ = 0;            // along a side of the octahedral square
  std::vector<uint32_t> first_; // per cell, row by row: its first entry of shares_; then the end
  std::vector<Shares> shares_;
};

} // namespace surflect::ulr
