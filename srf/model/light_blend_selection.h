// Selects the blend of captured lights by leave-one-out cross-validation: the photographs of each light are
// predicted from those of the others. No assumption about the material is needed.
#pragma once

#include "srf/weights/light_blend.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"

#include <optional>
#include <span>
#include <vector>

namespace surflect::model {

struct LightBlendSelection {
  weights::LightBlend blend;
  // PSNR of the predicted photographs after the sRGB curve; empty if there are too few lights.
  std::optional<double> leftOutDb;
};

// Source of the surface normals.
enum class NormalsFrom { shape, photographs, nothing };

// Reflectance of a sample of texels under every light, with their normals.
class ReflectanceSamples {
public:
  // Unit direction to each light, and its irradiance (> 0) at a typical place, which scales the errors.
  ReflectanceSamples(std::vector<Direction3<AcquisitionSpace>> towards, std::vector<Rgb> irradiance);

  // Adds a texel: its radiance under each light divided by the light's irradiance there (#lights), and its
  // unit surface normal.
  void add(std::span<const Rgb> reflectance, const Normal3<AcquisitionSpace>& normal);

  // Chooses the simplest blend whose squared error is within 12 % (0.5 dB) of the least, or below that of
  // rounding to 8 bits. Fewer lights are simpler than more, a mean than a plane, and a plain blend than a
  // foreshortened one. Errors are those of values clipped at `white`, after the sRGB curve.
  //
  // Leaving a light out doubles the distance to the nearest one, so that these errors exceed those of new
  // lights between captured ones and favour smoothing; hence the margin. Photometric normals are refitted
  // without the omitted light (photometric.h). Nothing is foreshortened without normals or if lights are far
  // apart. Throws Cancelled.
  LightBlendSelection choose(double white, NormalsFrom normals, const Progress& progress = {}) const;

private:
  std::vector<Normal3<AcquisitionSpace>> normalsWithout(size_t light, const Progress& progress) const;
  std::vector<double> leftOutErrors(size_t light, std::span<const weights::LightBlend> candidates,
                                    std::span<const Normal3<AcquisitionSpace>> normals, float white,
                                    const Progress& progress) const;

  std::vector<Direction3<AcquisitionSpace>> towards_;
  std::vector<Rgb> irradiance_;
  // Radiance over irradiance under one light, channel by channel, of all texels.
  struct Channels {
    std::vector<float> r, g, b;
  };
  std::vector<Channels> reflectance_;
  std::vector<Normal3<AcquisitionSpace>> normals_; // one for each texel
};

} // namespace surflect::model
