#include "srf/validation/light_samples.h"

#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace surflect::validation {

namespace {

using World = AcquisitionSpace;

constexpr size_t kPixels = 1500;           // per view
constexpr size_t kBytes = size_t{1} << 30; // of photographs in memory
constexpr double kRimCosine = 0.25;        // n . towards camera; below, texels are mixed with others

// Up to kPixels pixels that show the mesh, evenly chosen.
LightSamples samplePixels(const capture::Camera<World>& camera, const TriangleMesh& mesh,
                          const RayCaster<World>& caster) {
  LightSamples all;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const double area = 1.0 * camera.lens.width * camera.lens.height;
  const int step = std::max(1, static_cast<int>(std::sqrt(area / (4.0 * kPixels))));
  for (int y = step / 2; y < camera.lens.height; y += step)
    for (int x = step / 2; x < camera.lens.width; x += step) {
      const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
      if (!ray) continue;
      const auto origin = worldFromCamera(ray->origin);
      const auto direction = worldFromCamera(ray->direction);
      const auto hit = caster.firstHit(origin, direction);
      if (!hit) continue;
      Vec3<double> n = areaVector(mesh, hit->triangle).normalized();
      const double cosine = -n.dot(direction.raw());
      if (!(std::abs(cosine) > kRimCosine)) continue;
      if (cosine < 0) n = -n;
      ++all.seen;
      all.turned += cosine < 0;
      all.points.push_back(origin + hit->distance * direction);
      all.normals.push_back(n);
      all.pixels.push_back(static_cast<size_t>(y) * static_cast<size_t>(camera.lens.width) +
                           static_cast<size_t>(x));
    }
  return all;
}

// Selected views with frames: some views with their lights, and one more frame for every other light.
std::map<size_t, std::vector<size_t>> chooseFrames(const capture::Capture& capture,
                                                   const CheckEffort& effort) {
  std::map<size_t, std::vector<size_t>> ofChosen, frames;
  for (const size_t view : evenlySpaced(capture.views.size(), effort.litViews)) ofChosen[view];
  for (size_t i = 0; i < capture.frames.size(); ++i)
    if (const auto chosen = ofChosen.find(capture.frames[i].view); chosen != ofChosen.end())
      chosen->second.push_back(i);
  std::vector<bool> hasLight(capture.lights.size(), false);
  const auto take = [&](size_t i) {
    frames[capture.frames[i].view].push_back(i);
    hasLight[*capture.frames[i].light] = true;
  };
  for (const auto& [view, ofView] : ofChosen)
    for (const size_t i : evenlySpaced(ofView.size(), effort.lightsOfView)) take(ofView[i]);
  if (!effort.everyLight) return frames;
  for (size_t i = 0; i < capture.frames.size(); ++i)
    if (!ofChosen.contains(capture.frames[i].view) && !hasLight[*capture.frames[i].light]) take(i);
  return frames;
}

// Leaves out pixels that are dark in all photographs: a surface made from one view covers the background too.
void leaveOutDark(const LightSamples& samples, std::vector<bool>& inObject) {
  constexpr float kDark = 0.02f; // of the 99.5th percentile
  std::vector<float> brightest;
  for (size_t i = 0; i < inObject.size(); ++i) {
    float most = 0;
    for (const LitShot& shot : samples.shots) most = std::max(most, static_cast<float>(shot.luminance[i]));
    brightest.push_back(most);
  }
  if (brightest.empty()) return;
  std::vector<float> sorted = brightest;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 995 / 1000);
  std::nth_element(sorted.begin(), at, sorted.end());
  for (size_t i = 0; i < inObject.size(); ++i)
    if (brightest[i] < kDark * *at) inObject[i] = false;
}

} // namespace

std::vector<LightSamples> readLightSamples(const capture::Capture& capture, const TriangleMesh& mesh,
                                           const RayCaster<World>& caster, const CheckEffort& effort,
                                           const Progress& progress) {
  const auto frames = chooseFrames(capture, effort);
  std::vector<LightSamples> views;
  for (const auto& [view, ofView] : frames) {
    const capture::Camera<World>& camera = capture.views[view].camera;
    LightSamples& samples = views.emplace_back(samplePixels(camera, mesh, caster));
    const size_t bytes = size_t{48} * static_cast<size_t>(camera.lens.width) *
                         static_cast<size_t>(camera.lens.height),
                 batch = std::max<size_t>(1, kBytes / bytes);
    std::vector<bool> inObject(samples.pixels.size(), true);
    for (size_t first = 0; first < ofView.size(); first += batch) {
      progress("lights", (static_cast<double>(views.size() - 1) +
                          static_cast<double>(first) / static_cast<double>(ofView.size())) /
                             static_cast<double>(frames.size()));
      const auto some = std::span(ofView).subspan(first, std::min(batch, ofView.size() - first));
      const auto photographs = capture::readPhotographs(capture, some);
      for (size_t k = 0; k < some.size(); ++k) {
        LitShot& shot = samples.shots.emplace_back(LitShot{*capture.frames[some[k]].light, {}});
        for (size_t i = 0; i < samples.pixels.size(); ++i) {
          const float* radiance = &photographs[k].radiance.values[3 * samples.pixels[i]];
          shot.luminance.push_back(image::luma({radiance[0], radiance[1], radiance[2]}));
          if (!(photographs[k].alpha.values[samples.pixels[i]] > 0.5f)) inObject[i] = false;
        }
      }
    }
    if (capture.views.size() == 1) leaveOutDark(samples, inObject);
    size_t kept = 0; // pixels inside the masks that some photograph shows lit
    for (size_t i = 0; i < inObject.size(); ++i) {
      if (!inObject[i]) continue;
      samples.points[kept] = samples.points[i];
      samples.normals[kept] = samples.normals[i];
      samples.pixels[kept] = samples.pixels[i];
      for (LitShot& shot : samples.shots) shot.luminance[kept] = shot.luminance[i];
      ++kept;
    }
    samples.points.resize(kept);
    samples.normals.resize(kept);
    samples.pixels.resize(kept);
    for (LitShot& shot : samples.shots) shot.luminance.resize(kept);
  }
  return views;
}

} // namespace surflect::validation
