#include "render/lightfield/common/pixel_samples.h"

#include "surfel/base/error.h"

#include <cmath>
#include <cstddef>
#include <string>

namespace surflect::lightfield {

void requireSamples(int samples) {
  if (samples < 1 || samples > kMostSamples)
    throw Error::mismatch("1.." + std::to_string(kMostSamples), std::to_string(samples)).at("samples");
}

knobs::Knob samplesKnob(int full) {
  knobs::Knob knob{"samples", "samples along each side of a pixel", {}};
  for (int samples = full; samples >= 1; samples /= 2) knob.values.push_back(samples);
  return knob;
}

int samplesOf(const knobs::Setting& setting, int full) {
  const auto found = setting.find("samples");
  if (found == setting.end()) return full;
  const double samples = found->second;
  if (!(samples >= 1 && samples <= kMostSamples) || samples != std::floor(samples))
    throw Error::mismatch("a whole number of 1 to " + std::to_string(kMostSamples), numberText(samples))
        .at("samples")
        .at("knob");
  return static_cast<int>(samples);
}

capture::Camera<AcquisitionSpace> sampledCamera(const scene::Scene& scene, int samples) {
  const auto& pose = scene.camera.cameraFromWorld;
  const capture::Lens& lens = scene.camera.lens;
  return {capture::resized(lens, samples * lens.width, samples * lens.height),
          {pose.rotation(), pose.translation()}};
}

double samplesOf(const scene::Scene& scene, int samples) {
  const capture::Lens& lens = scene.camera.lens;
  return static_cast<double>(lens.width) * lens.height * samples * samples;
}

bool showsObject(const image::Image& picture) {
  for (size_t i = 3; i < picture.values.size(); i += 4)
    if (picture.values[i] > 0) return true;
  return false;
}

} // namespace surflect::lightfield
