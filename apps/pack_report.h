// Options and reports shared by `pack` and `capture --pack`.
#pragma once

#include "apps/command.h"
#include "apps/option_values.h"
#include "srf/model/pack.h"

#include <string>

namespace surflect {

inline std::vector<CLI::Option*> addStoreOptions(CLI::App& command, model::PackOptions& options) {
  return {command.add_option("--tolerance", options.tolerance, "relative error of every block")
              ->capture_default_str()
              ->check(finiteIn(0, 1)),
          command.add_option("--surfels", options.surfels, "how many, about; default: two across a pixel")
              ->check(CLI::Range(size_t{1}, size_t{100000000})),
          command.add_flag("--opaque", options.opaque,
                           "take alpha as a mask, even if many pixels are translucent"),
          command.add_flag(
              "--overwrite", options.overwrite,
              "replace a finished model of another capture, geometry, tolerance or version of surflect")};
}

void announceEstimate(const model::PackEstimate& estimate);
void announce(const model::PackReport& report, const std::string& output);
Json jsonOf(const model::PackReport& report);

} // namespace surflect
