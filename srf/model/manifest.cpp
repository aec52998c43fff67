#include "srf/model/manifest.h"

#include "srf/capture/json_fields.h"
#include "srf/weights/reflectance_field.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace surflect::model {

namespace {

using capture::Json, capture::numberOf, capture::required, capture::shown, capture::textOf;

int versionOf(const Manifest& manifest) {
  if (manifest.gridStep > 0) return kGridVersion;
  if (!manifest.tables.empty()) return kTablesVersion;
  return manifest.alphaChecksums.empty() ? kModelVersion : kAlphaVersion;
}

Json jsonOf(const Manifest& manifest) {
  Json json = {{"format", kSurfelFormat},
               {"version", versionOf(manifest)},
               {"white", manifest.white},
               {"tolerance", manifest.tolerance},
               {"light_blend",
                {{"lights", manifest.lightBlend.lights},
                 {"fit", weights::nameOf(manifest.lightBlend.fit)},
                 {"foreshortened", manifest.lightBlend.foreshortened}}},
               {"interpolation",
                {{"kind", weights::nameOf(manifest.interpolation.kind)},
                 {"half_scale", std::round(manifest.interpolation.halfScale * 1e4) / 1e4},
                 {"reciprocal", manifest.interpolation.reciprocal},
                 {"shadows", manifest.interpolation.shadows}}},
               {"surfels", manifest.surfels},
               {"views", manifest.views},
               {"lights", manifest.lights},
               {"view_files", "views/NNNN.srfb, by index of the view in transforms.json"},
               {"checksums",
                {{"transforms.json", manifest.rig},
                 {"surfels.ply", manifest.cloud},
                 {"fades.bin", manifest.visibility}}},
               {"view_checksums", manifest.viewChecksums}};
  if (manifest.interpolation.kind == weights::Interpolation::shared)
    json["interpolation"]["otherwise"] = weights::nameOf(manifest.interpolation.otherwise);
  if (manifest.gridStep > 0) json["grid_step"] = manifest.gridStep;
  if (!manifest.levels.empty()) json["checksums"]["levels.bin"] = manifest.levels;
  if (!manifest.shadows.empty()) json["checksums"]["shadows.bin"] = manifest.shadows;
  if (!manifest.tables.empty()) json["checksums"]["tables.bin"] = manifest.tables;
  if (!manifest.alphaChecksums.empty()) json["alpha_checksums"] = manifest.alphaChecksums;
  return json;
}

size_t countOf(const Json& value) {
  if (!value.is_number_unsigned()) throw Error::mismatch("a count", shown(value));
  return value.get<size_t>();
}

bool flagOf(const Json& value) {
  if (!value.is_boolean()) throw Error::mismatch("true or false", shown(value));
  return value.get<bool>();
}

int gridStepOf(const Json& value) {
  for (const int step : {1, 2, 4, weights::kCoarsestGrid})
    if (value == step) return step;
  throw Error::mismatch("1, 2, 4 or 8", shown(value));
}

std::vector<std::string> textsOf(const Json& value) {
  std::vector<std::string> texts;
  for (const Json& text : capture::listOf(value)) texts.push_back(textOf(text));
  return texts;
}

double whiteOf(const Json& value) {
  const double white = numberOf(value);
  if (!(white > 0 && std::isfinite(white))) throw Error::mismatch("a number above 0", shown(value));
  return white;
}

template <class Choice> auto nameOneOf(std::initializer_list<Choice> choices) {
  return [choices](const Json& value) {
    std::string expected;
    for (const Choice choice : choices) {
      if (capture::isText(value, weights::nameOf(choice))) return choice;
      expected += (expected.empty() ? "\"" : " or \"") + std::string(weights::nameOf(choice)) + '"';
    }
    throw Error::mismatch(expected, shown(value));
  };
}

weights::LightBlend lightBlendOf(const Json& blend) {
  const auto lightsOf = [](const Json& value) {
    const size_t lights = countOf(value);
    if (lights < 1 || lights > weights::kMaxBlended)
      throw Error::mismatch("a count from 1 to " + std::to_string(weights::kMaxBlended), shown(value));
    return lights;
  };
  return {required(blend, "lights", lightsOf),
          required(blend, "fit", nameOneOf({weights::LightFit::mean, weights::LightFit::plane})),
          required(blend, "foreshortened", flagOf)};
}

weights::InterpolationChoice interpolationOf(const Json& stated) {
  const auto halfScaleOf = [](const Json& value) {
    const double half = numberOf(value);
    if (!(half >= 0.01 && half <= 100)) throw Error::mismatch("a number from 0.01 to 100", shown(value));
    return static_cast<float>(half);
  };
  weights::InterpolationChoice choice;
  choice.kind = required(stated, "kind",
                         nameOneOf({weights::Interpolation::separate, weights::Interpolation::kriging,
                                    weights::Interpolation::shared}));
  if (choice.kind == weights::Interpolation::shared)
    choice.otherwise = required(
        stated, "otherwise", nameOneOf({weights::Interpolation::separate, weights::Interpolation::kriging}));
  choice.halfScale = required(stated, "half_scale", halfScaleOf);
  choice.reciprocal = required(stated, "reciprocal", flagOf);
  choice.shadows = required(stated, "shadows", flagOf);
  return choice;
}

} // namespace

std::string manifestText(const Manifest& manifest) { return capture::sealedText(jsonOf(manifest)); }

Manifest parseManifest(std::string_view text, const std::filesystem::path& path) {
  return inFile(path, [&] {
    const Json json = capture::parseSealed(text, kSurfelFormat,
                                           {kModelVersion, kAlphaVersion, kTablesVersion, kGridVersion});
    Manifest manifest;
    manifest.white = required(json, "white", whiteOf);
    manifest.tolerance = required(json, "tolerance", numberOf);
    manifest.lightBlend = required(json, "light_blend", lightBlendOf);
    manifest.interpolation =
        capture::optional(json, "interpolation", interpolationOf).value_or(weights::InterpolationChoice{});
    manifest.surfels = required(json, "surfels", countOf);
    manifest.views = required(json, "views", countOf);
    manifest.lights = required(json, "lights", countOf);
    const Json& checksums = capture::valueAt(json, "checksums");
    manifest.rig = required(checksums, "transforms.json", textOf);
    manifest.cloud = required(checksums, "surfels.ply", textOf);
    manifest.visibility = required(checksums, "fades.bin", textOf);
    manifest.levels = capture::optional(checksums, "levels.bin", textOf).value_or("");
    manifest.shadows = capture::optional(checksums, "shadows.bin", textOf).value_or("");
    if (json["version"] == kTablesVersion) manifest.tables = required(checksums, "tables.bin", textOf);
    if (manifest.interpolation.kind == weights::Interpolation::shared && manifest.tables.empty())
      throw Error::mismatch("version " + std::to_string(kTablesVersion), shown(json["version"]))
          .at("interpolation shared");
    manifest.viewChecksums = required(json, "view_checksums", textsOf);
    if (json["version"] == kGridVersion) manifest.gridStep = required(json, "grid_step", gridStepOf);
    if (json["version"] == kAlphaVersion || (manifest.gridStep > 0 && json.contains("alpha_checksums"))) {
      manifest.alphaChecksums = required(json, "alpha_checksums", textsOf);
      if (const size_t alphas = manifest.alphaChecksums.size(), views = manifest.viewChecksums.size();
          alphas != views || alphas == 0)
        throw Error::mismatch(std::to_string(std::max<size_t>(views, 1)) + " entries", std::to_string(alphas))
            .at("alpha_checksums");
    }
    return manifest;
  });
}

std::string formatOf(const std::filesystem::path& folder) {
  std::error_code unreadable;
  if (!std::filesystem::exists(folder / kManifestFile, unreadable)) return {};
  const std::string content = readFile(folder / kManifestFile, kLargestText);
  try {
    return textOf(capture::valueAt(capture::parseJson(content), "format"));
  } catch (const Error&) {
    return {};
  }
}

uint64_t identityOf(const Manifest& manifest) { return contentHash(jsonOf(manifest).dump()); }

} // namespace surflect::model
