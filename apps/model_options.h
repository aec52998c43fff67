// Options that the commands which render a model share.
#pragma once

#include "apps/command.h"
#include "apps/option_values.h"
#include "render/knobs/knob.h"
#include "render/renderer.h"
#include "srf/ulr/ulr.h"
#include "surfel/base/error.h"
#include "surfel/base/message_text.h"
#include "surfel/math/simd.h"

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace surflect {

inline void addModelOptions(CLI::App& command, render::RendererOptions& options) {
  const auto blended = CLI::Range(size_t{1}, ulr::kMaxBlended);
  command.add_option("--cameras", options.cameras, "cameras blended per surfel")
      ->capture_default_str()
      ->check(blended);
  command
      .add_option("--lights", options.lights,
                  "captured lights blended per light of the script; default: the model's")
      ->check(blended);
  command
      .add_option("--light-fit", options.lightFit,
                  "mean or plane of the blended lights; default: the model's")
      ->option_text("mean or plane")
      ->transform(CLI::Transformer(std::map<std::string, ulr::LightFit>{{"mean", ulr::LightFit::mean},
                                                                        {"plane", ulr::LightFit::plane}}));
  command
      .add_option("--foreshortening", options.foreshortened,
                  "scale blended lights by their cosines to the surface; default: the model's")
      ->option_text("on or off")
      ->transform(CLI::Transformer(std::map<std::string, bool>{{"on", true}, {"off", false}}));
  command
      .add_option(
          "--interpolation", options.interpolation,
          "how photographs are weighted: by cameras and lights apart (paper: as published), or by pairs of "
          "them; default: the model's")
      ->option_text("paper, separate, pairs or kriging")
      ->transform(CLI::Transformer(
          std::map<std::string, ulr::Interpolation>{{"paper", ulr::Interpolation::paper},
                                                    {"separate", ulr::Interpolation::separate},
                                                    {"pairs", ulr::Interpolation::pairs},
                                                    {"kriging", ulr::Interpolation::kriging}}));
  command
      .add_option("--reciprocity", options.reciprocal,
                  "under kriging, let photographs also answer for camera and light exchanged; default: the "
                  "model's")
      ->option_text("on or off")
      ->transform(CLI::Transformer(std::map<std::string, bool>{{"on", true}, {"off", false}}));
  command
      .add_option("--shadows", options.shadows,
                  "under pairs and kriging, find shadows by rays; lit photographs then show lit surfels, and "
                  "shadowed ones shadow; default: the model's")
      ->option_text("on or off")
      ->transform(CLI::Transformer(std::map<std::string, bool>{{"on", true}, {"off", false}}));
  command
      .add_option("--pairs", options.pairs,
                  "camera-light pairs blended under pairs or kriging, and where not all were captured; "
                  "default: 6 under kriging, else 4")
      ->check(blended);
  command.add_option("--low-pass", options.lowPass, "least standard deviation of a splat, pixels")
      ->capture_default_str()
      ->check(finiteIn(0, 10));
  command
      .add_option_function<size_t>(
          "--cache-mb", [&options](size_t megabytes) { options.cacheBytes = megabytes << 20; },
          "memory for decoded blocks or textures")
      ->default_str("1024")
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

// Adds --knob, which may be given several times; `take` receives each and may throw Error. A malformed value
// is a usage error; a knob that the renderer lacks is found when the model is open.
inline CLI::Option* addKnobValuesOption(CLI::App& command,
                                        const std::function<void(const knobs::KnobValues&)>& take,
                                        const std::string& meaning) {
  return command
      .add_option_function<std::vector<std::string>>(
          "--knob",
          [take](const std::vector<std::string>& texts) {
            try {
              for (const std::string& text : texts) take(knobs::parseKnobValues(text));
            } catch (const Error& error) {
              throw CLI::ValidationError(error.what());
            }
          },
          meaning)
      ->allow_extra_args(false);
}

// Adds --knob NAME=VALUE; the last value of a knob counts.
inline CLI::Option* addKnobOption(CLI::App& command, knobs::Setting& setting) {
  return addKnobValuesOption(
             command,
             [&setting](const knobs::KnobValues& knob) {
               if (knob.values.size() != 1)
                 throw Error::mismatch("one value", counted(knob.values.size(), "value"))
                     .at(knob.name)
                     .at("--knob");
               setting[knob.name] = knob.values[0];
             },
             "accuracy against speed, such as surfel_size=1; default: the most accurate")
      ->option_text("NAME=VALUE ...");
}

} // namespace surflect
