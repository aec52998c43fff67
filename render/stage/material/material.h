// What a surface is made of: one of a closed set of plain values, small enough to be filled in anew at each
// hit. Tables are made once and referred to.
//
// Conventions of all of them: shading.h. Opaque materials scatter above the surface only; whoever wants a
// two-sided one turns the frame. Only Dielectric has an inside; what it scatters is L / n^2 (dielectric.h).
// Reciprocity holds for evaluate(wi, wo) / |wi . n|, exactly but for rounding.
#pragma once

#include "render/stage/material/clear_coat.h"
#include "render/stage/material/dielectric.h"

#include <span>
#include <variant>

namespace surflect::material {

using Material = std::variant<Lambert, RoughDiffuse, Conductor, Dielectric, Ward, Measured, ClearCoat>;

// Throws Error at the field that is out of its range; of tables it asserts that they are there.
void requireValid(const Material& material);

// As seen from wo: view.h.
using Bsdf = std::variant<LambertBsdf, RoughDiffuseBsdf, ConductorBsdf, DielectricBsdf, WardBsdf,
                          MeasuredBsdf, ClearCoatBsdf>;
Bsdf bsdfAt(const ShadingDirection& wo, const Material& material);

// Of all wi at once: those below, and pdf. Spans have one length.
void evaluate(const Bsdf& bsdf, std::span<const ShadingDirection> wi, std::span<Rgb> values);
void pdf(const Bsdf& bsdf, std::span<const ShadingDirection> wi, std::span<double> densities);
std::optional<ScatterSample> sample(const Bsdf& bsdf, const Uniforms& u);

// f |wi . n|, per steradian; without lobes that are specular.
Rgb evaluate(const Material& material, const ShadingDirection& wi, const ShadingDirection& wo);

// Density of what sample() returns, per steradian of wi; without lobes that are specular. It integrates to
// the share of samples that are returned and not specular.
double pdf(const Material& material, const ShadingDirection& wi, const ShadingDirection& wo);

// None where the drawn direction is on the wrong side of the surface: such light is lost, and is accounted
// for.
std::optional<ScatterSample> sample(const Material& material, const ShadingDirection& wo, const Uniforms& u);

// All its lobes are specular: evaluate is 0 everywhere, and lights need not be sampled.
bool isSpecular(const Material& material);

// Share of even light that leaves towards wo, by `count` samples of a fixed sequence; error about 1 / count,
// times the variation of the weights.
Rgb albedo(const Material& material, const ShadingDirection& wo, int count = 4096);

} // namespace surflect::material
