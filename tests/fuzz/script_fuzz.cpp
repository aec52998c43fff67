#include "render/scene/shot.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz(std::string_view input) {
  const Script script = parseScript(input, "film.toml");
  requireShot(script);
  for (const double frame : {double(script.frames->first), double(script.frames->last)}) {
    const ShotTime time = shotTime(script, frame);
    if (!std::holds_alternative<NamedCamera>(*script.camera)) cameraAt(script, time);
    lightsAt(script, time);
    warpAt(script, time)->position({0.1, -0.2, 0.3});
    framePath(*script.output, "frames", script.frames->last);
  }
}
