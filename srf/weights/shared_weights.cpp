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

SurfelOfTables surfelOfTables(const ReflectanceField& field, uint32_t surfel) {
  const reflectance::SharedReflectance& shared = *field.shared;
  const reflectance::SurfelFrame frame(rotationOf<float>(field.cloud.r0[surfel]));
  SurfelOfTables own{
      0, Rotation<SurfelSpace, AcquisitionSpace, float>(shared.frameOf(surfel, frame).matrix().transpose())};
  const reflectance::TableMixture& mixture = shared.mixtures[surfel];
  for (size_t m = 0; m < reflectance::kMixedTables; ++m)
    own.trust += mixture.weight[m] * shared.trust[mixture.table[m]];
  return own;
}

float SurfelOfTables::viewFade(float cosine) {
  constexpr double kGrazing = 0.2;
  return static_cast<float>(smoothStep(0, kGrazing, cosine));
}

float SurfelOfTables::shareOf(const Direction3<AcquisitionSpace>& towardsView) const {
  return trust * viewFade(surfelFromAcquisition(towardsView).z());
}

void SharedWeights::moveTo(uint32_t surfel) {
  surfel_ = surfel;
  own_ = surfelOfTables(field_, surfel);
}

float SharedWeights::shareOf(const Direction3<AcquisitionSpace>& towardsView,
                             const RequestedLight& asked) const {
  const auto lit = asked.reached
                       ? *asked.reached
                       : static_cast<float>(terminatorFade(own_.surfelFromAcquisition(asked.towards).z()));
  return lit * own_.shareOf(towardsView);
}

PredictedRequest SharedWeights::ask(const Direction3<AcquisitionSpace>& towardsView,
                                    const Direction3<AcquisitionSpace>& towardsLight,
                                    std::span<const LitPhotograph> nearest, KrigingBatch& batch) const {
  constexpr size_t kMost = kMaxBlended + 1;
  const size_t count = nearest.size(), all = count + 1;
  std::array<Direction3<SurfelSpace>, kMost> views, lights;
  for (size_t i = 0; i < count; ++i) {
    views[i] = own_.surfelFromAcquisition(nearest[i].towardsView);
    lights[i] = own_.surfelFromAcquisition(nearest[i].towardsLight);
  }
  views[count] = own_.surfelFromAcquisition(towardsView);
  lights[count] = own_.surfelFromAcquisition(towardsLight);

  const PairPlace asked = pairPlace(towardsLight, towardsView, 1, kResidualScales);
  PredictedRequest request{.number = batch.ask(asked), .count = count, .gain = field_.shared->gains[surfel_]};
  predictReflectance(field_.shared->tables, field_.shared->mixtures[surfel_], std::span(views).first(all),
                     std::span(lights).first(all), std::span(request.values).first(all));
  for (size_t i = 0; i < all; ++i) request.cosines[i] = std::max(0.f, lights[i].z());
  for (size_t i = 0; i < count; ++i) {
    const PredictedReflectance prediction{request.gain * request.values[i], request.cosines[i]};
    KrigingSample sample = nearest[i].sample;
    sample.nugget += (1 - matern52(squaredDistance(sample.place, asked))) *
                     distrust(prediction, views[i].z(), field_.shared->white);
    batch.add(sample);
  }
  return request;
}

SharedBlend SharedWeights::blendOf(const PredictedRequest& request, const KrigingBatch& batch) const {
  const auto predicted = [&](size_t i) -> PredictedReflectance {
    return {request.gain * request.values[i], request.cosines[i]};
  };
  const size_t count = request.count;
  SharedBlend blend{batch.weights(request.number), {}, request.values[count]};
  std::array<PredictedReflectance, kMaxBlended> predictions;
  std::array<float, kMaxBlended> factors;
  for (size_t i = 0; i < count; ++i) {
    predictions[i] = predicted(i);
    factors[i] = blend.photographs[i].weight;
  }
  applyCorrection(predicted(count), std::span(predictions).first(count), field_.shared->white,
                  std::span(factors).first(count));
  for (size_t i = 0; i < count; ++i) {
    blend.photographs[i].weight = factors[i];
    blend.predicted[i] = request.values[i];
    blend.offset = blend.offset + -factors[i] * request.values[i];
  }
  return blend;
}

} // namespace surflect::weights
