// Tiny light fields of all kinds on disk, with their renderers and plain forms in double precision.
#pragma once

#include "render/method/option.h"
#include "render/method/renderer.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/geometry/mesh.h"
#include "tests/stability/dice.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace surflect::stability {

using LightFieldCamera = capture::Camera<AcquisitionSpace>;

// A renderer, and what must hold of its pictures.
struct Subject {
  std::unique_ptr<method::Renderer> renderer;
  method::Setting setting; // of all frames, beside knobs
  TriangleMesh mesh;
  // RGBA, premultiplied, with a ray through the middle of each pixel; none where a setting has no plain form.
  std::function<std::optional<image::Image>(const LightFieldCamera&, const method::Setting&)> plain;
  // Names weights for this viewer that do not sum to 1; empty if all do.
  std::function<std::string(const Vec3<double>& viewer, Dice&)> wrongWeights;
  double tolerance = 1. / 255; // of a channel, against the plain form
  size_t gaps = 0;             // pixels of a frame that may be wrong
  double brightest = 0;        // radiance that no pixel exceeds; 0: not bounded
  // Whether a near plane cuts the object off; otherwise rays have any length.
  std::function<bool(const method::Setting&)> hasNearPlane = [](const method::Setting&) { return true; };
};

struct SubjectName {
  std::string name; // object, kind of light field, options of the renderer
  std::function<Subject()> open;
};

// All objects in all kinds of light fields, by renderers with different options. A field is built in the
// folder when it is first opened.
std::vector<SubjectName> tinyLightFields(const std::filesystem::path& folder);

} // namespace surflect::stability
