// Answer of tables (srf/reflectance) for the light of an environment, as a correction of the answer by
// photographs.
//
//   L = K + D,   D = m sum_i f g_i (p_i sum_q E_q V_q R(v, q) - sum_l W_il s_l R(v_i, l))
//
// Symbols: K answer of photographs, sum_il W_il X_il / E_l, with cameras and lights apart or by ULR; W_il
// irradiance that the photograph of view i under captured light l answers for, 0 in channels where the light
// is dark; p_i share of view i in the weights of K; X_il radiance and E_l irradiance of the photograph; E_q
// irradiance of light q of the environment, V_q the part of it that reaches the surfel (irradiance_ratio.h),
// s_l the shadow state of captured light l; R reflectance by the surfel's tables, with gain; v, v_i
// directions to viewer and view; m share of the tables, as for a lit surfel in shared_weights.h; g_i its fade
// for view i. The sum is over views that see the place and show it; f passes the weights of views that do not
// show it to the others, as K does. A view that another part hides shows that part, which is not corrected.
//
// Photographs blur the highlights of an environment by the angles between cameras and lights. The correction
// replaces blurred highlights, as tables know them, by those where they belong. With foreshortening, both
// sums nearly agree for a matte surface, so that D is about 0 there. Without, D also replaces the blended
// cosines. D costs a look-up in the tables for each light, and for each photograph that K blends.
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
  // Adds a view that K blends, with its weight there.
  void addView(uint32_t view, float weight);
  // Takes away a photograph of the view that was added last: W_il.
  void takeAway(uint32_t light, const Rgb& irradiance);
  // Looks up all reflectance; afterwards, nothing may be added.
  void lookUp();

  // How a view of K meets a place: it is outside the picture, in a block of background, or stored.
  enum class Shows { nothing, background, object };
  // D at a place, without the surfel's gain. place: a surfel of the field; showsIn(view): Shows.
  template <class ShowsIn> Rgb correctionAt(uint32_t place, const ShowsIn& showsIn) const {
    float looked = 0, shown = 0; // weights of K before and after views of background are left out
    Rgb sum;
    for (const View& view : views_) {
      const Shows shows = showsIn(view.number);
      if (shows == Shows::nothing) continue;
      looked += view.weight;
      if (shows == Shows::background) continue;
      shown += view.weight;
      if (field_.visibility.of(place)[view.number] > 0)
        sum = sum + view.fade * (view.weight / all_ * lit_ + -1.f * view.taken);
    }
    return shown > 0 ? share_ * looked / shown * sum : Rgb{};
  }

private:
  using SurfelDirection = Direction3<reflectance::SurfelSpace>;

  struct View {
    uint32_t number;
    float weight; // in K
    float fade;   // g_i
    SurfelDirection towards;
    size_t terms;   // end of its terms
    Rgb taken = {}; // sum_l W_il s_l R
  };
  void add(const SurfelDirection& view, const SurfelDirection& light, const Rgb& weight);

  const ReflectanceField& field_;
  RigAtSurfel rig_;
  uint32_t surfel_ = 0;
  float share_ = 0;
  SurfelOfTables own_;
  SurfelDirection towardsView_;
  std::vector<SurfelDirection> captured_; // towards each captured light
  std::vector<View> views_;
  float all_ = 0;       // weight of all views
  size_t litTerms_ = 0; // end of the terms of lights
  Rgb lit_;             // sum_q E_q V_q R
  // Terms of both sums: directions, and weight of R.
  std::vector<SurfelDirection> viewers_, lights_;
  std::vector<Rgb> weights_, reflectance_;
};

} // namespace surflect::weights
