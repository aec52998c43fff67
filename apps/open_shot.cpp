#include "apps/open_shot.h"

#include "apps/method_options.h"
#include "render/scene/turntable.h"
#include "surfel/base/error.h"

namespace surflect {

scene::Script openShot(const ShotNames& names,
                       const std::function<void(const scene::ScriptHead&, const scene::Script&)>& check,
                       const std::function<const method::Description&(const scene::ScriptHead&)>& open) {
  const std::filesystem::path path = names.script;
  if (std::filesystem::is_directory(path)) {
    if (!names.model.empty()) throw UsageError(Error("is for a script").at("--model"));
    const method::Description& described = open({.model = path});
    const std::string text = scene::turntableScript(
        {std::filesystem::absolute(path).string(), described.rig, described.points, described.isBaked});
    scene::Script script = scene::parseScript(text, path / "turntable.toml");
    check({.model = path, .frames = *script.frames, .output = *script.output}, script);
    return script;
  }
  const scene::ScriptHead head = scene::readScriptHead(path, names.model);
  // Original coordinates need the model's origin.
  const bool isEarly = head.coordinates == scene::Coordinates::model;
  scene::Script script;
  if (isEarly) script = scene::readScript(path);
  check(head, script);
  const method::Description& described = open(head);
  if (!isEarly) script = scene::readScript(path, described.rig.origin);
  script.model = head.model;
  script.objects = head.objects;
  return script;
}

} // namespace surflect
