#include "render/verify/exactness.h"

#include "render/evaluation/contact_sheet.h"
#include "render/evaluation/measure.h"
#include "render/evaluation/true_frames.h"
#include "render/verify/block_checks.h"
#include "render/verify/model_checks.h"
#include "srf/capture/origin.h"
#include "srf/shading/reference.h"
#include "srf/shading/shade.h"
#include "warp/warp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace surflect::verify {

namespace {

constexpr int kErosion = 2; // pixels

std::string photographName(const std::string& camera, const std::string& light) {
  return light.empty() ? "camera " + camera : fmt::format("camera {} under light {}", camera, light);
}

// Radiance of surfels shaded at a captured camera and light, against the stored photograph of both.
Check surfelCheck(const model::Model& model, weights::ShadeOptions options, const Bounds& bounds,
                  const Progress& progress) {
  options.usesAlpha = false; // the stored photographs are not multiplied by alpha
  const MetQueries met = metQueries(model, options);
  if (met.batch.size() == 0) return inapplicable("exact_surfels", "no camera sees a surfel well");
  codec::BlockCache cache(model.files, size_t{1} << 28);
  shading::ShadingStats stats;
  const shading::Shaded shaded = shading::shade(model, met.batch, options, cache, stats, progress);
  std::vector<shading::ShadingOp> lookups;
  weights::LightRows rows;
  std::vector<uint32_t> queries; // of the look-ups
  size_t cutAway = 0;            // surfels whose matte shows nothing at their place
  for (uint32_t query = 0; query < met.batch.size(); ++query) {
    const auto pixel = model.rig.views[met.view[query]].camera.project(
        model.cloud.p0[met.batch.surfels[query]].cast<double>());
    if (!pixel) continue;
    if (!shading::holdsTexel(cache, met.view[query], pixel->x, pixel->y)) {
      ++cutAway;
      continue;
    }
    const auto row = static_cast<uint32_t>(rows.lights.size());
    rows.add(met.column[query], {1, 1, 1});
    lookups.push_back({static_cast<uint32_t>(queries.size()), met.view[query], static_cast<float>(pixel->x),
                       static_cast<float>(pixel->y), 1, row, row + 1});
    queries.push_back(query);
  }
  if (lookups.empty())
    return inapplicable("exact_surfels", "no photograph shows a surfel that its camera sees");
  const auto stored = shading::executeReference(lookups, rows, lookups.size(), cache);
  evaluation::PooledMean squares;
  std::map<uint32_t, evaluation::PooledMean> ofView, ofLight;
  double largest = -1;
  FlaggedPlace worst;
  for (size_t i = 0; i < queries.size(); ++i) {
    const Rgb& own = shaded.radiance[queries[i]];
    const Eigen::Vector3d error =
        (Eigen::Vector3d(double{own.r}, double{own.g}, double{own.b}) - stored[i]) / model.white;
    const evaluation::PooledMean mean{error.squaredNorm(), 3};
    squares += mean;
    ofView[met.view[queries[i]]] += mean;
    if (!model.columns.empty() && !model.rig.lights.empty())
      ofLight[model.columns[met.view[queries[i]]][met.column[queries[i]]]] += mean;
    const double percent = 100 * std::sqrt(mean.mean());
    if (!(percent <= largest))
      largest = percent, worst = placeOf(model, met.batch.surfels[queries[i]], percent);
  }
  const auto percentOf = [](const evaluation::PooledMean& mean) { return 100 * std::sqrt(mean.mean()); };
  const auto worstOf = [&](const std::map<uint32_t, evaluation::PooledMean>& by) {
    return std::ranges::max_element(by, {}, [&](const auto& entry) { return percentOf(entry.second); });
  };
  const double rms = percentOf(squares);
  std::string finding = fmt::format(
      "{} surfels at captured cameras and lights err by {:.2g} % of white (RMS), the worst by {:.2g} %; ",
      queries.size(), rms, largest);
  const auto view = worstOf(ofView);
  finding += fmt::format("the worst camera is {} with {:.2g} %", model.rig.views[view->first].identity,
                         percentOf(view->second));
  if (!ofLight.empty()) {
    const auto light = worstOf(ofLight);
    finding += fmt::format(", the worst light {} with {:.2g} %", model.rig.lights[light->first].identity,
                           percentOf(light->second));
  }
  if (cutAway > 0)
    finding += fmt::format("; {} more are outside of the mattes of cameras that see them", cutAway);
  return judged("exact_surfels", rms, bounds, std::move(finding), {worst});
}

const codec::AlphaPlane* alphaOf(const model::Model& model, size_t view) {
  return model.alpha.empty() ? nullptr : &model.alpha[view];
}

} // namespace

Exactness exactnessOf(const model::Model& model, method::Renderer& renderer,
                      const weights::ShadeOptions& options, const capture::Capture* capture, size_t count,
                      const Bounds& bounds, const Progress& progress) {
  Exactness result;
  result.isOfCapture = capture != nullptr;
  result.checks.push_back(surfelCheck(model, options, bounds, progress));
  const warp::WarpPointer rest = warp::chainWarp({});
  std::optional<evaluation::TrueFrames> truths;
  if (capture) truths.emplace(*capture, model.rig, *rest, capture::Split::train, progress);
  const capture::Capture& photographed = truths ? truths->capture() : model.rig;
  const auto byView = evaluation::framesByView(photographed);
  const std::vector<size_t> chosen = evaluation::spreadFrames(photographed, count);
  const double exposure = model.white > 0 ? 1 / model.white : 1;
  evaluation::Difference pooled;
  evaluation::PooledMean pooledInside;
  std::map<std::string, evaluation::Difference> ofLight, ofView;
  size_t done = 0;
  for (size_t view = 0; view < byView.size(); ++view) {
    std::vector<size_t> frames;
    std::vector<uint32_t> columns;
    for (uint32_t column = 0; column < byView[view].size(); ++column)
      if (std::ranges::find(chosen, byView[view][column]) != chosen.end()) {
        frames.push_back(byView[view][column]);
        columns.push_back(column);
      }
    if (frames.empty()) continue;
    const std::vector<image::Image> photographs =
        truths ? truths->read(frames, progress)
               : storedPictures(model.files[view], alphaOf(model, view), columns, progress);
    for (size_t i = 0; i < frames.size(); ++i) {
      progress("photographs", static_cast<double>(done++) / static_cast<double>(chosen.size()));
      const capture::Frame& frame = photographed.frames[frames[i]];
      std::vector<scene::ShotLight> lights;
      if (frame.light) lights.push_back(scene::inObjectSpace(photographed.lights[*frame.light]));
      const image::Image rendered =
          renderer
              .render({*rest, scene::inObjectSpace(photographed.views[view].camera), lights}, {}, progress)
              .color;
      const evaluation::Difference difference = evaluation::compare(photographs[i], rendered, exposure);
      const image::Mask interior = image::eroded(image::objectMask(photographs[i]), kErosion);
      const evaluation::PooledMean inside =
          evaluation::squaredError(evaluation::applyExposure(photographs[i], exposure),
                                   evaluation::applyExposure(rendered, exposure), interior);
      const std::string light = frame.light ? photographed.lights[*frame.light].identity : "";
      const std::string& camera = photographed.views[view].identity;
      result.pictures.push_back({camera, light, difference.psnrLinear(), difference.psnrSrgb(),
                                 difference.ssim(), evaluation::psnr(inside.mean())});
      pooled += difference;
      pooledInside += inside;
      ofView[camera] += difference;
      if (!light.empty()) ofLight[light] += difference;
    }
  }
  progress("photographs", 1);
  if (result.pictures.empty() || pooled.squaredErrorLinear.count == 0) {
    result.checks.push_back(inapplicable("exact_pictures", "no photograph shows the object"));
    return result;
  }
  const auto& worst = *std::ranges::min_element(result.pictures, {}, &ExactPicture::psnrLinearDb);
  const auto least = [](const std::map<std::string, evaluation::Difference>& by) {
    return std::ranges::min_element(by, {}, [](const auto& entry) { return entry.second.psnrLinear(); });
  };
  std::string finding = fmt::format(
      "{} {} come back to {:.1f} dB in linear light, {:.1f} dB inside of the outlines; the worst to "
      "{:.1f} dB ({})",
      result.pictures.size(), capture ? "photographs of the capture" : "stored photographs",
      pooled.psnrLinear(), evaluation::psnr(pooledInside.mean()), worst.psnrLinearDb,
      photographName(worst.camera, worst.light));
  finding += fmt::format("; the worst camera is {} with {:.1f} dB", least(ofView)->first,
                         least(ofView)->second.psnrLinear());
  if (!ofLight.empty())
    finding += fmt::format(", the worst light {} with {:.1f} dB", least(ofLight)->first,
                           least(ofLight)->second.psnrLinear());
  result.checks.push_back(judged("exact_pictures", pooled.psnrLinear(), bounds, std::move(finding)));
  return result;
}

} // namespace surflect::verify
