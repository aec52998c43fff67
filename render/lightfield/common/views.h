// Input of every light-field renderer: a triangle mesh and calibrated RGBA views under fixed light.
#pragma once

#include "render/method/method.h"
#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/proxy/impostor.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace surflect::lightfield {

struct ViewsOptions {
  std::filesystem::path mesh = {}; // replaces the capture's geometry; or empty
  capture::PathRule paths = capture::PathRule::inside;
  bool plainPinholes = false; // refuses distorted and orthographic lenses
};

// Capture of a folder, with the lights that its frames name. Throws Error for several lights, and for a lens
// that the options refuse; as readCapture() does.
capture::Capture fixedLightCapture(const std::filesystem::path& folder, const ViewsOptions& options);

// Views of a capture folder under fixed light or a single light: poses and mesh in memory, pictures on disk.
class Views {
public:
  // Throws Error for a capture with several lights or without training views, and for a lens that the options
  // refuse; as readCapture() and impostorOf() do; and Cancelled.
  explicit Views(const std::filesystem::path& folder, const ViewsOptions& options = {},
                 const Progress& progress = {});
  // Views of a capture that fixedLightCapture() has read; `mesh` replaces its geometry, or is empty.
  Views(capture::Capture capture, const std::filesystem::path& mesh, const Progress& progress);

  // Geometry by the training views, as pack makes it: a mesh file, repaired, or a visual hull.
  const proxy::Impostor& geometry() const { return geometry_; }
  const TriangleMesh& mesh() const { return geometry_.mesh; } // in acquisition space
  const RayCaster<AcquisitionSpace>& rays() const { return *rays_; }
  // Replaces the mesh, which must show the same object. Throws Error where it does not fit into memory.
  void replaceMesh(TriangleMesh mesh, const Progress& progress = {});
  const capture::Capture& capture() const { return capture_; }

  // Number of views; one for each photograph, in the order of the capture.
  size_t size() const { return capture_.frames.size(); }
  const std::string& name(size_t view) const { return placeOf(view).identity; }
  const capture::Camera<AcquisitionSpace>& camera(size_t view) const { return placeOf(view).camera; }
  // Held-out views are for comparison only: a renderer must not be built from them.
  capture::Split split(size_t view) const { return capture_.frames[view].split; }
  std::filesystem::path picture(size_t view) const {
    return capture_.folder() / capture_.frames[view].picture;
  }
  // Indices of the views of a split.
  std::vector<size_t> ofSplit(capture::Split split) const;

  // Reads a view from disk: linear RGBA, premultiplied. Without matte or mask, alpha is the silhouette of the
  // mesh. Colours are NaN where the picture has one that is NaN or infinite. May be called from several
  // threads. Throws Error and Cancelled.
  image::Image read(size_t view, const Progress& progress = {}) const;

private:
  const capture::View& placeOf(size_t view) const { return capture_.views[capture_.frames[view].view]; }

  capture::Capture capture_;
  proxy::Impostor geometry_;
  std::unique_ptr<const RayCaster<AcquisitionSpace>> rays_;
};

// Input of a builder, and the parts of its report that all builders share.

// Views of a build's source, after the output folder has been found fit and the capture has been checked,
// each of its mattes too; says how capture and mesh were understood. Throws Error as
// requireLightFieldFolder(), Views and the taking of findings do.
Views viewsOf(const method::BuildInput& input, const Progress& progress, bool plainPinholes = false);

// Says how much memory a build will take for something, if that is 1 GiB or more.
void foretellMemory(const method::BuildInput& input, double bytes, const std::string& what);

// "1.5 MiB"
std::string mebibytes(uint64_t bytes);
// Bytes of the training views' pictures.
uint64_t pictureBytes(const Views& views);
// `whole` / `part`; 0 if `part` is 0.
double ratioOf(uint64_t whole, uint64_t part);

} // namespace surflect::lightfield
