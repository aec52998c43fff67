// Answer of tables (srf/reflectance) for the light of an environment, as a correction of the answer by
// photographs.
//
//   L = K + D,   D = m (sum_q E_q V_q R(v, q) - sum_il W_il s_l R(v_i, l))
//
// Symbols: K answer of photographs, sum_il W_il X_il / E_l, with cameras and lights apart or by ULR; W_il
// irradiance that the photograph of view i under captured light l answers for, X_il its radiance and E_l its
// irradiance; E_q irradiance of light q of the environment, V_q the part of it that reaches the surfel
// (irradiance_ratio.h), s_l the shadow state of captured light l; R reflectance by the surfel's tables, with
// gain; v, v_i directions to viewer and view; m share of the tables, as for a lit surfel in shared_weights.h.
//
// Photographs blur the highlights of an environment by the angles between cameras and lights. The correction
// replaces blurred highlights, as tables know them, by those where they belong. Where tables know as much as
// the photographs blend right, such as the matte part, both sums are equal. D costs a look-up in the tables
// for each light, and for each photograph that K blends.
#pragma once

#include "srf/weights/reciprocity.h"
#include "srf/weights/shared_weights.h"

#include <cstdint>
#include <vector>

namespace surflect::weights {

// Computes D for one query after another. Has working memory of its own: use one object per thread.
class EnvironmentTables {
public:
  // The field, which has tables, must outlive this.
  explicit EnvironmentTables(const ReflectanceField& field) : field_(field), rig_(field) {}

  // Begins a sum.
  void moveTo(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView);
  // False if m is 0, and D too.
  bool answer() const { return share_ > 0; }
  // Adds a light q: its direction, and E_q V_q.
  void add(const Direction3<AcquisitionSpace>& towardsLight, const Rgb& reaching);
  // Takes away a photograph: W_il.
  void takeAway(uint32_t view, uint32_t light, const Rgb& irradiance);
  // D, without the surfel's gain.
  Rgb correction();

private:
  using SurfelDirection = Direction3<reflectance::SurfelSpace>;

  void add(const SurfelDirection& view, const SurfelDirection& light, const Rgb& weight);

  const ReflectanceField& field_;
  RigAtSurfel rig_;
  uint32_t surfel_ = 0;
  float share_ = 0;
  SurfelOfTables own_;
  SurfelDirection towardsView_;
  // Terms of D: directions, and weight of R.
  std::vector<SurfelDirection> views_, lights_;
  std::vector<Rgb> weights_, reflectance_;
};

} // namespace surflect::weights
