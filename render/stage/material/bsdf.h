// Interface of a material kind: its BSDF seen from wo, which precomputes everything that does not depend on
// wi and is then evaluated for many wi.
//
// Each kind M names its M::Bsdf, made from (const M&, wo), with
//   Rgb evaluate(view, wi)       f |wi . n|, per steradian, without specular lobes
//   double pdf(view, wi)         density of sample(), per steradian of wi, without specular lobes
//   std::optional<ScatterSample> sample(view, u)
// material.h states their laws. A Bsdf is a value: it needs the shared tables, but not the material.
#pragma once

#include "render/stage/material/shading.h"

#include <optional>

namespace surflect::material {

template <class Kind>
concept Scatterer = requires {
  typename Kind::Bsdf;
};

// Evaluate, pdf and sample for a single wi.
template <Scatterer Kind>
Rgb evaluate(const Kind& material, const ShadingDirection& wi, const ShadingDirection& wo) {
  return evaluate(typename Kind::Bsdf(material, wo), wi);
}
template <Scatterer Kind>
double pdf(const Kind& material, const ShadingDirection& wi, const ShadingDirection& wo) {
  return pdf(typename Kind::Bsdf(material, wo), wi);
}
template <Scatterer Kind>
std::optional<ScatterSample> sample(const Kind& material, const ShadingDirection& wo, const Uniforms& u) {
  return sample(typename Kind::Bsdf(material, wo), u);
}

} // namespace surflect::material
