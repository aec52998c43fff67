// What a kind of material has: a view of it, in which what does not depend on where the light comes from is
// worked out once, to be asked for many directions of light.
//
// Each kind M names its M::View, made from (const M&, wo), with
//   Rgb evaluate(view, wi)       f |wi . n|, per steradian; without lobes that are specular
//   double pdf(view, wi)         of what sample() returns, per steradian of wi; likewise
//   std::optional<ScatterSample> sample(view, u)
// material.h says what these keep to. A view is a value: it needs the shared tables, not the material.
#pragma once

#include "render/stage/material/shading.h"

#include <optional>

namespace surflect::material {

template <class Kind>
concept Scatterer = requires {
  typename Kind::Bsdf;
};

// The same for one direction of light.
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
