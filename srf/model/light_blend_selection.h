// Which blend of captured lights tells the photographs best: each light is left out in turn, and its
// photographs are made of the others'. Cross-validation asks nothing about the material.
#pragma once

#include "srf/ulr/light_blend.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"

#include <optional>
#include <span>
#include <vector>

namespace surflect::model {

struct LightBlendSelection {
  ulr::LightBlend blend;
  // Of the photographs of lights left out, after the sRGB curve; none where there are too few lights to tell.
  std::optional<double> leftOutDb;
};

// What tells the normals of a geometry.
enum class NormalsFrom { shape, photographs, nothing };

// What the same texels show under every light.
class LightSamples {
public:
  // Per light: the unit direction to it, and a typical irradiance, which is above 0 and tells how bright
  // errors are.
  LightSamples(std::vector<Direction3<AcquisitionSpace>> towards, std::vector<Rgb> irradiance);

  // A texel's radiance under each light over the irradiance there, and the unit normal of what it shows.
  void add(std::span<const Rgb> reflectance, const Normal3<AcquisitionSpace>& normal);

  // The simplest blend whose squared error is within 12 %, or 0.5 dB, of the least, or below that of rounding
  // to 8 bits: few lights before many, their mean before a plane, as they are before foreshortened. Errors
  // are of values clipped at white, after the sRGB curve. Leaving out doubles the distance to the nearest
  // light, so that they are larger than those of new lights between captured ones, and in favour of what
  // smooths; hence the margin. Photographs that tell the normals have told those given with the light that is
  // left out; the others' alone are asked again, texel by texel (photometric.h). None is foreshortened where
  // nothing tells normals, nor where lights are far apart. Throws Cancelled.
  LightBlendSelection choose(double white, NormalsFrom normals, const Progress& progress = {}) const;

private:
  std::vector<Normal3<AcquisitionSpace>> normalsWithout(size_t light, const Progress& progress) const;
  std::vector<double> leftOutErrors(size_t light, std::span<const ulr::LightBlend> candidates,
                                    std::span<const Normal3<AcquisitionSpace>> normals, float white,
                                    const Progress& progress) const;

  std::vector<Direction3<AcquisitionSpace>> towards_;
  std::vector<Rgb> irradiance_;
  // Per light: radiance over irradiance, red of all texels, green of all, blue of all as three rows.
  struct Channels {
    std::vector<float> r, g, b;
  };
  std::vector<Channels> reflectance_;
  std::vector<Normal3<AcquisitionSpace>> normals_; // of all texels
};

} // namespace surflect::model
