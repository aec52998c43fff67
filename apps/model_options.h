// Options that `render` and `evaluate` share.
#pragma once

#include "apps/command.h"
#include "apps/option_values.h"
#include "render/surfels/frame.h"
#include "srf/ulr/ulr.h"
#include "surfel/math/simd.h"

#include <map>
#include <string>
#include <vector>

namespace surflect {

struct ModelOptions {
  surfels::FrameOptions frame;
  size_t cacheMegabytes = 1024;

  size_t cacheBytes() const { return cacheMegabytes << 20; }
};

inline void addModelOptions(CLI::App& command, ModelOptions& options) {
  const auto blended = CLI::Range(size_t{1}, ulr::kMaxBlended);
  command.add_option("--cameras", options.frame.shade.cameras, "cameras blended per surfel")
      ->capture_default_str()
      ->check(blended);
  command
      .add_option("--lights", options.frame.shade.lights,
                  "captured lights blended per light of the script; default: the model's")
      ->check(blended);
  command
      .add_option("--light-fit", options.frame.shade.lightFit,
                  "mean or plane of the blended lights; default: the model's")
      ->option_text("mean or plane")
      ->transform(CLI::Transformer(std::map<std::string, ulr::LightFit>{{"mean", ulr::LightFit::mean},
                                                                        {"plane", ulr::LightFit::plane}}));
  command
      .add_option("--foreshortening", options.frame.shade.foreshortened,
                  "scale blended lights by their cosines to the surface; default: the model's")
      ->option_text("on or off")
      ->transform(CLI::Transformer(std::map<std::string, bool>{{"on", true}, {"off", false}}));
  command
      .add_option("--pairs", options.frame.shade.pairs,
                  "camera-light pairs blended, where not all were captured")
      ->capture_default_str()
      ->check(blended);
  command
      .add_option("--low-pass", options.frame.splats.lowPass, "least standard deviation of a splat, pixels")
      ->capture_default_str()
      ->check(finiteIn(0, 10));
  command.add_option("--cache-mb", options.cacheMegabytes, "memory for decoded blocks")
      ->capture_default_str()
      ->check(CLI::Range(size_t{0}, size_t{1} << 24));
  std::vector<std::string> simd{"auto"};
  for (const Simd supported : supportedSimd()) simd.emplace_back(nameOf(supported));
  command
      .add_option_function<std::string>(
          "--simd",
          [](const std::string& name) {
            for (const Simd supported : supportedSimd())
              if (name == nameOf(supported)) useSimd(supported);
          },
          "vector instructions; default: auto, the best that the processor has")
      ->option_text("auto, scalar, avx2 or avx512")
      ->check(CLI::IsMember(simd));
}

inline Json jsonOf(const shading::ShadingStats& stats) {
  return {{"lookups", stats.lookups},
          {"operations", stats.operations},
          {"lost", stats.lost},
          {"tasks", stats.tasks},
          {"mean_rank",
           stats.tasks ? static_cast<double>(stats.taskRanks) / static_cast<double>(stats.tasks) : 0},
          {"blocks_read", stats.blocksRead},
          {"bytes_read", stats.bytesRead},
          {"cache_hits", stats.cacheHits}};
}

} // namespace surflect
