// Samples of a pixel: light-field renderers draw larger pictures and average them, so that edges are smooth.
// The number of samples is a knob.
#pragma once

#include "render/knobs/knob.h"
#include "render/scene/scene.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"

namespace surflect::lightfield {

// Default and largest number of samples along each side of a pixel. By default, edges are about as smooth as
// those of splats.
inline constexpr int kSamples = 2, kMostSamples = 8;

// Throws Error unless the number is 1..kMostSamples.
void requireSamples(int samples);

// The knob "samples": from `full` by halves to 1.
knobs::Knob samplesKnob(int full);
// Samples of a setting; `full` if it does not name them. Throws Error unless they are a whole number of
// 1..kMostSamples.
int samplesOf(const knobs::Setting& setting, int full);

// A scene's camera for a picture with samples x samples pixels for each. Nothing is warped, so object space
// is acquisition space.
capture::Camera<AcquisitionSpace> sampledCamera(const scene::Scene& scene, int samples);

// Number of samples of a scene's picture.
double samplesOf(const scene::Scene& scene, int samples);

// Whether any pixel of an RGBA picture is covered.
bool showsObject(const image::Image& picture);
inline constexpr const char* kNothingVisible = "no part of the object is visible";

} // namespace surflect::lightfield
