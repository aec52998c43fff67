// Metals, polished or rough, brushed or not; fibres too, with a tangent along them and little roughness along
// it: a tight arc of highlights across, as hair has.
//
// Single scattering as [Walter 2007, Eq. 20] with masking correlated by height [Heitz 2014], and the rest as
// [Kulla 2017]. The colour is that at normal incidence and a tint at 82 degrees [Kutz 2021] rather than a
// complex index of refraction: textures can hold it, and it fits measured metals closely.
#pragma once

#include "render/stage/material/loss_table.h"

#include <optional>

namespace surflect {

struct Conductor {
  Rgb color{1, 1, 1};                    // reflectance at normal incidence, 0..1
  Rgb grazingTint{1, 1, 1};              // 0..1, factor on Schlick's curve at 82 degrees
  Roughness alpha{0.1, 0.1};             // 0..1; both below kSmooth: a mirror
  const LossTable* mirrorLoss = nullptr; // mirrorLossTable(), shared; not read where smooth
};

// Of facets that reflect everything; what every Conductor refers to.
LossTable mirrorLossTable();

bool isSpecular(const Conductor& conductor);
Rgb evaluate(const Conductor& conductor, const ShadingDirection& wi, const ShadingDirection& wo);
double pdf(const Conductor& conductor, const ShadingDirection& wi, const ShadingDirection& wo);
std::optional<ScatterSample> sample(const Conductor& conductor, const ShadingDirection& wo,
                                    const Uniforms& u);

} // namespace surflect
