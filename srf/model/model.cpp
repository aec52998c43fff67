#include "srf/model/model.h"

#include "srf/capture/origin.h"
#include "srf/capture/writer.h"
#include "srf/model/manifest.h"
#include "srf/model/model_files.h"
#include "srf/model/pack_folder.h"
#include "srf/model/pixel_grid.h"
#include "srf/weights/nearest_pairs.h"
#include "srf/weights/shadow_state.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/geometry/ply.h"
#include "surfel/math/bounds.h"
#include "surfel/math/median.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <numeric>
#include <optional>
#include <utility>

namespace surflect::model {

namespace {

constexpr const char* kSurfelFile = "surfels.ply";
constexpr const char* kFadeFile = "fades.bin";
constexpr const char* kLevelFile = "levels.bin";
constexpr const char* kShadowFile = "shadows.bin";
constexpr const char* kTableFile = "tables.bin";
constexpr const char* kRigFile = "transforms.json";

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

constexpr std::array<std::string_view, 8> kCloudColumns = {"x",   "y",     "z",      "r0x",
                                                           "r0y", "lower", "radius", "coverage"};

void requireFinite(std::span<const float> column, std::string_view name) {
  for (size_t i = 0; i < column.size(); ++i)
    if (!std::isfinite(column[i]))
      throw Error::mismatch("a finite number", std::to_string(column[i]))
          .at(std::string(name))
          .at("vertex[" + std::to_string(i) + "]");
}

// The columns kCloudColumns of a file in any form.
std::vector<std::vector<float>> cloudColumns(std::string_view content, const Progress& progress) {
  if (auto written = parseWrittenPly(content, "vertex", kCloudColumns, progress)) {
    for (size_t c = 0; c < written->size(); ++c) requireFinite((*written)[c], kCloudColumns[c]);
    return *std::move(written);
  }
  const PlyFile ply = parsePly(content, progress);
  const PlyElement* vertices = ply.find("vertex");
  if (!vertices) throw Error::mismatch("an element 'vertex'", "none");
  std::vector<std::vector<float>> columns;
  for (const std::string_view name : kCloudColumns) {
    const auto values = vertices->scalars(name);
    requireFinite(columns.emplace_back(values.begin(), values.end()), name);
  }
  return columns;
}

SurfelCloud parseCloud(std::string_view content, const Progress& progress) {
  std::vector<std::vector<float>> columns = cloudColumns(content, progress);
  const size_t count = columns[0].size();
  const auto &x = columns[0], &y = columns[1], &z = columns[2], &rx = columns[3], &ry = columns[4],
             &lower = columns[5];
  SurfelCloud cloud{.p0 = {}, .r0 = {}, .radius = std::move(columns[6]), .coverage = std::move(columns[7])};
  cloud.p0.reserve(count);
  cloud.r0.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    progress.checkNowAndThen(i);
    cloud.p0.emplace_back(x[i], y[i], z[i]);
    cloud.r0.push_back({rx[i], ry[i], lower[i] != 0 ? 1.f : 0.f});
  }
  return cloud;
}

// Content of a file with a checksum.
std::string checkedFile(const std::filesystem::path& path, uint64_t most, const std::string& checksum,
                        const Progress& progress) {
  std::string content = readFile(path, most, progress);
  if (const auto found = hex(contentHash(content)); found != checksum)
    throw Error::mismatch(checksum, found).at("checksum").in(path);
  return content;
}

// Middle of the box of the surfels that are part of the object: with a grid, some may not be.
Point3<AcquisitionSpace, double> middleOfObject(const SurfelCloud& cloud, bool hasGrid) {
  return hasGrid ? middleOf(placesOnObject(cloud)) : middleOf(cloud.p0);
}

Manifest readManifest(const std::filesystem::path& path) {
  if (std::error_code unreadable; !std::filesystem::exists(path, unreadable)) {
    requireExisting(path.parent_path());
    throw Error("no manifest: not a packed model").in(path);
  }
  return parseManifest(readFile(path, kLargestText), path);
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

// Opens a view file. Throws Error unless it has the checksum of the manifest, and the size and light count of
// the rig, on which look-ups rely.
codec::ViewFile openView(const Model& model, size_t view, const std::string& checksum) {
  codec::ViewFile file(model.folder / viewFilePath(view));
  if (const std::string found = hex(file.checksum()); found != checksum)
    throw Error::mismatch(checksum, found).at("checksum").in(file.path());
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
  return file;
}

codec::AlphaPlane openAlpha(const Model& model, size_t view, const std::string& checksum,
                            const Progress& progress) {
  const std::filesystem::path path = model.folder / alphaFilePath(view);
  const std::string content = checkedFile(path, kLargestFile, checksum, progress);
  const capture::Lens& lens = model.rig.views[view].camera.lens;
  return inFile(path,
                [&] { return unpackAlpha(std::as_bytes(std::span(content)), lens.width, lens.height); });
}

// open(view) for all views. Throws what the first faulty view throws, for any number of threads.
template <class File, class Open>
std::vector<File> openViews(size_t views, const Progress& progress, const Open& open) {
  std::vector<std::optional<File>> opened(views);
  std::vector<std::exception_ptr> failures(views);
  std::atomic<size_t> firstFailure = views;
  tbb::parallel_for(size_t{0}, views, [&](size_t view) {
    if (view > firstFailure) return;
    try {
      progress.checkpoint();
      opened[view].emplace(open(view));
    } catch (...) {
      failures[view] = std::current_exception();
      for (size_t first = firstFailure; view < first && !firstFailure.compare_exchange_weak(first, view);) {
      }
    }
  });
  if (firstFailure < views) std::rethrow_exception(failures[firstFailure]);
  std::vector<File> files;
  files.reserve(opened.size());
  for (auto& file : opened) files.push_back(*std::move(file));
  return files;
}

void requireCount(const char* field, size_t expected, size_t stated, const std::filesystem::path& manifest) {
  if (stated != expected)
    throw Error::mismatch(std::to_string(expected), std::to_string(stated)).at(field).in(manifest);
}

// Checks of a model's files, in the order in which failures count.
enum Check : size_t {
  rigFile,
  cloudFile,
  fadeFile,
  rig,
  cloud,
  levelFile,
  shadowFile,
  tableFile,
  fades,
  levels,
  counts,
  shadows,
  tables,
  views,
  kChecks
};

// Outcome of checks that run at the same time, as if one had run after the other.
class Checks {
public:
  // Runs a check, which may throw; returns whether it passes.
  template <class Work> bool pass(Check check, const Work& work) {
    try {
      work();
      failures_[check] = nullptr;
    } catch (...) {
      failures_[check] = std::current_exception();
    }
    return !failures_[check];
  }
  bool passed(Check check) const { return !failures_[check]; }
  // Throws the failure that counts first.
  void conclude() const {
    for (const std::exception_ptr& failure : failures_)
      if (failure) std::rethrow_exception(failure);
  }

private:
  std::array<std::exception_ptr, kChecks> failures_;
};

} // namespace

double pixelsBetween(const SurfelCloud& cloud, const capture::Capture& rig) {
  return median({cloud.radius.begin(), cloud.radius.end()}) /
         capture::pixelFootprint(rig, middleOf(cloud.p0));
}

std::filesystem::path viewFilePath(size_t view) {
  std::string number = std::to_string(view);
  number.insert(0, number.size() < 4 ? 4 - number.size() : 0, '0');
  return std::filesystem::path("views") / (number + ".srfb");
}

std::filesystem::path alphaFilePath(size_t view) { return viewFilePath(view).replace_extension(".srfa"); }

Model openModel(const std::filesystem::path& folder, const Progress& progress) {
  const auto manifestPath = folder / kManifestFile;
  if (isUnfinished(folder)) throw Error("unfinished model: run the same pack again").in(manifestPath);
  const Manifest manifest = readManifest(manifestPath);
  progress("opening", 0);
  Model model;
  model.folder = folder;
  model.identity = identityOf(manifest);
  model.white = manifest.white;
  model.tolerance = manifest.tolerance;
  model.lightBlend = manifest.lightBlend;
  model.interpolation = manifest.interpolation;

  // Each file is read once. Files do not wait for each other: fades are unpacked for the numbers of surfels
  // and views that the manifest states, which are checked afterwards.
  Checks checks;
  // Returns whether a file has its checksum, and use(content) accepts it.
  const auto open = [&](Check file, Check content, const char* name, const std::string& checksum,
                        const auto& use) {
    const std::filesystem::path path = folder / name;
    const uint64_t most = file == rigFile ? kLargestText : kLargestFile;
    std::string text;
    return checks.pass(file, [&] { text = checkedFile(path, most, checksum, progress); }) &&
           checks.pass(content, [&] { inFile(path, [&] { use(text); }); });
  };
  const auto openFades = [&](size_t surfels, size_t views) {
    open(fadeFile, fades, kFadeFile, manifest.visibility, [&](const std::string& content) {
      model.visibility = unpackVisibility(std::as_bytes(std::span(content)), surfels, views, progress);
    });
  };
  const auto openShadows = [&] {
    open(shadowFile, shadows, kShadowFile, manifest.shadows, [&](const std::string& content) {
      model.lightVisibility =
          unpackVisibility(std::as_bytes(std::span(content)), manifest.surfels, manifest.lights, progress);
    });
  };
  const auto openTables = [&] {
    open(tableFile, tables, kTableFile, manifest.tables, [&](const std::string& content) {
      model.shared = unpackTables(std::as_bytes(std::span(content)), manifest.surfels);
    });
  };
  const auto openCloud = [&] {
    const bool isOpen = open(cloudFile, cloud, kSurfelFile, manifest.cloud, [&](const std::string& content) {
      model.cloud = parseCloud(content, progress);
      model.middle = middleOfObject(model.cloud, manifest.gridStep > 0);
    });
    if (isOpen && !manifest.levels.empty())
      open(levelFile, levels, kLevelFile, manifest.levels, [&](const std::string& content) {
        model.levels = unpackLevels(std::as_bytes(std::span(content)), model.cloud, progress);
      });
  };
  const auto openRig = [&] {
    const bool isOpen = open(rigFile, rig, kRigFile, manifest.rig, [&](const std::string& content) {
      model.rig = capture::parseCapture(content, folder / kRigFile);
      if (manifest.viewChecksums.size() != model.rig.views.size())
        throw Error::mismatch(std::to_string(model.rig.views.size()) + " entries",
                              std::to_string(manifest.viewChecksums.size()))
            .at("view_checksums")
            .in(manifestPath);
      model.columns = columnsOf(model.rig);
      model.isFullProduct = isFullProduct(model.columns, model.rig.lights.size());
    });
    if (isOpen)
      checks.pass(views, [&] {
        const auto &ofViews = manifest.viewChecksums, &ofAlpha = manifest.alphaChecksums;
        model.files = openViews<codec::ViewFile>(
            ofViews.size(), progress, [&](size_t view) { return openView(model, view, ofViews[view]); });
        model.alpha = openViews<codec::AlphaPlane>(ofAlpha.size(), progress, [&](size_t view) {
          return openAlpha(model, view, ofAlpha[view], progress);
        });
      });
  };
  tbb::parallel_invoke(
      openRig, [&] { openFades(manifest.surfels, manifest.views); }, openCloud,
      [&] {
        if (!manifest.shadows.empty()) openShadows();
        if (!manifest.tables.empty()) openTables();
      });
  progress.checkpoint();
  if (checks.passed(rigFile) && checks.passed(rig) && checks.passed(cloudFile) && checks.passed(cloud)) {
    const size_t surfels = model.cloud.size(), views = model.rig.views.size();
    if (surfels != manifest.surfels || views != manifest.views) openFades(surfels, views);
    checks.pass(counts, [&] {
      requireCount("surfels", surfels, manifest.surfels, manifestPath);
      requireCount("views", views, manifest.views, manifestPath);
      requireCount("lights", model.rig.lights.size(), manifest.lights, manifestPath);
      if (manifest.gridStep == 0) return;
      requireCount("views of a grid", 1, views, manifestPath);
      model.grid = pixelGrid(model.rig.views[0].camera.lens, manifest.gridStep);
      requireCount("surfels of a grid", model.grid->corners(), surfels, manifestPath);
    });
  }
  checks.conclude();
  model.hasNearPairs = weights::hasNearPairs(model);
  return model;
}

Model makeModel(const std::filesystem::path& folder, ModelContent content, const Progress& progress) {
  Model model;
  model.folder = folder;
  model.rig = std::move(content.rig);
  model.cloud = std::move(content.cloud);
  model.levels = levelsOfDetail(model.cloud, progress);
  model.visibility = std::move(content.visibility);
  model.grid = content.grid;
  if (!model.rig.lights.empty() && !model.grid)
    model.lightVisibility = weights::shadowStates(model.cloud, occludersOf(model.cloud, *model.levels),
                                                  model.rig.lights, progress);
  for (size_t view = 0; view < model.rig.views.size(); ++view)
    model.files.emplace_back(folder / viewFilePath(view));
  if (model.grid) {
    markBesideObject(*model.grid, model.files[0], model.cloud, model.visibility, progress);
    for (size_t i = 0; i < model.cloud.size(); ++i)
      model.levels->splats[model.levels->first[i]].coverage = model.cloud.coverage[i];
  }
  model.middle = middleOfObject(model.cloud, model.grid.has_value());
  for (size_t view = 0; content.hasAlpha && view < model.rig.views.size(); ++view) {
    const capture::Lens& lens = model.rig.views[view].camera.lens;
    const std::string alpha = readFile(folder / alphaFilePath(view));
    model.alpha.push_back(unpackAlpha(std::as_bytes(std::span(alpha)), lens.width, lens.height));
  }
  model.columns = columnsOf(model.rig);
  model.isFullProduct = isFullProduct(model.columns, model.rig.lights.size());
  model.hasNearPairs = weights::hasNearPairs(model);
  model.white = content.white;
  model.tolerance = content.tolerance;
  model.lightBlend = content.lightBlend;
  return model;
}

void writeModel(const Model& model, const Progress& progress) {
  const std::filesystem::path& folder = model.folder;
  const auto checksumOf = [&](const std::filesystem::path& file) {
    return hex(contentHash(readFile(folder / file, kLargestFile, progress)));
  };
  capture::writeCapture(model.rig, folder);
  writeCloud(folder / kSurfelFile, model.cloud);
  progress.checkpoint();
  writeFileAtomically(folder / kFadeFile, packVisibility(model.visibility, progress));
  if (model.levels) writeFileAtomically(folder / kLevelFile, packLevels(*model.levels));
  if (model.lightVisibility)
    writeFileAtomically(folder / kShadowFile, packVisibility(*model.lightVisibility, progress));
  if (model.shared)
    writeFileAtomically(folder / kTableFile, packTables(*model.shared));
  else
    std::filesystem::remove(folder / kTableFile);
  Manifest manifest{.white = model.white,
                    .tolerance = model.tolerance,
                    .lightBlend = model.lightBlend,
                    .interpolation = model.interpolation,
                    .surfels = model.cloud.size(),
                    .views = model.rig.views.size(),
                    .lights = model.rig.lights.size(),
                    .gridStep = model.grid ? model.grid->step : 0,
                    .rig = checksumOf(kRigFile),
                    .cloud = checksumOf(kSurfelFile),
                    .visibility = checksumOf(kFadeFile),
                    .levels = model.levels ? checksumOf(kLevelFile) : "",
                    .shadows = model.lightVisibility ? checksumOf(kShadowFile) : "",
                    .tables = model.shared ? checksumOf(kTableFile) : "",
                    .viewChecksums = {}};
  for (const codec::ViewFile& file : model.files) manifest.viewChecksums.push_back(hex(file.checksum()));
  for (size_t view = 0; view < model.alpha.size(); ++view)
    manifest.alphaChecksums.push_back(checksumOf(alphaFilePath(view)));
  writeFileAtomically(folder / kManifestFile, manifestText(manifest));
}

} // namespace surflect::model
