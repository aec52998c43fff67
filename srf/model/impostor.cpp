#include "srf/model/impostor.h"

#include "surfel/error.h"

namespace surflect {

Impostor impostorOf(const Capture& training, const ImpostorOptions& options, const Progress& progress) {
  progress("geometry", 0);
  if (!options.mesh.empty()) return {readMesh(options.mesh), Impostor::Origin::given};
  if (training.geometry.empty())
    throw Error("no geometry in the capture, and no --mesh given").in(training.file);
  return {readMesh(training.folder() / training.geometry), Impostor::Origin::given};
}

} // namespace surflect
