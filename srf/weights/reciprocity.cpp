#include "srf/weights/reciprocity.h"

#include "srf/weights/fades.h"

namespace surflect::weights {

bool isReciprocal(const ReflectanceField& field, const ShadeOptions& options) {
  return usesKriging(field, options) && options.reciprocal.value_or(field.interpolation.reciprocal) &&
         lightBlend(field, options).foreshortened;
}

float exchangedConfidence(float cosine, float reached, std::optional<float> requested) {
  return (requested ? *requested * reached : 1) * static_cast<float>(grazingFade(cosine));
}

float exchangedConfidence(const RigAtSurfel& rig, uint32_t light, std::optional<float> requested) {
  return exchangedConfidence(rig.cosine(rig.lights().towards(light)), requested ? rig.reachedBy(light) : 1,
                             requested);
}

ExchangedPairs::ExchangedPairs(const ReflectanceField& field, const QueryBatch& batch)
    : field_(field), batch_(batch), viewsNearLight_(batch.lights) {
  const std::vector<Source> views = sourcesOf(viewpointsOf(field.rig.views));
  for (size_t l = 0; l < batch.lights; ++l) nearestViews_.emplace_back(views, field.visibility);
}

void ExchangedPairs::prepare(size_t begin, size_t count, NearestLights& lights) {
  const auto places = batch_.placesAt(field_.cloud, begin, count);
  for (size_t l = 0; l < batch_.lights; ++l)
    viewsNearLight_[l] =
        &nearestViews_[l].blend({batch_.surfels.data() + begin, count}, {places.data(), count},
                                {batch_.towardsLightAt(l, begin, count).data(), count}, kNearSources);
  lights.blend({batch_.towardsView.data() + begin, count}, kNearSources, lightsNearViewer_);
}

NearPairs ExchangedPairs::near(size_t lane, size_t l, std::optional<float> requested,
                               const RigAtSurfel& rig) const {
  NearPairs pairs{.isExchanged = true};
  if (!lightsNearViewer_.isPrecise(lane) || !viewsNearLight_[l]->isPrecise(lane)) return pairs;
  forEachNear(lightsNearViewer_.candidates(lane), [&](uint32_t light, float, float nearness) {
    pairs.viewers.add(light, rig.lights().towards(light),
                      nearness * exchangedConfidence(rig, light, requested));
  });
  forEachNear(viewsNearLight_[l]->candidates(lane), [&](uint32_t view, float, float nearness) {
    pairs.lights.add(view, rig.towardsView(view), nearness * rig.seenBy(view));
  });
  return pairs;
}

} // namespace surflect::weights
