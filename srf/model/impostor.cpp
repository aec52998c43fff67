#include "srf/model/impostor.h"

#include "srf/model/one_view.h"
#include "surfel/error.h"

#include <string>

namespace surflect {

Impostor impostorOf(const Capture& training, const ImpostorOptions& options, const Progress& progress) {
  progress("geometry", 0);
  if (options.relief && training.views.size() != 1)
    throw Error::mismatch("one view, for a relief", std::to_string(training.views.size())).in(training.file);
  if (options.relief) return {meshOfOneView(training, true, progress), Impostor::Origin::relief};
  if (!options.mesh.empty()) return {readMesh(options.mesh), Impostor::Origin::given};
  if (!training.geometry.empty())
    return {readMesh(training.folder() / training.geometry), Impostor::Origin::given};
  if (training.views.size() == 1) return {meshOfOneView(training, false, progress), Impostor::Origin::plane};
  throw Error("no geometry in the capture, and no --mesh given").in(training.file);
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

} // namespace surflect
