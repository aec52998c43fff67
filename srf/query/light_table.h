// The captured lights that answer for a direction, tabulated over all directions, for rigs whose lights are
// directional: there ULR weights do not depend on the surfel, and an environment asks for hundreds of
// directions per surfel.
#pragma once

#include "srf/query/light_coverage.h"
#include "surfel/rgb.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

class LightTable {
public:
  // ULR over the `blended` nearest of the lights (unit directions), times their coverage where light beyond
  // it fades. The grid is about 16 times finer than the lights are dense, which errs by less than 1 % of a
  // light's weight. Costs 256 ULR evaluations a light, 30 bytes each.
  LightTable(std::span<const Direction3<AcquisitionSpace, double>> lights, size_t blended,
             Uncovered uncovered);

  // row[light] += weight of the light * irradiance; a row has one entry per light. Continuous in `towards`
  // (unit). The weights are not negative and sum to 1, to the coverage where it fades.
  void spread(const Direction3<AcquisitionSpace>& towards, Rgb irradiance, std::span<Rgb> row) const;

private:
  struct Share {
    uint32_t light;
    float weight;
  };
  Direction3<AcquisitionSpace> vertexDirection(int x, int y) const;

  int cells_ = 0;               // along a side of the octahedral square
  std::vector<uint32_t> first_; // of each vertex's shares, row by row; one more, for the end
  std::vector<Share> shares_;
};

} // namespace surflect
