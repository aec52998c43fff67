// Opening of a shot: a script and its model, or a model alone, which a turn-table shows.
#pragma once

#include "render/method/renderer.h"
#include "render/scene/script.h"

#include <filesystem>
#include <functional>
#include <string>

namespace surflect {

// The command line's names of script and model.
struct ShotNames {
  std::string script; // or a model
  std::string model;  // another than the script's; may be empty
};

// Returns the script of a shot, with its models. `check` refuses what the command cannot do, and `open` opens
// the model; it returns its description, which must live until openShot returns. A script is read before its
// model is opened, so that a mistake is told at once; one in original coordinates needs the model, and then
// `check` gets an empty script. The script of a model alone is checked last. Throws Error, and UsageError for
// a second model.
scene::Script openShot(const ShotNames& names,
                       const std::function<void(const scene::ScriptHead&, const scene::Script&)>& check,
                       const std::function<const method::Description&(const scene::ScriptHead&)>& open);

} // namespace surflect
