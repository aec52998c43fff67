#include "srf/model/model.h"

#include "srf/capture/writer.h"
#include "surfel/error.h"
#include "surfel/file.h"
#include "surfel/hash.h"
#include "surfel/ply.h"

#include <nlohmann/json.hpp>
#include <zlib.h>

#include <cassert>
#include <numeric>

namespace surflect {

namespace {

using Json = nlohmann::json;
constexpr const char* kFormat = "surflect model";
constexpr const char* kSurfelFile = "surfels.ply";
constexpr const char* kFadeFile = "fades.bin";
constexpr const char* kRigFile = "transforms.json";

uint64_t hashOf(std::string_view content) { return contentHash(std::as_bytes(std::span(content))); }
std::string fileHash(const std::filesystem::path& path) { return hex(hashOf(readFile(path))); }

void writeCloud(const std::filesystem::path& path, const SurfelCloud& cloud) {
  std::vector<PlyColumn> columns;
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "r0x", "r0y", "lower", "radius", "coverage"})
    columns.push_back({name, {}});
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Vec3<float> n = rotationOf<float>(cloud.r0[i]).col(2);
    const float row[] = {
        cloud.p0[i].x(),   cloud.p0[i].y(), cloud.p0[i].z(),  n[0], n[1], n[2], cloud.r0[i].x, cloud.r0[i].y,
        cloud.r0[i].lower, cloud.radius[i], cloud.coverage[i]};
    for (size_t c = 0; c < columns.size(); ++c) columns[c].values.push_back(row[c]);
  }
  writePly(path, "vertex", columns, "surfels: acquisition space, scene units; see docs/format.md");
}

SurfelCloud readCloud(const std::filesystem::path& path) {
  const PlyFile ply = readPly(path);
  try {
    const PlyElement* vertices = ply.find("vertex");
    if (!vertices) throw Error::mismatch("an element 'vertex'", "none");
    const auto column = [&](const char* name) {
      const auto values = vertices->scalars(name);
      for (size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]))
          throw Error::mismatch("a finite number", "one that is not")
              .at(name)
              .at("vertex[" + std::to_string(i) + "]");
      return values;
    };
    const auto x = column("x"), y = column("y"), z = column("z"), rx = column("r0x"), ry = column("r0y"),
               lower = column("lower"), radius = column("radius"), coverage = column("coverage");
    SurfelCloud cloud;
    for (size_t i = 0; i < vertices->count; ++i) {
      cloud.p0.emplace_back(static_cast<float>(x[i]), static_cast<float>(y[i]), static_cast<float>(z[i]));
      cloud.r0.push_back({static_cast<float>(rx[i]), static_cast<float>(ry[i]), lower[i] != 0 ? 1.f : 0.f});
      cloud.radius.push_back(static_cast<float>(radius[i]));
      cloud.coverage.push_back(static_cast<float>(coverage[i]));
    }
    return cloud;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

// Fades are few values in long runs once they stand view by view; deflate makes them small.
void writeFades(const std::filesystem::path& path, const ViewFades& fades) {
  const size_t surfels = fades.views ? fades.values.size() / fades.views : 0;
  std::vector<Bytef> byView;
  byView.reserve(fades.values.size());
  for (size_t view = 0; view < fades.views; ++view)
    for (size_t i = 0; i < surfels; ++i) byView.push_back(fades.values[i * fades.views + view]);
  std::vector<Bytef> packed(compressBound(byView.size()));
  uLongf size = packed.size();
  [[maybe_unused]] const int status = compress2(packed.data(), &size, byView.data(), byView.size(), 6);
  assert(status == Z_OK);
  writeFileAtomically(path, std::as_bytes(std::span(packed).first(size)));
}

ViewFades readFades(const std::filesystem::path& path, size_t surfels, size_t views) {
  const std::string packed = readFile(path);
  std::vector<Bytef> byView(surfels * views);
  uLongf size = byView.size();
  const int status =
      uncompress(byView.data(), &size, reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (status != Z_OK || size != byView.size())
    throw Error::mismatch("deflated fades of " + std::to_string(surfels) + " surfels x " +
                              std::to_string(views) + " views",
                          "other content")
        .in(path);
  ViewFades fades{views, std::vector<uint8_t>(byView.size())};
  for (size_t view = 0; view < views; ++view)
    for (size_t i = 0; i < surfels; ++i) fades.values[i * views + view] = byView[view * surfels + i];
  return fades;
}

template <class T> T fieldOf(const Json& object, const char* key) {
  try {
    return object.at(key).get<T>();
  } catch (const Json::exception&) {
    throw Error::mismatch("a value of the right type", object.contains(key) ? object[key].dump() : "none")
        .at(key);
  }
}

// Of all fields but the one that holds it.
std::string ownHash(Json manifest) {
  manifest.erase("checksum");
  return hex(hashOf(manifest.dump()));
}

Json readManifest(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    throw Error("no manifest: not a packed model, or packing was not finished").in(path);
  try {
    const Json manifest = Json::parse(readFile(path), nullptr, false);
    if (!manifest.is_object()) throw Error::mismatch("a JSON object", "something else");
    if (fieldOf<std::string>(manifest, "format") != kFormat)
      throw Error::mismatch("'" + std::string(kFormat) + "'", manifest["format"].dump()).at("format");
    if (fieldOf<int>(manifest, "version") != kModelVersion)
      throw Error::mismatch(std::to_string(kModelVersion), manifest["version"].dump()).at("version");
    if (const auto checksum = fieldOf<std::string>(manifest, "checksum"); checksum != ownHash(manifest))
      throw Error::mismatch(checksum, ownHash(manifest)).at("checksum");
    return manifest;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

void checkHashes(const std::filesystem::path& folder, const Json& manifest) {
  for (const char* name : {kRigFile, kSurfelFile, kFadeFile}) {
    const auto expected = fieldOf<std::string>(fieldOf<Json>(manifest, "checksums"), name);
    const auto found = fileHash(folder / name);
    if (found != expected) throw Error::mismatch(expected, found).at("checksum").in(folder / name);
  }
}

std::vector<std::vector<uint32_t>> columnsOf(const Capture& rig) {
  std::vector<std::vector<uint32_t>> columns(rig.views.size());
  for (const auto& frame : rig.frames)
    if (frame.light) columns[frame.view].push_back(static_cast<uint32_t>(*frame.light));
  return columns;
}

bool isFullProduct(const std::vector<std::vector<uint32_t>>& columns, size_t lights) {
  std::vector<uint32_t> all(lights);
  std::iota(all.begin(), all.end(), 0u);
  return std::ranges::all_of(columns, [&](const auto& view) { return view == all; });
}

} // namespace

std::filesystem::path viewFilePath(size_t view) {
  std::string number = std::to_string(view);
  number.insert(0, number.size() < 4 ? 4 - number.size() : 0, '0');
  return std::filesystem::path("views") / (number + ".srfb");
}

Model openModel(const std::filesystem::path& folder) {
  const auto manifestPath = folder / "manifest.json";
  const Json manifest = readManifest(manifestPath);
  Model model;
  model.folder = folder;
  model.identity = hashOf(manifest.dump()); // it holds the hashes of all other files
  std::vector<std::string> viewChecksums;
  try {
    checkHashes(folder, manifest);
    viewChecksums = fieldOf<std::vector<std::string>>(manifest, "view_checksums");
    model.white = fieldOf<double>(manifest, "white");
    model.tolerance = fieldOf<double>(manifest, "tolerance");
  } catch (Error& error) {
    throw std::move(error).in(manifestPath);
  }
  model.rig = readCapture(folder);
  if (viewChecksums.size() != model.rig.views.size())
    throw Error::mismatch(std::to_string(model.rig.views.size()) + " entries",
                          std::to_string(viewChecksums.size()))
        .at("view_checksums")
        .in(manifestPath);
  model.cloud = readCloud(folder / kSurfelFile);
  model.fades = readFades(folder / kFadeFile, model.cloud.size(), model.rig.views.size());
  model.columns = columnsOf(model.rig);
  model.isFullProduct = isFullProduct(model.columns, model.rig.lights.size());
  for (size_t view = 0; view < model.rig.views.size(); ++view) {
    const ViewFile& file = model.files.emplace_back(folder / viewFilePath(view));
    if (hex(file.checksum()) != viewChecksums[view])
      throw Error::mismatch(viewChecksums[view], hex(file.checksum())).at("checksum").in(file.path());
  }
  return model;
}

void writeModel(const std::filesystem::path& folder, const ModelContent& content) {
  writeCapture(content.rig, folder);
  writeCloud(folder / kSurfelFile, content.cloud);
  writeFades(folder / kFadeFile, content.fades);
  Json manifest = {{"format", kFormat},
                   {"version", kModelVersion},
                   {"white", content.white},
                   {"tolerance", content.tolerance},
                   {"surfels", content.cloud.size()},
                   {"views", content.rig.views.size()},
                   {"lights", content.rig.lights.size()},
                   {"view_files", "views/NNNN.srfb, by index of the view in transforms.json"}};
  for (const char* name : {kRigFile, kSurfelFile, kFadeFile})
    manifest["checksums"][name] = fileHash(folder / name);
  for (size_t view = 0; view < content.rig.views.size(); ++view)
    manifest["view_checksums"].push_back(hex(ViewFile(folder / viewFilePath(view)).checksum()));
  manifest["checksum"] = ownHash(manifest);
  writeFileAtomically(folder / "manifest.json", manifest.dump(2) + "\n");
}

} // namespace surflect
