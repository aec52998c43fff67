#include "render/lightfield/common/relight.h"

#include "srf/capture/origin.h"
#include "srf/capture/photograph.h"
#include "srf/capture/writer.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "srf/weights/environment_map.h"
#include "srf/weights/light_blend.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace surflect::lightfield {

namespace {

using Towards = Direction3<AcquisitionSpace, double>;
using Place = Point3<AcquisitionSpace, double>;

// Captured lights as seen from the object's middle.
struct LightsSeen {
  std::vector<Towards> towards; // unit
  std::vector<Rgb> irradiance;
};

LightsSeen lightsFrom(std::span<const capture::Light> lights, const Place& middle) {
  LightsSeen seen;
  for (const capture::Light& light : lights) {
    seen.towards.push_back(capture::towardsLight(light, middle));
    seen.irradiance.push_back(capture::irradianceAt(light, middle));
  }
  return seen;
}

// Index of the captured light in this direction.
std::optional<size_t> lightAt(std::span<const Towards> lights, const Towards& towards) {
  constexpr double kSameLight = 0.5e-10; // penalty of 1e-5 radians
  const size_t nearest = nearestLight(lights, towards);
  if (weights::anglePenalty(lights[nearest], towards) > kSameLight) return std::nullopt;
  return nearest;
}

// Irradiance that each captured light stands for, E_l.
std::vector<Rgb> assignedIrradiance(const LightsSeen& seen, const capture::Light& light,
                                    weights::LightExtrapolation extrapolation, const Place& middle) {
  std::vector<Rgb> assigned(seen.towards.size());
  const Towards towards = capture::towardsLight(light, middle);
  const Rgb irradiance = capture::irradianceAt(light, middle);
  if (const auto same = lightAt(seen.towards, towards)) {
    assigned[*same] = irradiance;
    return assigned;
  }
  std::vector<Direction3<AcquisitionSpace>> rounded;
  for (const Towards& captured : seen.towards) rounded.push_back(captured.cast<float>());
  const weights::LightExtrapolationFade coverage(seen.towards);
  for (const auto& [l, weight] :
       weights::blendOfLights(rounded, towards.cast<float>(), {}, coverage, extrapolation))
    assigned[l] = weight * irradiance;
  return assigned;
}

// Sum of the irradiance of all texels that are nearest to each captured light.
std::vector<Rgb>
irradianceByNearestLight(std::span<const Towards> lights, const weights::EnvironmentMap& environment,
                         const Rotation<AcquisitionSpace, EnvironmentSpace>& acquisitionFromEnvironment,
                         const Progress& progress) {
  const std::vector<weights::EnvironmentLight>& texels = environment.lights;
  std::vector<uint32_t> nearest(texels.size());
  const Mat3<double> rotation = acquisitionFromEnvironment.matrix();
  tbb::parallel_for(size_t{0}, texels.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    const auto towards = assume<Towards>(rotation * texels[i].towards.raw().cast<double>());
    nearest[i] = static_cast<uint32_t>(nearestLight(lights, towards));
  });
  std::vector<Vec3<double>> sums(lights.size(), Vec3<double>::Zero()); // in double, for millions of texels
  for (size_t i = 0; i < texels.size(); ++i)
    sums[nearest[i]] += Vec3<double>(texels[i].irradiance.r, texels[i].irradiance.g, texels[i].irradiance.b);
  std::vector<Rgb> irradiance;
  for (const Vec3<double>& sum : sums)
    irradiance.push_back(
        {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])});
  return irradiance;
}

Rgb dividedBy(const Rgb& a, const Rgb& b) { return {a.r / b.r, a.g / b.g, a.b / b.b}; }

// Assigns the irradiance of one light of a shot.
struct Assigning {
  const LightsSeen& seen;
  const Place& middle;
  const Progress& progress;

  std::vector<Rgb> operator()(const scene::ShotDirectionalLight& light) const {
    const capture::DirectionalLight kind{assume<Towards>(light.towards.raw()), light.irradiance,
                                         light.irradianceGradient};
    return assignedIrradiance(seen, {{}, {}, kind}, light.extrapolation, middle);
  }
  std::vector<Rgb> operator()(const scene::ShotPointLight& light) const {
    const capture::PointLight kind{assume<Place>(light.position.raw()), light.intensity};
    return assignedIrradiance(seen, {{}, {}, kind}, light.extrapolation, middle);
  }
  std::vector<Rgb> operator()(const scene::ShotEnvironment& light) const {
    const Rotation<AcquisitionSpace, EnvironmentSpace> acquisitionFromEnvironment(
        light.objectFromEnvironment.matrix());
    std::vector<Rgb> assigned =
        irradianceByNearestLight(seen.towards, *light.map, acquisitionFromEnvironment, progress);
    for (Rgb& irradiance : assigned) irradiance = light.strength * irradiance;
    return assigned;
  }
};

} // namespace

size_t nearestLight(std::span<const Direction3<AcquisitionSpace, double>> lights,
                    const Direction3<AcquisitionSpace, double>& towards) {
  assert(!lights.empty());
  size_t nearest = 0;
  for (size_t l = 1; l < lights.size(); ++l)
    if (dot(lights[l], towards) > dot(lights[nearest], towards)) nearest = l;
  return nearest;
}

std::vector<Rgb> photographWeights(std::span<const capture::Light> captured,
                                   const Point3<AcquisitionSpace, double>& middle,
                                   std::span<const scene::ShotLight> lights, const Progress& progress) {
  const LightsSeen seen = lightsFrom(captured, middle);
  std::vector<Rgb> weights(captured.size());
  for (size_t i = 0; i < lights.size(); ++i) {
    const std::vector<Rgb> assigned = std::visit(Assigning{seen, middle, progress}, lights[i]);
    for (size_t l = 0; l < captured.size(); ++l) {
      weights[l] = weights[l] + dividedBy(assigned[l], seen.irradiance[l]);
      for (const float weight : {weights[l].r, weights[l].g, weights[l].b})
        if (!std::isfinite(weight))
          throw Error::mismatch("a finite number", numberText(weight))
              .at(fmt::format("light[{}]: weight of captured light {}", i, captured[l].name));
    }
  }
  return weights;
}

capture::Photograph weightedSum(std::span<const capture::Photograph> photographs,
                                std::span<const Rgb> weights) {
  assert(!photographs.empty() && photographs.size() == weights.size());
  const int width = photographs[0].alpha.width, height = photographs[0].alpha.height;
  capture::Photograph sum{image::Image(width, height, 3), image::Image(width, height, 1)};
  for (const capture::Photograph& photograph : photographs) {
    assert(photograph.alpha.width == width && photograph.alpha.height == height);
    sum.hasMatte |= photograph.hasMatte;
  }
  tbb::parallel_for(0, height, [&](int row) {
    const size_t begin = static_cast<size_t>(row) * static_cast<size_t>(width);
    for (size_t i = begin; i < begin + static_cast<size_t>(width); ++i) {
      float& alpha = sum.alpha.values[i];
      for (const capture::Photograph& photograph : photographs)
        alpha = std::max(alpha, photograph.alpha.values[i]);
      if (!(alpha > 0)) continue;
      std::array<double, 3> color{};
      for (size_t p = 0; p < photographs.size(); ++p) {
        const double share = double{photographs[p].alpha.values[i]} / alpha; // 1 where all alphas are equal
        const float* radiance = &photographs[p].radiance.values[3 * i];
        color[0] += share * (double{weights[p].r} * radiance[0]);
        color[1] += share * (double{weights[p].g} * radiance[1]);
        color[2] += share * (double{weights[p].b} * radiance[2]);
      }
      for (size_t c = 0; c < 3; ++c) sum.radiance.values[3 * i + c] = static_cast<float>(color[c]);
    }
  });
  return sum;
}

namespace fs = std::filesystem;

namespace {

constexpr int kPictureFormat = 1; // version of how pictures are computed and written

// First frame of a view under a light, training before test; by view and light.
using FrameTable = std::map<std::pair<size_t, size_t>, size_t>;

FrameTable framesByViewAndLight(const capture::Capture& capture) {
  FrameTable table;
  for (const capture::Split split : {capture::Split::train, capture::Split::test})
    for (size_t f = 0; f < capture.frames.size(); ++f)
      if (const capture::Frame& frame = capture.frames[f]; frame.split == split)
        table.try_emplace({frame.view, *frame.light}, f);
  return table;
}

// Lights of training frames, or of all frames where none is for training.
std::vector<size_t> trainingLights(const capture::Capture& capture) {
  std::set<size_t> training, all;
  for (const capture::Frame& frame : capture.frames) {
    all.insert(*frame.light);
    if (frame.split == capture::Split::train) training.insert(*frame.light);
  }
  const std::set<size_t>& chosen = training.empty() ? all : training;
  return {chosen.begin(), chosen.end()};
}

// Lights of which every view has a photograph.
std::vector<size_t> commonLights(const capture::Capture& capture, const FrameTable& frames,
                                 std::vector<size_t> lights) {
  std::erase_if(lights, [&](size_t light) {
    for (size_t view = 0; view < capture.views.size(); ++view)
      if (!frames.contains({view, light})) return true;
    return false;
  });
  return lights;
}

Point3<AcquisitionSpace, double> middleOfObject(const capture::Capture& capture, const Progress& progress) {
  if (capture.geometry.empty())
    return capture::middleOfScene(capture).value_or(Point3<AcquisitionSpace, double>(0, 0, 0));
  const TriangleMesh mesh =
      readMesh(capture.folder() / capture.geometry, {Faces::cut, capture.origin}, progress);
  return middleOf(mesh.positions);
}

// File name for each view: its name where that is plain and the first of its kind, else with a number.
std::vector<std::string> fileNames(const capture::Capture& capture) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const capture::View& view : capture.views) {
    std::string name = fs::path(view.identity).stem().string().substr(0, 100);
    for (char& c : name)
      if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_') c = '_';
    if (name.empty() || !taken.insert(name).second)
      while (!taken.insert(name = fmt::format("{}_{}", name, names.size())).second) continue;
    names.push_back(name);
  }
  return names;
}

Error missingPhotograph(const capture::Capture& capture, size_t view, const std::string& light,
                        const FrameTable& frames, const std::vector<size_t>& lights) {
  const auto isComplete = [&](size_t v) {
    return std::ranges::all_of(lights, [&](size_t l) { return frames.contains({v, l}); });
  };
  size_t incomplete = 0;
  for (size_t v = 0; v < capture.views.size(); ++v) incomplete += !isComplete(v);
  return Error(fmt::format("no photograph under light {} ({} of {} views lack one; --skip-incomplete leaves "
                           "them out, --common-lights uses the {} lights that all views have)",
                           light, incomplete, capture.views.size(),
                           commonLights(capture, frames, trainingLights(capture)).size()))
      .at("view " + capture.views[view].identity)
      .in(capture.file);
}

// States the capture, its files and the plan, so that views of different runs are never mixed.
FolderIdentity identityOf(const capture::Capture& capture, const RelightPlan& plan) {
  std::string text =
      capture::captureText(capture, capture.folder()) + capture::captureText(plan.views, capture.folder());
  for (size_t l = 0; l < plan.lights.size(); ++l)
    text += fmt::format("{} {} {} {}\n", plan.lights[l].name, plan.weights[l].r, plan.weights[l].g,
                        plan.weights[l].b);
  std::set<fs::path> files;
  if (!capture.geometry.empty()) files.insert(capture.geometry);
  for (const std::vector<size_t>& photographs : plan.photographs)
    for (const size_t f : photographs) {
      for (const capture::Exposure& shot : capture::bracketOf(capture.frames[f])) files.insert(shot.picture);
      if (!capture.frames[f].mask.empty()) files.insert(capture.frames[f].mask);
    }
  for (const fs::path& file : files) {
    const fs::path path = capture.folder() / file;
    text += fmt::format("{} {} {}\n", file.string(), fs::file_size(path),
                        fs::last_write_time(path).time_since_epoch().count());
  }
  return {"relight.identity",
          fmt::format("relight {} {:016x}\n", kPictureFormat, contentHash(std::as_bytes(std::span(text)))),
          "has views of other lights, or of another capture"};
}

// Returns whether the view's picture exists. Files appear complete, so checking the header is enough.
bool isFinished(const fs::path& picture) {
  try {
    if (!fs::exists(picture)) return false;
    const image::ExrFile header(picture);
    return true;
  } catch (const Error&) {
    return false;
  }
}

bool hasSingleFloats(const capture::Capture& capture, std::span<const size_t> frames) {
  std::map<fs::path, std::vector<std::string>> layers;
  for (const size_t f : frames)
    for (const capture::Exposure& shot : capture::bracketOf(capture.frames[f]))
      layers[shot.picture].push_back(shot.layer);
  return std::ranges::any_of(layers, [&](const auto& entry) {
    const fs::path path = capture.folder() / entry.first;
    if (image::formatOf(path) != image::PictureFormat::exr) return false;
    const image::ExrFile file(path);
    return std::ranges::any_of(entry.second, [&](const std::string& layer) {
      return std::ranges::any_of(image::colorChannels(file, layer), [&](const std::string& channel) {
        return file.precision(channel) == image::Precision::single;
      });
    });
  });
}

image::Precision precisionFor(const capture::Capture& capture, std::span<const size_t> frames,
                              const capture::Photograph& sum) {
  const auto fits = [](float value) { return std::abs(value) <= weights::kLargestHalf; };
  return hasSingleFloats(capture, frames) || !std::ranges::all_of(sum.radiance.values, fits)
             ? image::Precision::single
             : image::Precision::half;
}

} // namespace

RelightPlan planRelight(const capture::Capture& capture, std::span<const scene::ShotLight> lights,
                        Incomplete incomplete, const Progress& progress) {
  if (capture.lights.empty() || !capture.frames[0].light)
    throw Error("missing; photographs under fixed light cannot be relit").at("lights").in(capture.file);
  const FrameTable frames = framesByViewAndLight(capture);
  std::vector<size_t> candidates = trainingLights(capture);
  if (incomplete == Incomplete::common) candidates = commonLights(capture, frames, std::move(candidates));
  if (candidates.empty())
    throw Error::mismatch("one of which every view has a photograph", "no light")
        .at("lights")
        .in(capture.file);

  RelightPlan plan;
  std::vector<capture::Light> captured;
  for (const size_t light : candidates) captured.push_back(capture.lights[light]);
  const std::vector<Rgb> weights =
      photographWeights(captured, middleOfObject(capture, progress), lights, progress);
  std::vector<size_t> used;
  for (size_t l = 0; l < candidates.size(); ++l)
    if (weights[l] != Rgb{}) {
      used.push_back(candidates[l]);
      plan.lights.push_back(captured[l]);
      plan.weights.push_back(weights[l]);
    }
  if (used.empty()) throw Error("the lights add up to darkness");

  plan.views.file = capture.file;
  plan.views.colorSpace = capture::ColorSpace::linear;
  plan.views.origin = capture.origin;
  if (!capture.geometry.empty()) plan.views.geometry = "mesh" + capture.geometry.extension().string();
  const std::vector<std::string> names = fileNames(capture);
  for (size_t view = 0; view < capture.views.size(); ++view) {
    std::vector<size_t> photographs;
    capture::Frame relit;
    relit.view = plan.views.views.size();
    relit.picture = fs::path("images") / (names[view] + ".exr");
    for (const size_t light : used) {
      const auto found = frames.find({view, light});
      if (found == frames.end()) {
        if (incomplete == Incomplete::refused)
          throw missingPhotograph(capture, view, capture.lights[light].name, frames, used);
        break;
      }
      photographs.push_back(found->second);
      if (capture.frames[found->second].split == capture::Split::test) relit.split = capture::Split::test;
    }
    if (photographs.size() < used.size()) {
      plan.skipped.push_back(capture.views[view].identity);
      continue;
    }
    plan.views.views.push_back(capture.views[view]);
    plan.views.frames.push_back(relit);
    plan.photographs.push_back(std::move(photographs));
  }
  if (plan.photographs.empty())
    throw Error(fmt::format("each of the {} views lacks a photograph under some light", plan.skipped.size()))
        .in(capture.file);
  return plan;
}

RelightReport relight(const capture::Capture& capture, const RelightPlan& plan, const fs::path& folder,
                      const Progress& progress) {
  const FolderIdentity identity = identityOf(capture, plan);
  requireResumable(folder, identity);
  RelightReport report;
  std::vector<size_t> missing;
  for (size_t view = 0; view < plan.photographs.size(); ++view)
    if (!isFinished(folder / plan.views.frames[view].picture)) missing.push_back(view);
  report.resumedViews = plan.photographs.size() - missing.size();
  claimFolder(folder, identity);
  for (size_t i = 0; i < missing.size(); ++i) {
    const Progress ofView = stepOf(progress, "relighting", i, missing.size());
    const std::vector<size_t>& frames = plan.photographs[missing[i]];
    const std::vector<capture::Photograph> photographs = capture::readPhotographs(capture, frames, ofView);
    for (const capture::Photograph& photograph : photographs)
      report.invalidTexels += photograph.invalidTexels.size();
    const capture::Photograph sum = weightedSum(photographs, plan.weights);
    const std::array layers = {capture::RadianceLayer{"", &sum.radiance}};
    capture::writeViewPictures(folder / plan.views.frames[missing[i]].picture, layers,
                               sum.hasMatte ? &sum.alpha : nullptr, "", precisionFor(capture, frames, sum),
                               ofView);
  }
  if (!plan.views.geometry.empty() && !fs::exists(folder / plan.views.geometry))
    writeFileAtomically(folder / plan.views.geometry,
                        readFile(capture.folder() / capture.geometry, kLargestFile, progress));
  capture::writeCapture(plan.views, folder);
  progress("relighting", 1);
  return report;
}

} // namespace surflect::lightfield
