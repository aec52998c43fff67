// Selections of a pack by leaving photographs out: how light weights blend, and which interpolation.
#pragma once

#include "srf/model/model.h"
#include "srf/model/shared_surface.h"
#include "srf/weights/interpolation.h"
#include "srf/weights/light_blend.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"

#include <optional>
#include <span>
#include <vector>

namespace surflect::model {

// Selects the blend of captured lights by leave-one-out cross-validation: the photographs of each light are
// predicted from those of the others. No assumption about the material is needed.
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

// True if the model has enough cameras and lights to leave one of each out.
bool canLeaveOut(const Model& model);

// Selects how photographs are weighted, by leave-one-out cross-validation: photographs are predicted by a
// model that lacks their camera, their light, or both. No assumption about the material is needed.
struct InterpolationSelection {
  weights::InterpolationChoice choice;
  bool foreshortened = false; // whether blends of pairs are foreshortened
  std::vector<float> trust;   // in each of the model's tables (SharedReflectance)
  // Error of the predicted photographs, as the mean of the PSNR in linear light and after the sRGB curve:
  // with the choice, and with separate weights. Empty if there are too few cameras or lights.
  struct LeftOut {
    double chosenDb = 0, separateDb = 0;
  };
  std::optional<LeftOut> leftOut;
};

// Chooses among separate weights, and kriging with several scales, with and without reciprocity and shadow
// states. Separate weights stay unless kriging gains 1 dB among all photographs left out, and 1 dB among
// those whose camera stays: leaving a camera out doubles the gap to the next, and in gaps kriging gains even
// for glass, where it loses otherwise. The best settings of kriging are stored even then. Blends of pairs are
// foreshortened if the model's light blend is; in a capture with gaps, which has no light blend, if there are
// normals and the error is less.
//
// Tables are trusted as far as they predict photographs of the surfels that they describe better than the
// choice without tables does (tableShare), and used if the error is then less. Tables are tried that have not
// seen the photographs that are left out. `shared`: the sample of which the model's tables were made; null
// without tables. Reads blocks of the model's view files. Throws Error as ViewFile::read, and Cancelled.
InterpolationSelection selectInterpolation(const Model& model, bool hasNormals, const SharedSample* shared,
                                           const Progress& progress = {});

} // namespace surflect::model
