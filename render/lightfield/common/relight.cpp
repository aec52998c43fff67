#include "render/lightfield/common/relight.h"

#include "render/lightfield/common/photograph_weights.h"
#include "srf/capture/origin.h"
#include "srf/capture/photograph.h"
#include "srf/capture/writer.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "srf/weights/environment_map.h"
#include "surfel/base/file.h"
#include "surfel/base/hash.h"
#include "surfel/base/resumable_folder.h"
#include "surfel/base/step_progress.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace surflect::lightfield {

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
