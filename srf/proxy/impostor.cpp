#include "srf/proxy/impostor.h"

#include "srf/capture/mask_file.h"
#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "srf/proxy/hull/mattes.h"
#include "srf/proxy/hull/visual_hull.h"
#include "srf/proxy/mesh/mesh_mending.h"
#include "srf/proxy/relief/photometric.h"
#include "srf/proxy/relief/relief.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"
#include "surfel/geometry/ray_caster.h"

#include <algorithm>
#include <cassert>
#include <filesystem>
#include <numeric>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace surflect::proxy {

int reliefShrink(const capture::Lens& lens) {
  constexpr double kMostPixels = 4e6;
  int shrink = 1;
  while (shrink < 8 && 1.0 * lens.width * lens.height > kMostPixels * shrink * shrink) shrink *= 2;
  return shrink;
}

Impostor impostorOfOneView(const capture::Capture& training, bool asRelief, const Progress& progress) {
  assert(training.views.size() == 1);
  capture::Camera<AcquisitionSpace> camera = training.views[0].camera;
  std::vector<size_t> frames(training.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  std::optional<image::Image> matte = capture::readViewMatte(training, frames, progress);
  TriangleMesh mesh;
  if (asRelief) {
    const capture::ViewPart part{.shrink = reliefShrink(camera.lens), .matte = matte ? &*matte : nullptr};
    const capture::ViewPhotographs photographs = capture::readViewPart(training, frames, part, progress);
    const image::Mask mask = image::objectMask(photographs.alpha);
    camera.lens = capture::shrunk(camera.lens, part.shrink);
    std::vector<capture::Light> lights;
    for (const capture::Frame& frame : training.frames)
      if (frame.light) lights.push_back(training.lights[*frame.light]);
    if (lights.empty()) throw Error("fixed illumination: it does not tell a relief").in(training.file);
    try {
      const relief::LambertImage fits =
          relief::fitLambert(camera, lights, photographs.radiance, mask, progress);
      mesh = relief::reliefMesh(camera, relief::integrateNormals(camera, fits.normal, mask, progress));
    } catch (Error& error) {
      throw std::move(error).at("lights").in(training.file);
    }
  } else {
    image::Mask mask(camera.lens.width, camera.lens.height);
    std::ranges::fill(mask.inside, uint8_t{1});
    mesh = relief::planeMesh(camera, matte ? image::objectMask(*matte) : mask);
  }
  if (mesh.triangles.empty()) throw Error("no photograph shows anything of the object").in(training.file);
  return {.mesh = std::move(mesh),
          .origin = asRelief ? Impostor::Origin::relief : Impostor::Origin::plane,
          .matte = std::move(matte)};
}

namespace {

Impostor hullOf(const capture::Capture& training, hull::Silhouette silhouette, const Progress& progress) {
  const std::vector<hull::SilhouetteView> silhouetteViews =
      hull::silhouetteViewsOf(training, progress, silhouette);
  const auto isEmpty = [](const hull::SilhouetteView& silhouetteView) {
    return silhouetteView.outline.isEmpty();
  };
  if (std::ranges::all_of(silhouetteViews, isEmpty)) { // or there is none
    const auto matte = capture::describeFirstMatte(training);
    const std::string found = !matte
                                  ? "neither geometry nor mattes"
                                  : std::string("no geometry, and mattes that show no ") +
                                        (!silhouetteViews.empty() ? "object (nothing is above half of white)"
                                         : silhouette == hull::Silhouette::touched
                                             ? "background (alpha is above 0 everywhere)"
                                             : "background (nothing is below half of white)") +
                                        "; the first is " + *matte;
    throw Error("several views, but " + found +
                ": give a mesh with --mesh, or masks (surflect import --mask-from makes them)")
        .in(training.file);
  }
  try {
    hull::VisualHull hull = hull::visualHull(silhouetteViews, {}, progress);
    Impostor impostor{std::move(hull.mesh), Impostor::Origin::hull};
    const RayCaster<AcquisitionSpace> caster(impostor.mesh, progress);
    for (size_t i = 0; i < silhouetteViews.size(); ++i) {
      progress.checkpoint();
      const image::Mask outline = image::objectMask(capture::silhouette(silhouetteViews[i].camera, caster));
      impostor.fits.push_back({silhouetteViews[i].name,
                               image::intersectionOverUnion(outline, silhouetteViews[i].outline.mask()),
                               std::ranges::binary_search(hull.leftOut, i)});
    }
    return impostor;
  } catch (Error& error) {
    throw std::move(error).in(training.file);
  }
}

Impostor mendedFile(const std::filesystem::path& path, const capture::Capture& training,
                    const Progress& progress) {
  MendedMesh mesh = readMended(path, training, progress);
  Impostor impostor{std::move(mesh.mesh), Impostor::Origin::given};
  for (const std::string& note : mesh.notes) impostor.notes.push_back(path.string() + ": " + note);
  return impostor;
}

// An impostor of a capture that names no geometry, with a note on meshes that lie beside it.
Impostor withoutMesh(const capture::Capture& training, const Progress& progress) {
  Impostor impostor = training.views.size() == 1 ? impostorOfOneView(training, false, progress)
                                                 : hullOf(training, hull::Silhouette::half, progress);
  if (const auto note = noteOnUnusedMeshes(training)) impostor.notes.push_back(*note);
  return impostor;
}

} // namespace

std::optional<std::string> noteOnUnusedMeshes(const capture::Capture& capture) {
  if (!capture.geometry.empty()) return std::nullopt;
  std::vector<std::string> meshes;
  std::error_code failure; // a folder that cannot be listed has none
  const std::filesystem::path folder = capture.folder();
  for (std::filesystem::directory_iterator entry(folder.empty() ? "." : folder, failure), last;
       !failure && entry != last; entry.increment(failure)) {
    const std::string extension = lowerCase(entry->path().extension().string());
    std::error_code unknown;
    if ((extension == ".obj" || extension == ".ply") && entry->is_regular_file(unknown))
      meshes.push_back(entry->path().filename().string());
  }
  if (meshes.empty()) return std::nullopt;
  std::ranges::sort(meshes);
  return "geometry: no mesh is named. Beside the capture: " + firstNames(meshes) +
         "; to use one, write \"geometry\": \"NAME\" or give --mesh NAME";
}

Impostor impostorOf(const capture::Capture& training, const ImpostorOptions& options,
                    const Progress& progress) {
  progress("geometry", 0);
  if (options.relief && training.views.size() != 1)
    throw Error::mismatch("one view, for a relief", std::to_string(training.views.size())).in(training.file);
  if (options.relief) return impostorOfOneView(training, true, progress);
  if (options.hull) return hullOf(training, hull::Silhouette::touched, progress);
  if (!options.mesh.empty()) return mendedFile(options.mesh, training, progress);
  if (!training.geometry.empty())
    return mendedFile(training.folder() / training.geometry, training, progress);
  return withoutMesh(training, progress);
}

std::string_view nameOf(Impostor::Origin origin) {
  switch (origin) {
  case Impostor::Origin::given:
    return "mesh";
  case Impostor::Origin::hull:
    return "hull";
  case Impostor::Origin::plane:
    return "plane";
  case Impostor::Origin::relief:
    return "relief";
  }
  return {};
}

} // namespace surflect::proxy
