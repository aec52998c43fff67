#include "srf/weights/interpolation.h"

#include "srf/weights/query.h"
#include "srf/weights/reflectance_field.h"

namespace surflect::weights {

Interpolation interpolationOf(const ReflectanceField& field, const ShadeOptions& options) {
  return options.interpolation.value_or(field.interpolation.kind);
}

LightBlend lightBlend(const ReflectanceField& field, const ShadeOptions& options) {
  if (options.nearest) return {1, LightFit::mean};
  const bool isPaper = options.interpolation == Interpolation::paper;
  const LightBlend otherwise = isPaper ? LightBlend{} : field.lightBlend;
  return {options.lights.value_or(otherwise.lights), options.lightFit.value_or(otherwise.fit),
          options.foreshortened.value_or(otherwise.foreshortened), options.weightError};
}

size_t pairCount(const ReflectanceField& field, const ShadeOptions& options) {
  return options.pairs.value_or(interpolationOf(field, options) >= Interpolation::kriging ? 6 : 4);
}

size_t ulrPairCount(const ReflectanceField& field, const ShadeOptions& options) {
  return isSeparateBesideTables(field, options) ? options.pairs.value_or(4) : pairCount(field, options);
}

bool usesKriging(const ReflectanceField& field, const ShadeOptions& options) {
  return !field.rig.lights.empty() && !options.nearest &&
         interpolationOf(field, options) >= Interpolation::kriging;
}

bool usesTables(const ReflectanceField& field, const ShadeOptions& options) {
  return usesKriging(field, options) && interpolationOf(field, options) == Interpolation::shared &&
         field.shared;
}

bool correctsEnvironments(const ReflectanceField& field, const QueryBatch& batch,
                          const ShadeOptions& options) {
  return usesTables(field, options) && !batch.environments.empty();
}

bool usesShadowStates(const ReflectanceField& field, const ShadeOptions& options) {
  return field.lightVisibility && (field.interpolation.shadows || usesTables(field, options));
}

bool isSeparateBesideTables(const ReflectanceField& field, const ShadeOptions& options) {
  const InterpolationChoice& choice = field.interpolation;
  const Interpolation otherwise = choice.kind == Interpolation::shared ? choice.otherwise : choice.kind;
  return usesTables(field, options) && otherwise == Interpolation::separate;
}

bool blendsCorners(const ReflectanceField& field, const ShadeOptions& options) {
  return usesKriging(field, options) && !isSeparateBesideTables(field, options);
}

bool hasSeparateWeights(const ReflectanceField& field, const ShadeOptions& options) {
  return field.rig.lights.empty() || (field.isFullProduct && !usesKriging(field, options));
}

} // namespace surflect::weights
