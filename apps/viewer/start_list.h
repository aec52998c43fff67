// The start list: what a viewer was started with, and all that its pages may name.
#pragma once

#include "apps/viewer/description.h"
#include "apps/viewer/photographs.h"
#include "apps/viewer/shot_document.h"
#include "render/method/renderer.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace surflect::viewer {

struct ViewerInput {
  // Models, that of the script first; or a capture alone.
  std::vector<std::filesystem::path> models;
  std::optional<capture::Capture> capture;
  std::filesystem::path script;    // or empty
  std::filesystem::path snapshots; // folder of snapshots and films; made when the first one is written
  std::vector<std::filesystem::path> environments; // pictures that lights may use
  method::Setting setting;                         // of the models, given on the command line
};

struct StartList {
  struct Environment {
    std::string name;  // for people
    std::string image; // as lights of the script name it
  };

  // At least one: the models, or the capture alone.
  std::vector<std::unique_ptr<DescribedModel>> models;
  // By model; null where the capture is another object's, or there is none.
  std::vector<std::unique_ptr<Photographs>> photographs;
  std::vector<Environment> environments;
  std::unique_ptr<ShotDocument> document; // the script, or one made for the first model
};

// Opens each model once, to describe it. Throws Error as openRenderer() and ShotDocument do, for a script in
// original coordinates, which pages do not know, and Cancelled.
StartList openStartList(const ViewerInput& input, const Progress& progress);

} // namespace surflect::viewer
