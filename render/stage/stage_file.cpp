#include "render/stage/stage_file.h"

#include "render/stage/exposure.h"
#include "render/stage/object_section.h"
#include "render/stage/stage_plan.h"
#include "surfel/base/file.h"

#include <fmt/format.h>

#include <array>

namespace surflect::stage {

namespace {

constexpr int kMostSamples = 1'000'000;
constexpr size_t kMostExposures = 100'000;

void mix(uint64_t& hash, uint64_t other) {
  const std::array both = {hash, other};
  hash = contentHash(std::as_bytes(std::span(both)));
}

Stage asStage(const scene::Entry& root) {
  const scene::Section s(root, {"transport", "matte", "samples", "seed", "segments", "center", "camera",
                                "views", "lights", "exposure", "material", "object", "scale"});
  Stage stage;
  stage.trace.samples = integerOr(s, "samples", 1, kMostSamples, stage.trace.samples);
  stage.trace.seed = static_cast<uint64_t>(integerOr(s, "seed", 0, 1 << 30, 1));
  if (const auto transport = s.find("transport")) {
    const std::string name = scene::asText(*transport);
    if (name != "local" && name != "direct" && name != "full")
      throw scene::noneOf(*transport, {"local", "direct", "full"});
    stage.trace.transport = name == "local"    ? Transport::local
                            : name == "direct" ? Transport::direct
                                               : Transport::full;
  }
  if (const auto matte = s.find("matte")) {
    const std::string name = scene::asText(*matte);
    if (name != "coverage" && name != "transmittance")
      throw scene::noneOf(*matte, {"coverage", "transmittance"});
    stage.trace.matte = name == "coverage" ? Matte::coverage : Matte::transmittance;
  }
  stage.rig = asRig(s);
  stage.trace.lightRadius = stage.rig.lightRadius;
  if (const auto exposure = s.find("exposure")) {
    ExposureSection section = asExposure(*exposure);
    const size_t pictures = stage.rig.views.size() * stage.rig.lights.size() * section.camera.seconds.size();
    if (pictures > kMostExposures)
      throw Error::mismatch(fmt::format("at most {} pictures", kMostExposures), std::to_string(pictures))
          .at(exposure->field);
    for (const auto& file : section.files) mix(stage.hash, contentHash(readFile(file)));
    stage.exposure = std::move(section.camera);
  }
  const MaterialList materials = asMaterials(s.require("material"));
  ObjectList objects = asObjects(s.require("object"), materials,
                                 integerOr(s, "segments", kFewestSegments, kMostSegments, 256));
  stage.objects = std::move(objects.objects);
  stage.tables = materials.tables;
  for (const auto& file : stage.rig.files) mix(stage.hash, contentHash(readFile(file)));
  for (const uint64_t hash : objects.hashes) mix(stage.hash, hash);
  for (const auto& file : materials.files) mix(stage.hash, contentHash(readFile(file)));
  return stage;
}

} // namespace

Stage parseStage(std::string_view text, const std::filesystem::path& path, std::string_view scale) {
  try {
    scene::ScriptDocument document(text, path);
    if (!scale.empty()) document.prefer("scale", scale);
    Stage stage = asStage(document.root());
    stage.file = path;
    mix(stage.hash, contentHash(text));
    if (!scale.empty()) mix(stage.hash, contentHash(scale));
    return stage;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

Stage readStage(const std::filesystem::path& path, std::string_view scale) {
  constexpr uint64_t most = uint64_t{1} << 24;
  return parseStage(readFile(path, most), path, scale);
}

} // namespace surflect::stage
