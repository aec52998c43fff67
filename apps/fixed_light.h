// Views under fixed light, made from a capture: of `relight`, and of `pack` for methods with their light
// baked in.
#pragma once

#include "apps/command.h"
#include "render/lightfield/common/relight.h"
#include "srf/capture/capture.h"
#include "srf/weights/environment_map.h"

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace surflect {

struct FixedLight {
  std::string lights, environment;                    // a file with [[light]], or a map; at most one of them
  std::optional<weights::EnvironmentMapping> mapping; // of the map
  std::array<double, 3> up = {0, 1, 0};
  double frame = 1;
  lightfield::Incomplete incomplete = lightfield::Incomplete::refused;

  bool isGiven() const { return !lights.empty() || !environment.empty(); }
};

// Adds --lights, --environment, --mapping, --up, --frame, --skip-incomplete and --common-lights.
void addFixedLight(CLI::App& command, FixedLight& light, bool isRequired);

// Writes the capture's views under the light, or goes on with writing them; says what it made. Calls `begin`
// when all is known to fit, before anything is written. Throws Error as planRelight() and relight() do.
Json relitViews(
    const capture::Capture& capture, const FixedLight& light, const std::filesystem::path& folder,
    const Progress& progress, const std::function<void()>& begin = [] {});

} // namespace surflect
