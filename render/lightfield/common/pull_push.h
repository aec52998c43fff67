// Filling of texels that were not observed, from those around them.
//
// [Gortler 1996, pull-push algorithm] Gortler, Grzeszczuk, Szeliski, Cohen: The Lumigraph.
// Symbols: x value of a texel, w its weight; levels r are halved in both directions until one texel is left.
#pragma once

#include <Eigen/Core>

#include <span>

namespace surflect::lightfield {

// Fills texels (#width x height; r, g, b and a weight 0..1) of weight w < 1 with w times their own colour and
// 1 - w times a smooth colour from around. Texels of weight 1 keep their bits, and all weights stay as they
// are. Colours of weight 0 are not read, and may be NaN; the others are finite. Without any weight, colours
// become 0.
void pullPush(std::span<Eigen::Vector4f> texels, int width, int height);

} // namespace surflect::lightfield
