// Answers by reflectance that is shared over the surface: what the tables say (srf/reflectance), corrected by
// the surfel's own photographs (correction.h).
//
//   L / E_q = m (sum_i f_i X_i / E_i + b) + (1 - m) K
//
// Symbols: X_i photographs, E_i and E_q irradiance of their light and of the requested one; f_i, b factors
// and colour of the correction; K answer without tables (InterpolationChoice::otherwise); m share of the
// tables:
//
//   m = (sum of weight * trust over the mixture) s smoothStep(0, 0.2, c_v)
//
// s shadow state of the request, c_v cosine of its viewer. Tables hold lit surfaces only, and are uncertain
// at grazing angles. Trust is that of a table, so that a surfel follows its kind.
//
// Nugget of a photograph at place x_i, for a request at x, in addition to nuggetOf (kriging.h):
//
//   (1 - M(|x_i - x|)) (2 u / (u + 0.3 white) + 0.1 (1 / (min(1, c_l / 0.3) min(1, c_v / 0.3)) - 1))
//
// Symbols: u mean of its prediction's channels; c_l, c_v its cosines. Bright and grazing photographs are
// trusted less, but not where the request meets a photograph, which then answers alone (epipole consistency).
#pragma once

#include "srf/reflectance/reflectance_table.h"
#include "srf/weights/kriging.h"
#include "srf/weights/reciprocity.h"
#include "srf/weights/reflectance_field.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace surflect::weights {

// Scales of residuals. All photographs are lit: the shadow state has no effect.
inline constexpr KrigingScales kResidualScales{.half = 0.4f, .light = 0.5f, .view = 0.5f, .shadow = 1};

// Light of a query, for which photographs are blended.
struct RequestedLight {
  Direction3<AcquisitionSpace> towards;
  std::optional<float> reached; // shadow state; empty: states are not used

  float state() const { return reached.value_or(1); }
};

// A lit photograph: its sample for kriging with kResidualScales, and its unit directions.
struct LitPhotograph {
  KrigingSample sample; // index is the number of a pair
  Direction3<AcquisitionSpace> towardsView, towardsLight;
};

// Answer of tables and photographs, without the factor m.
struct SharedBlend {
  BlendSet photographs; // weight is f_i
  // Predictions of these photographs, and b, both without the surfel's gain.
  std::array<Rgb, kMaxBlended> predicted;
  Rgb offset;
};

// A request whose photographs are not yet weighted: what the tables predict.
struct PredictedRequest {
  size_t number = 0;                          // in the batch
  size_t count = 0;                           // of photographs; the request comes after them
  std::array<Rgb, kMaxBlended + 1> values;    // without gain
  std::array<float, kMaxBlended + 1> cosines; // of lights, not below 0
  Rgb gain;
};

// A surfel as its tables see it.
struct SurfelOfTables {
  float trust = 0; // sum of weight * trust over the mixture
  Rotation<reflectance::SurfelSpace, AcquisitionSpace, float> surfelFromAcquisition;

  // Fade of tables by the cosine of a view to their frame, 0..1: 0 along the surface
  static float viewFade(float cosine);
  // m of a lit surfel
  float shareOf(const Direction3<AcquisitionSpace>& towardsView) const;
};
SurfelOfTables surfelOfTables(const ReflectanceField& field, uint32_t surfel);

// Computes shared blends at one surfel after another.
class SharedWeights {
public:
  // The field, which has tables, must outlive this.
  explicit SharedWeights(const ReflectanceField& field) : field_(field) {}

  void moveTo(uint32_t surfel);

  // m
  float shareOf(const Direction3<AcquisitionSpace>& towardsView, const RequestedLight& asked) const;

  // Begins a request in a batch, with the nearest photographs as its samples, at most kMaxBlended.
  PredictedRequest ask(const Direction3<AcquisitionSpace>& towardsView,
                       const Direction3<AcquisitionSpace>& towardsLight,
                       std::span<const LitPhotograph> nearest, KrigingBatch& batch) const;
  // Blend of a request, once solveSimple has weighted its photographs; predictions alone if there are none.
  SharedBlend blendOf(const PredictedRequest& request, const KrigingBatch& batch) const;

private:
  const ReflectanceField& field_;
  uint32_t surfel_ = 0;
  SurfelOfTables own_;
};

} // namespace surflect::weights
