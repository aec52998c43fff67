// Materials: a closed set of plain values, small enough to be filled in anew at each hit. Tables are shared.
//
// Conventions are in shading.h. Opaque materials scatter above the surface only; for two-sided ones, the
// caller flips the frame. Only Dielectric has an inside; its quantity is L / n^2 (dielectric.h). Reciprocity
// holds for evaluate(wi, wo) / |wi . n|, up to rounding.
#pragma once

#include "render/stage/material/clear_coat.h"
#include "render/stage/material/dielectric.h"

#include <span>
#include <variant>

namespace surflect::material {

using Material = std::variant<Lambert, RoughDiffuse, Conductor, Dielectric, Ward, Measured, ClearCoat>;

// Throws Error at the field that is out of range; asserts that tables are set.
void requireValid(const Material& material);

// Material seen from wo (bsdf.h).
using Bsdf = std::variant<LambertBsdf, RoughDiffuseBsdf, ConductorBsdf, DielectricBsdf, WardBsdf,
                          MeasuredBsdf, ClearCoatBsdf>;
Bsdf bsdfAt(const ShadingDirection& wo, const Material& material);

// Evaluate and pdf, as below, for many wi. Spans have equal length.
void evaluate(const Bsdf& bsdf, std::span<const ShadingDirection> wi, std::span<Rgb> values);
void pdf(const Bsdf& bsdf, std::span<const ShadingDirection> wi, std::span<double> densities);
std::optional<ScatterSample> sample(const Bsdf& bsdf, const Uniforms& u);

// Value f |wi . n|, per steradian, without specular lobes.
Rgb evaluate(const Material& material, const ShadingDirection& wi, const ShadingDirection& wo);

// Density of sample(), per steradian of wi, without specular lobes. It integrates to the share of samples
// that are returned and not specular.
double pdf(const Material& material, const ShadingDirection& wi, const ShadingDirection& wo);

// Draws wi. None if the direction is on the wrong side of the surface; that light counts as lost.
std::optional<ScatterSample> sample(const Material& material, const ShadingDirection& wo, const Uniforms& u);

// Returns whether all lobes are specular: evaluate is then 0, and lights need not be sampled.
bool isSpecular(const Material& material);

// Share of even light that leaves towards wo, by `count` samples of a fixed sequence; error about 1 / count
// times the variation of the weights.
Rgb albedo(const Material& material, const ShadingDirection& wo, int count = 4096);

} // namespace surflect::material
