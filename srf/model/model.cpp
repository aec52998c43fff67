#include "srf/model/model.h"

#include "srf/capture/writer.h"
#include "srf/model/manifest.h"
#include "srf/model/pack_folder.h"
#include "srf/model/visibility_file.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/hash.h"
#include "surfel/geometry/ply.h"
#include "surfel/math/bounds.h"

#include <cmath>
#include <numeric>

namespace surflect::model {

namespace {

constexpr const char* kSurfelFile = "surfels.ply";
constexpr const char* kFadeFile = "fades.bin";
constexpr const char* kRigFile = "transforms.json";

uint64_t hashOf(std::string_view content) { return contentHash(std::as_bytes(std::span(content))); }
std::string fileHash(const std::filesystem::path& path, const Progress& progress) {
  return hex(hashOf(readFile(path, kLargestFile, progress)));
}

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

SurfelCloud readCloud(const std::filesystem::path& path, const Progress& progress) {
  const PlyFile ply = readPly(path, progress);
  try {
    const PlyElement* vertices = ply.find("vertex");
    if (!vertices) throw Error::mismatch("an element 'vertex'", "none");
    const auto column = [&](const char* name) {
      const auto values = vertices->scalars(name);
      for (size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(static_cast<float>(values[i])))
          throw Error::mismatch("a finite number", "one that is not")
              .at(name)
              .at("vertex[" + std::to_string(i) + "]");
      return values;
    };
    const auto x = column("x"), y = column("y"), z = column("z"), rx = column("r0x"), ry = column("r0y"),
               lower = column("lower"), radius = column("radius"), coverage = column("coverage");
    SurfelCloud cloud;
    for (size_t i = 0; i < vertices->count; ++i) {
      progress.checkNowAndThen(i);
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

void checkHash(const std::filesystem::path& path, const std::string& expected, const Progress& progress) {
  if (const auto found = fileHash(path, progress); found != expected)
    throw Error::mismatch(expected, found).at("checksum").in(path);
}

Manifest readManifest(const std::filesystem::path& path) {
  if (std::error_code unreadable; !std::filesystem::exists(path, unreadable))
    throw Error("no manifest: not a packed model").in(path);
  return parseManifest(readFile(path, kLargestText), path);
}

ulr::VisibilityWeights readFades(const std::filesystem::path& path, size_t surfels, size_t views,
                                 const Progress& progress) {
  const std::string packed = readFile(path, kLargestFile, progress);
  try {
    return unpackVisibility(std::as_bytes(std::span(packed)), surfels, views, progress);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

std::vector<std::vector<uint32_t>> columnsOf(const capture::Capture& rig) {
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

// Throws Error unless a view file has the size and light count of the rig, on which look-ups rely.
void checkView(const codec::ViewFile& file, const Model& model, size_t view) {
  const capture::Lens& lens = model.rig.views[view].camera.lens;
  const codec::ViewHeader& header = file.header();
  const auto stated = [](int width, int height, size_t lights) {
    return std::to_string(width) + " x " + std::to_string(height) + " pixels, " + std::to_string(lights) +
           " columns";
  };
  const std::string expected =
      stated(lens.width, lens.height, std::max<size_t>(model.columns[view].size(), 1));
  const std::string found = stated(header.width, header.height, static_cast<size_t>(header.lights));
  if (found != expected) throw Error::mismatch(expected, found).at("size").in(file.path());
}

void requireCount(const char* field, size_t expected, size_t stated, const std::filesystem::path& manifest) {
  if (stated != expected)
    throw Error::mismatch(std::to_string(expected), std::to_string(stated)).at(field).in(manifest);
}

} // namespace

std::filesystem::path viewFilePath(size_t view) {
  std::string number = std::to_string(view);
  number.insert(0, number.size() < 4 ? 4 - number.size() : 0, '0');
  return std::filesystem::path("views") / (number + ".srfb");
}

Model openModel(const std::filesystem::path& folder, const Progress& progress) {
  const auto manifestPath = folder / kManifestFile;
  if (isUnfinished(folder)) throw Error("unfinished model: run the same pack again").in(manifestPath);
  const Manifest manifest = readManifest(manifestPath);
  progress("opening", 0);
  checkHash(folder / kRigFile, manifest.rig, progress);
  checkHash(folder / kSurfelFile, manifest.cloud, progress);
  checkHash(folder / kFadeFile, manifest.visibility, progress);
  Model model;
  model.folder = folder;
  model.identity = identityOf(manifest);
  model.white = manifest.white;
  model.tolerance = manifest.tolerance;
  model.lightBlend = manifest.lightBlend;
  model.rig = capture::readCapture(folder);
  if (manifest.viewChecksums.size() != model.rig.views.size())
    throw Error::mismatch(std::to_string(model.rig.views.size()) + " entries",
                          std::to_string(manifest.viewChecksums.size()))
        .at("view_checksums")
        .in(manifestPath);
  progress.checkpoint();
  model.cloud = readCloud(folder / kSurfelFile, progress);
  model.middle = middleOf(model.cloud.p0);
  progress.checkpoint();
  model.visibility = readFades(folder / kFadeFile, model.cloud.size(), model.rig.views.size(), progress);
  model.columns = columnsOf(model.rig);
  model.isFullProduct = isFullProduct(model.columns, model.rig.lights.size());
  requireCount("surfels", model.cloud.size(), manifest.surfels, manifestPath);
  requireCount("views", model.rig.views.size(), manifest.views, manifestPath);
  requireCount("lights", model.rig.lights.size(), manifest.lights, manifestPath);
  for (size_t view = 0; view < model.rig.views.size(); ++view) {
    progress.checkpoint();
    const codec::ViewFile& file = model.files.emplace_back(folder / viewFilePath(view));
    if (hex(file.checksum()) != manifest.viewChecksums[view])
      throw Error::mismatch(manifest.viewChecksums[view], hex(file.checksum()))
          .at("checksum")
          .in(file.path());
    checkView(file, model, view);
  }
  return model;
}

void writeModel(const std::filesystem::path& folder, const ModelContent& content, const Progress& progress) {
  capture::writeCapture(content.rig, folder);
  writeCloud(folder / kSurfelFile, content.cloud);
  progress.checkpoint();
  writeFileAtomically(folder / kFadeFile, packVisibility(content.visibility, progress));
  Manifest manifest{.white = content.white,
                    .tolerance = content.tolerance,
                    .lightBlend = content.lightBlend,
                    .surfels = content.cloud.size(),
                    .views = content.rig.views.size(),
                    .lights = content.rig.lights.size(),
                    .rig = fileHash(folder / kRigFile, progress),
                    .cloud = fileHash(folder / kSurfelFile, progress),
                    .visibility = fileHash(folder / kFadeFile, progress),
                    .viewChecksums = {}};
  for (size_t view = 0; view < content.rig.views.size(); ++view)
    manifest.viewChecksums.push_back(hex(codec::ViewFile(folder / viewFilePath(view)).checksum()));
  writeFileAtomically(folder / kManifestFile, manifestText(manifest));
}

} // namespace surflect::model
