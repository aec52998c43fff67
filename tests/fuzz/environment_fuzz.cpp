#include "srf/weights/environment_map.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <cmath>
#include <cstdlib>

namespace {

// Requirements on a light that is used for shading, for any picture.
void requireLight(const surflect::weights::EnvironmentLight& light) {
  const auto& [r, g, b] = light.irradiance;
  const bool shines = r >= 0 && g >= 0 && b >= 0 && std::isfinite(r) && std::isfinite(g) && std::isfinite(b);
  if (!shines || std::abs(light.towards.raw().norm() - 1) > 1e-3f) std::abort();
}

} // namespace

// The first character says of what format and what mapping.
void surflect::fuzz_environment(std::string_view input) {
  static const FuzzFolder folder;
  if (input.empty()) return;
  const auto path = folder / (input[0] & 1 ? "environment.exr" : "environment.hdr");
  const auto content = memoryFile(input.substr(1));
  if (!std::filesystem::is_symlink(path)) std::filesystem::create_symlink(content, path);
  std::optional<weights::EnvironmentMapping> mapping; // else by its shape
  if (input[0] & 2)
    mapping = input[0] & 8   ? weights::EnvironmentMapping::mirrorBall
              : input[0] & 4 ? weights::EnvironmentMapping::angular
                             : weights::EnvironmentMapping::latLong;
  const weights::EnvironmentMap map = weights::readEnvironment(path, mapping);
  for (const weights::EnvironmentLight& light : map.lights) requireLight(light);
  for (const weights::EnvironmentLight& light : weights::clusteredLights(map.lights, 0.01))
    requireLight(light);
}
