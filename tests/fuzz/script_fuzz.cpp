#include "render/scene/scene.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_script(std::string_view input) {
  const scene::Script script = scene::parseScript(input, "film.toml");
  scene::requireShot(script);
  for (const double frame : {double(script.frames->first), double(script.frames->last)}) {
    const warp::ShotTime time = scene::shotTime(script, frame);
    if (!std::holds_alternative<scene::NamedCamera>(*script.camera)) scene::cameraAt(script, time);
    scene::lightsAt(script, time);
    scene::warpAt(script, time)->position({0.1, -0.2, 0.3});
    scene::framePath(*script.output, "frames", script.frames->last);
  }
}
