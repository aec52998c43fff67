#include "srf/model/manifest.h"

#include "srf/capture/shallow_json.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/hash.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace surflect::model {

namespace {

using Json = nlohmann::json;
// Levels of nesting. A manifest needs two; the library copies and prints by recursion.
constexpr int kDeepest = 8;

Json jsonOf(const Manifest& manifest) {
  Json json = {{"format", kSurfelFormat},
               {"version", manifest.alphaChecksums.empty() ? kModelVersion : kAlphaVersion},
               {"white", manifest.white},
               {"tolerance", manifest.tolerance},
               {"light_blend",
                {{"lights", manifest.lightBlend.lights},
                 {"fit", ulr::nameOf(manifest.lightBlend.fit)},
                 {"foreshortened", manifest.lightBlend.foreshortened}}},
               {"interpolation",
                {{"kind", ulr::nameOf(manifest.interpolation.kind)},
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
  if (!manifest.levels.empty()) json["checksums"]["levels.bin"] = manifest.levels;
  if (!manifest.shadows.empty()) json["checksums"]["shadows.bin"] = manifest.shadows;
  if (!manifest.alphaChecksums.empty()) json["alpha_checksums"] = manifest.alphaChecksums;
  return json;
}

// Checksum of all fields other than `checksum`.
std::string ownChecksum(Json json) {
  json.erase("checksum");
  return hex(contentHash(json.dump()));
}

const Json& member(const Json& object, const char* key) {
  static const Json nothing;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found == object.end() ? nothing : *found;
}

Error mismatch(const char* expected, const Json& found) {
  return Error::mismatch(expected, found.is_null() ? "nothing" : found.dump().substr(0, 60));
}

std::string textOf(const Json& object, const char* key) {
  const Json& value = member(object, key);
  if (!value.is_string()) throw mismatch("a string", value).at(key);
  return value.get<std::string>();
}

double numberOf(const Json& object, const char* key) {
  const Json& value = member(object, key);
  if (!value.is_number()) throw mismatch("a number", value).at(key);
  return value.get<double>();
}

size_t countOf(const Json& object, const char* key) {
  const Json& value = member(object, key);
  if (!value.is_number_unsigned()) throw mismatch("a count", value).at(key);
  return value.get<size_t>();
}

bool flagOf(const Json& object, const char* key, const char* field) {
  const Json& value = member(object, key);
  if (!value.is_boolean()) throw mismatch("true or false", value).at(field);
  return value.get<bool>();
}

ulr::LightBlend lightBlendOf(const Json& json) {
  const Json& blend = member(json, "light_blend");
  const size_t lights = countOf(blend, "lights");
  if (lights < 1 || lights > ulr::kMaxBlended)
    throw mismatch(("a count from 1 to " + std::to_string(ulr::kMaxBlended)).c_str(), member(blend, "lights"))
        .at("light_blend.lights");
  const bool foreshortened = flagOf(blend, "foreshortened", "light_blend.foreshortened");
  for (const ulr::LightFit fit : {ulr::LightFit::mean, ulr::LightFit::plane})
    if (member(blend, "fit") == ulr::nameOf(fit)) return {lights, fit, foreshortened};
  throw mismatch("\"mean\" or \"plane\"", member(blend, "fit")).at("light_blend.fit");
}

// Choice that the manifest states; that of models before there was one if it states none.
ulr::InterpolationChoice interpolationOf(const Json& json) {
  const Json& stated = member(json, "interpolation");
  if (stated.is_null()) return {};
  ulr::InterpolationChoice choice;
  if (const double half = numberOf(stated, "half_scale"); half >= 0.01 && half <= 100)
    choice.halfScale = static_cast<float>(half);
  else
    throw mismatch("a number from 0.01 to 100", member(stated, "half_scale")).at("interpolation.half_scale");
  choice.reciprocal = flagOf(stated, "reciprocal", "interpolation.reciprocal");
  choice.shadows = flagOf(stated, "shadows", "interpolation.shadows");
  for (const ulr::Interpolation kind : {ulr::Interpolation::separate, ulr::Interpolation::kriging}) {
    choice.kind = kind;
    if (member(stated, "kind") == ulr::nameOf(kind)) return choice;
  }
  throw mismatch("\"separate\" or \"kriging\"", member(stated, "kind")).at("interpolation.kind");
}

std::vector<std::string> textsOf(const Json& object, const char* key) {
  const Json& values = member(object, key);
  if (!values.is_array()) throw mismatch("a list", values).at(key);
  std::vector<std::string> texts;
  for (const Json& value : values) {
    if (!value.is_string()) throw mismatch("strings", value).at(key);
    texts.push_back(value.get<std::string>());
  }
  return texts;
}

Json parse(std::string_view text) {
  const std::string_view shallow = capture::shallowPart(text, kDeepest);
  Json json = Json::parse(shallow, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded() && shallow.size() < text.size()) throw Error("nested too deeply");
  if (!json.is_object()) throw Error::mismatch("a JSON object", "something else");
  return json;
}

} // namespace

std::string manifestText(const Manifest& manifest) {
  Json json = jsonOf(manifest);
  json["checksum"] = ownChecksum(json);
  return json.dump(2) + "\n";
}

Manifest parseManifest(std::string_view text, const std::filesystem::path& path) {
  try {
    const Json json = parse(text);
    if (const Json& format = member(json, "format"); format != kSurfelFormat)
      throw mismatch("\"surflect model\"", format).at("format");
    const Json& version = member(json, "version");
    if (version != kModelVersion && version != kAlphaVersion)
      throw mismatch((std::to_string(kModelVersion) + " or " + std::to_string(kAlphaVersion)).c_str(),
                     version)
          .at("version");
    Manifest manifest;
    manifest.white = numberOf(json, "white");
    manifest.tolerance = numberOf(json, "tolerance");
    manifest.lightBlend = lightBlendOf(json);
    manifest.interpolation = interpolationOf(json);
    manifest.surfels = countOf(json, "surfels");
    manifest.views = countOf(json, "views");
    manifest.lights = countOf(json, "lights");
    const Json& checksums = member(json, "checksums");
    manifest.rig = textOf(checksums, "transforms.json");
    manifest.cloud = textOf(checksums, "surfels.ply");
    manifest.visibility = textOf(checksums, "fades.bin");
    if (!member(checksums, "levels.bin").is_null()) manifest.levels = textOf(checksums, "levels.bin");
    if (!member(checksums, "shadows.bin").is_null()) manifest.shadows = textOf(checksums, "shadows.bin");
    manifest.viewChecksums = textsOf(json, "view_checksums");
    if (version == kAlphaVersion) manifest.alphaChecksums = textsOf(json, "alpha_checksums");
    if (const size_t alphas = manifest.alphaChecksums.size(), views = manifest.viewChecksums.size();
        version == kAlphaVersion && (alphas != views || alphas == 0))
      throw Error::mismatch(std::to_string(std::max<size_t>(views, 1)) + " entries", std::to_string(alphas))
          .at("alpha_checksums");
    if (const std::string stated = textOf(json, "checksum"), found = ownChecksum(json); stated != found)
      throw Error::mismatch(stated, found).at("checksum");
    if (!(manifest.white > 0) || !std::isfinite(manifest.white))
      throw mismatch("a number above 0", member(json, "white")).at("white");
    return manifest;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

std::string formatOf(const std::filesystem::path& folder) {
  std::error_code unreadable;
  if (!std::filesystem::exists(folder / kManifestFile, unreadable)) return {};
  const Json json =
      Json::parse(capture::shallowPart(readFile(folder / kManifestFile, kLargestText), kDeepest), nullptr,
                  /*allow_exceptions=*/false);
  const Json& format = member(json, "format");
  return format.is_string() ? format.get<std::string>() : std::string();
}

uint64_t identityOf(const Manifest& manifest) { return contentHash(jsonOf(manifest).dump()); }

} // namespace surflect::model
