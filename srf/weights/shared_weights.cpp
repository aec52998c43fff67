#include "srf/weights/shared_weights.h"

#include "srf/reflectance/correction.h"
#include "srf/weights/fades.h"

#include <algorithm>

namespace surflect::weights {

namespace {

using reflectance::PredictedReflectance, reflectance::SurfelSpace;

// The additional nugget, before the factor 1 - M.
float distrust(const PredictedReflectance& prediction, float cosView, float white) {
  constexpr float kBright = 2, kHalfBright = 0.3f, kGrazing = 0.1f, kGrazingCosine = 0.3f, kLeast = 1e-3f;
  const auto slope = [=](float cosine) { return std::clamp(cosine / kGrazingCosine, kLeast, 1.f); };
  const float mean = (prediction.value.r + prediction.value.g + prediction.value.b) / 3;
  return kBright * mean / (mean + kHalfBright * white) +
         kGrazing * (1 / (slope(prediction.cosine) * slope(cosView)) - 1);
}

} // namespace

void SharedWeights::moveTo(uint32_t surfel) {
  surfel_ = surfel;
  const reflectance::SharedReflectance& shared = *field_.shared;
  const reflectance::SurfelFrame frame(rotationOf<float>(field_.cloud.r0[surfel]));
  surfelFromAcquisition_ = Rotation<SurfelSpace, AcquisitionSpace, float>(
      shared.frameOf(surfel, frame).matrix().transpose());
  trust_ = 0;
  const reflectance::TableMixture& mixture = shared.mixtures[surfel];
  for (size_t m = 0; m < reflectance::kMixedTables; ++m)
    trust_ += mixture.weight[m] * shared.trust[mixture.table[m]];
}

float SharedWeights::shareOf(const Direction3<AcquisitionSpace>& towardsView,
                             const RequestedLight& asked) const {
  constexpr double kGrazing = 0.2;
  const auto lit = asked.reached
                       ? *asked.reached
                       : static_cast<float>(terminatorFade(surfelFromAcquisition_(asked.towards).z()));
  return trust_ * lit * static_cast<float>(smoothStep(0, kGrazing, surfelFromAcquisition_(towardsView).z()));
}

SharedBlend SharedWeights::blend(const Direction3<AcquisitionSpace>& towardsView,
                                 const Direction3<AcquisitionSpace>& towardsLight,
                                 std::span<const LitPhotograph> nearest) const {
  constexpr size_t kMost = kMaxBlended + 1; // the request is the last
  const size_t count = nearest.size(), all = count + 1;
  std::array<Direction3<SurfelSpace>, kMost> views, lights;
  for (size_t i = 0; i < count; ++i) {
    views[i] = surfelFromAcquisition_(nearest[i].towardsView);
    lights[i] = surfelFromAcquisition_(nearest[i].towardsLight);
  }
  views[count] = surfelFromAcquisition_(towardsView);
  lights[count] = surfelFromAcquisition_(towardsLight);
  std::array<reflectance::TableMixture, kMost> mixtures;
  std::array<Rgb, kMost> ones, values;
  mixtures.fill(field_.shared->mixtures[surfel_]);
  ones.fill({1, 1, 1});
  predictReflectance(field_.shared->tables, std::span(mixtures).first(all), std::span(ones).first(all),
                     std::span(views).first(all), std::span(lights).first(all), std::span(values).first(all));

  const Rgb& gain = field_.shared->gains[surfel_];
  const float white = field_.shared->white;
  std::array<PredictedReflectance, kMost> predictions;
  for (size_t i = 0; i < all; ++i) predictions[i] = {gain * values[i], std::max(0.f, lights[i].z())};
  const PairPlace asked = pairPlace(towardsLight, towardsView, 1, kResidualScales);
  std::array<KrigingSample, kMaxBlended> samples;
  for (size_t i = 0; i < count; ++i) {
    samples[i] = nearest[i].sample;
    samples[i].nugget += (1 - matern52(squaredDistance(samples[i].place, asked))) *
                         distrust(predictions[i], views[i].z(), white);
  }
  SharedBlend blend{simpleKrigingWeights({samples.data(), count}, asked), {}, {}};
  std::array<float, kMaxBlended> factors;
  for (size_t i = 0; i < count; ++i) factors[i] = blend.photographs[i].weight;
  applyCorrection(predictions[count], std::span(predictions).first(count), white,
                  std::span(factors).first(count));
  blend.offset = values[count];
  for (size_t i = 0; i < count; ++i) {
    blend.photographs[i].weight = factors[i];
    blend.predicted[i] = values[i];
    blend.offset = blend.offset + -factors[i] * values[i];
  }
  return blend;
}

} // namespace surflect::weights
