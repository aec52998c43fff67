#include "srf/model/light_blend_selection.h"

#include "srf/image/color.h"
#include "srf/proxy/relief/photometric.h"
#include "srf/weights/irradiance_ratio.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <set>

namespace surflect::model {

namespace {

// Largest spacing of lights, in radians, at which blends are foreshortened. A surface that faces one light
// squarely then has at least half the irradiance from the next, which stays within the limit of
// foreshortening().
constexpr double kForeshortenedSpacing = std::numbers::pi / 3;

// Fits that may be foreshortened. Photometric normals are as rough as a relief integrated from them: they
// would put a mean off by tens of percent, but a plane, which needs only a small correction, by a few
// percent.
std::vector<weights::LightFit> foreshortenedFits(NormalsFrom normals, double spacing) {
  if (normals == NormalsFrom::nothing || spacing > kForeshortenedSpacing) return {};
  if (normals == NormalsFrom::photographs) return {weights::LightFit::plane};
  return {weights::LightFit::mean, weights::LightFit::plane};
}

// Candidate blends, simplest first, that still work with one of `lights` left out: a blend of k also needs
// the light after its k-th. A plane of three lights is excluded, as it turns too steeply when a fourth light
// is as near.
std::vector<weights::LightBlend> candidatesFor(size_t lights,
                                               std::span<const weights::LightFit> foreshortened) {
  std::vector<weights::LightBlend> candidates;
  for (const size_t blended : {3, 4, 5, 6, 8}) {
    if (blended + 2 > lights) break;
    for (const weights::LightFit fit : {weights::LightFit::mean, weights::LightFit::plane}) {
      if (fit == weights::LightFit::plane && blended == 3) continue;
      candidates.push_back({blended, fit, false});
      if (std::ranges::find(foreshortened, fit) != foreshortened.end())
        candidates.push_back({blended, fit, true});
    }
  }
  return candidates;
}

float shown(float radiance, float white) {
  return image::srgbFromLinear(std::clamp(radiance / white, 0.f, 1.f));
}

} // namespace

ReflectanceSamples::ReflectanceSamples(std::vector<Direction3<AcquisitionSpace>> towards,
                                       std::vector<Rgb> irradiance)
    : towards_(std::move(towards)), irradiance_(std::move(irradiance)), reflectance_(towards_.size()) {
  assert(towards_.size() == irradiance_.size());
}

void ReflectanceSamples::add(std::span<const Rgb> reflectance, const Normal3<AcquisitionSpace>& normal) {
  normals_.push_back(normal);
  assert(reflectance.size() == reflectance_.size());
  for (size_t light = 0; light < reflectance.size(); ++light) {
    reflectance_[light].r.push_back(reflectance[light].r);
    reflectance_[light].g.push_back(reflectance[light].g);
    reflectance_[light].b.push_back(reflectance[light].b);
  }
}

// Photometric normal of each texel, refitted without one light; zero where the other lights determine none.
std::vector<Normal3<AcquisitionSpace>> ReflectanceSamples::normalsWithout(size_t light,
                                                                          const Progress& progress) const {
  std::vector<size_t> others;
  std::vector<Vec3<double>> towards;
  for (size_t other = 0; other < towards_.size(); ++other) {
    if (other == light) continue;
    others.push_back(other);
    towards.push_back(towards_[other].raw().cast<double>());
  }
  std::vector<Normal3<AcquisitionSpace>> normals;
  std::vector<Rgb> shares(others.size());
  for (size_t texel = 0; texel < normals_.size(); ++texel) {
    progress.checkNowAndThen(texel);
    for (size_t i = 0; i < others.size(); ++i) {
      const auto& [r, g, b] = reflectance_[others[i]];
      shares[i] = std::numbers::pi_v<float> * Rgb{r[texel], g[texel], b[texel]};
    }
    normals.push_back(
        assume<Normal3<AcquisitionSpace>>(relief::fitLambert(towards, shares).normal.cast<float>()));
  }
  return normals;
}

// Sum of squared errors of each candidate, for the photographs of `light` predicted from the other lights.
std::vector<double> ReflectanceSamples::leftOutErrors(size_t light,
                                                      std::span<const weights::LightBlend> candidates,
                                                      std::span<const Normal3<AcquisitionSpace>> normals,
                                                      float white, const Progress& progress) const {
  std::vector<size_t> indices;
  std::vector<Direction3<AcquisitionSpace>> others;
  std::vector<Direction3<AcquisitionSpace, double>> covering;
  for (size_t other = 0; other < towards_.size(); ++other) {
    if (other == light) continue;
    indices.push_back(other);
    others.push_back(towards_[other]);
    covering.push_back(towards_[other].cast<double>());
  }
  const weights::LightExtrapolationFade coverage(covering);
  std::vector<weights::BlendSet> blends;
  for (const weights::LightBlend& candidate : candidates)
    blends.push_back(weights::blendOfLights(others, towards_[light], candidate, coverage,
                                            weights::LightExtrapolation::clamp));

  // Foreshortening factor of a texel's blend, candidate by candidate.
  std::set<uint32_t> blended; // only a few, however many lights exist
  for (size_t c = 0; c < candidates.size(); ++c)
    if (candidates[c].foreshortened)
      for (const auto& [other, weight] : blends[c]) blended.insert(other);
  std::vector<float> factors, cosines(others.size());
  for (size_t texel = 0; texel < normals.size(); ++texel) {
    progress.checkNowAndThen(texel);
    for (const uint32_t other : blended)
      cosines[other] = weights::foreshortenedCosine(normals[texel], others[other]);
    const float asked = weights::foreshortenedCosine(normals[texel], towards_[light]);
    for (size_t c = 0; c < candidates.size(); ++c)
      factors.push_back(candidates[c].foreshortened
                            ? weights::foreshortening(asked, weights::blendedCosine(blends[c], cosines))
                            : 1);
  }

  std::vector<double> errors(candidates.size());
  const auto addChannel = [&](std::vector<float> Channels::*channel, float irradiance) {
    const auto& truth = reflectance_[light].*channel;
    for (size_t texel = 0; texel < truth.size(); ++texel) {
      progress.checkNowAndThen(texel);
      const float wanted = shown(irradiance * truth[texel], white);
      for (size_t c = 0; c < candidates.size(); ++c) {
        float got = 0;
        for (const auto& [other, weight] : blends[c])
          got += weight * (reflectance_[indices[other]].*channel)[texel];
        got *= factors[texel * candidates.size() + c];
        const float difference = shown(irradiance * got, white) - wanted;
        errors[c] += difference * difference;
      }
    }
  };
  addChannel(&Channels::r, irradiance_[light].r);
  addChannel(&Channels::g, irradiance_[light].g);
  addChannel(&Channels::b, irradiance_[light].b);
  return errors;
}

LightBlendSelection ReflectanceSamples::choose(double white, NormalsFrom normals,
                                               const Progress& progress) const {
  constexpr double kGoodEnough = 1.12;
  constexpr double kUnseen = 1 / (12 * 255.0 * 255.0); // squared error of rounding to 8 bits
  const size_t lights = towards_.size();
  std::vector<Direction3<AcquisitionSpace, double>> covering;
  for (const auto& towards : towards_) covering.push_back(towards.cast<double>());
  const auto fits = foreshortenedFits(normals, weights::LightExtrapolationFade(covering).spacing());
  const auto candidates = candidatesFor(lights, fits);
  if (candidates.empty() || reflectance_[0].r.empty()) return {};
  std::vector<std::vector<double>> ofLight(lights);
  tbb::parallel_for(size_t{0}, lights, [&](size_t light) {
    const bool areToldAgain = !fits.empty() && normals == NormalsFrom::photographs;
    ofLight[light] =
        leftOutErrors(light, candidates, areToldAgain ? normalsWithout(light, progress) : normals_,
                      static_cast<float>(white), progress);
  });
  std::vector<double> errors(candidates.size());
  for (const auto& part : ofLight)
    for (size_t c = 0; c < errors.size(); ++c) errors[c] += part[c];

  const double least = *std::ranges::min_element(errors);
  size_t chosen = 0;
  const auto values = static_cast<double>(3 * reflectance_[0].r.size() * lights);
  while (errors[chosen] > std::max(kGoodEnough * least, kUnseen * values)) ++chosen;
  return {candidates[chosen], -10 * std::log10(std::max(errors[chosen] / values, 1e-30))};
}

} // namespace surflect::model
