#include "srf/ulr/light_blend.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>

namespace surflect::ulr {

namespace {

// From the weights of the mean to those of a plane, which is worth a share `slope`, 0..1, of what it changes.
// Symbols: l the direction asked for, l_i of the blended lights, w_i their ULR weights,
// c_i = max(1/2, l_i . l), x_i = l_i / c_i - l, m = sum w_i x_i, C = sum w_i (x_i - m)(x_i - m)^T.
//     w'_i = w_i (1 + slope (1 / c_i - 1)) (1 - slope (x_i - m)^T (C + r tr(C) I)^-1 m)  [Lancaster 1981, §3]
// Up to 60 degrees from l, x_i is where the light meets the plane that touches the sphere at l. With slope 1,
// sum w'_i l_i = l but for what the ridge r leaves of m, wherever the lights are. r = 0.1 is ours: 0.03 gives
// matte surfaces up to 0.5 dB more, and turns more steeply where lights lie nearly in a line.
void lean(BlendSet& blend, std::span<const Direction3<AcquisitionSpace>> lights,
          const Direction3<AcquisitionSpace>& towards, double slope) {
  constexpr double kRidge = 0.1, kLeastCosine = 0.5;
  constexpr double kNothing = 1e-30; // a single light spans nothing, and leans nowhere
  const Vec3<double> l = towards.raw().cast<double>().normalized();
  std::array<Vec3<double>, kMaxBlended> x;
  std::array<double, kMaxBlended> scale;
  Vec3<double> m = Vec3<double>::Zero();
  double sum = 0; // 1 but for rounding, which a steep slope would magnify
  for (size_t i = 0; i < blend.size(); ++i) {
    const Vec3<double> light = lights[blend[i].index].raw().cast<double>().normalized();
    const double c = std::max(light.dot(l), kLeastCosine);
    x[i] = light / c - l;
    scale[i] = 1 + slope * (1 / c - 1);
    sum += blend[i].weight;
    m += blend[i].weight * x[i];
  }
  m /= sum;
  Mat3<double> C = Mat3<double>::Zero();
  for (size_t i = 0; i < blend.size(); ++i) C += blend[i].weight * (x[i] - m) * (x[i] - m).transpose();
  C.diagonal().array() += kRidge * C.trace() + kNothing;
  const Vec3<double> lambda = slope * C.ldlt().solve(m);
  for (size_t i = 0; i < blend.size(); ++i)
    blend[i].weight = static_cast<float>(blend[i].weight * scale[i] * (1 - lambda.dot(x[i] - m)));
}

// To a sum of 1.
void normalize(BlendSet& blend) {
  float sum = 0;
  for (const Blended& blended : blend) sum += blended.weight;
  for (Blended& blended : blend) blended.weight /= sum;
}

} // namespace

BlendSet blendOfLights(std::span<const Direction3<AcquisitionSpace>> lights,
                       const Direction3<AcquisitionSpace>& towards, const LightBlend& how,
                       const LightCoverage& coverage, LightExtrapolation extrapolation) {
  NearestCandidates nearest(how.lights);
  for (uint32_t light = 0; light < lights.size(); ++light)
    nearest.offer({light, anglePenalty(lights[light], towards)});
  const auto sorted = nearest.sorted();
  if (sorted.empty()) return {}; // none has a direction
  return fitted(ulrWeights(nearest), sorted[0].penalty, lights, towards, how, coverage, extrapolation);
}

BlendSet fitted(const BlendSet& ulr, float nearest, std::span<const Direction3<AcquisitionSpace>> lights,
                const Direction3<AcquisitionSpace>& towards, const LightBlend& how,
                const LightCoverage& coverage, LightExtrapolation extrapolation) {
  BlendSet blend = ulr;
  if (how.fit == LightFit::mean && extrapolation == LightExtrapolation::clamp) return blend;
  const float covered = coverage.at(nearest);
  if (how.fit == LightFit::plane) {
    lean(blend, lights, towards, covered);
    if (how.foreshortened) normalize(blend);
  }
  if (extrapolation == LightExtrapolation::fade)
    for (auto& blended : blend) blended.weight *= covered;
  return blend;
}

} // namespace surflect::ulr
