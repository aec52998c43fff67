#include "srf/model/pack_folder.h"

#include "srf/model/model.h"
#include "srf/model/model_files.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <locale>
#include <sstream>

namespace surflect::model {

namespace {

namespace fs = std::filesystem;

fs::path errorPath(size_t view) { return viewFilePath(view).replace_extension(".error"); }

std::string errorText(const codec::ViewFile& file, const codec::ViewSummary& summary) {
  return fmt::format("{:016x} {:.17g} {:.17g}\n", file.checksum(), summary.squaredError,
                     summary.clippedSquaredError);
}

// Returns true for an empty folder, or one with only the folders and temporary files of an interrupted run.
bool isVacant(const fs::path& folder) {
  if (!fs::is_directory(folder)) return false;
  const auto isContent = [](const fs::directory_entry& entry) {
    return !entry.is_directory() && entry.path().extension() != ".tmp";
  };
  const fs::recursive_directory_iterator entries(folder);
  return std::none_of(begin(entries), end(entries), isContent);
}

// Returns true for the name of a file of a view or of the survey.
bool isOfViews(const std::string& name) {
  size_t view = 0;
  const auto [end, status] = std::from_chars(name.data(), name.data() + name.size(), view);
  return name == "survey" || (status == std::errc() &&
                              (viewFilePath(view).filename() == name ||
                               viewFilePath(view).filename().string() + ".records" == name ||
                               errorPath(view).filename() == name || alphaFilePath(view).filename() == name));
}

// Removes temporary files of a run that was killed.
void removeLitter(const fs::path& folder) {
  removeAbandoned(folder, [](const std::string& target) {
    return target == "manifest.json" || target == "transforms.json" || target == "surfels.ply" ||
           target == "fades.bin" || target == "levels.bin" || target == "shadows.bin" ||
           target == "tables.bin";
  });
  removeAbandoned(folder / "views",
                  [](const std::string& target) { return target == "identity" || isOfViews(target); });
}

} // namespace

fs::path packIdentityPath() { return fs::path("views") / "identity"; }
fs::path surveyPath() { return fs::path("views") / "survey"; }

bool isFinished(const fs::path& folder) {
  std::error_code ignored; // a folder that cannot be read counts as unfinished
  return fs::exists(folder / "manifest.json", ignored);
}
bool isUnfinished(const fs::path& folder) {
  std::error_code ignored;
  return !isFinished(folder) && fs::exists(folder / packIdentityPath(), ignored);
}

void protectFinished(const fs::path& folder, const std::string& identity) {
  const fs::path identityPath = folder / packIdentityPath();
  if (isFinished(folder) && fs::exists(identityPath) && readFile(identityPath) != identity)
    throw Error(
        "a finished model of another capture, geometry, tolerance or version of surflect: --overwrite "
        "replaces it")
        .in(folder);
}

void claimPackFolder(const fs::path& folder) {
  const fs::path identityPath = folder / packIdentityPath();
  if (fs::exists(folder) && !fs::exists(identityPath) && !isVacant(folder))
    throw Error("exists and is not a model: give the output a folder of its own").in(folder);
  createFolder(identityPath.parent_path());
  removeLitter(folder);
}

void writeAlpha(const fs::path& folder, size_t view, const codec::AlphaPlane& plane) {
  writeFileAtomically(folder / alphaFilePath(view), packAlpha(plane));
}

void writeView(const fs::path& folder, size_t view, const codec::EncodedView& encoded) {
  writeFileAtomically(folder / viewFilePath(view), encoded.file);
  writeSummary(folder, view, encoded.summary);
}

void writeSummary(const fs::path& folder, size_t view, const codec::ViewSummary& summary) {
  writeFileAtomically(folder / errorPath(view),
                      errorText(codec::ViewFile(folder / viewFilePath(view)), summary));
}

bool isAlphaFinished(const fs::path& folder, size_t view, int width, int height) {
  const fs::path path = folder / alphaFilePath(view);
  if (!fs::exists(path)) return false;
  try {
    const std::string content = readFile(path);
    unpackAlpha(std::as_bytes(std::span(content)), width, height);
    return true;
  } catch (const Error&) {
    return false;
  }
}

std::optional<codec::ViewSummary> finishedView(const fs::path& folder, size_t view) {
  const auto path = folder / viewFilePath(view);
  if (!fs::exists(path) || !fs::exists(folder / errorPath(view))) return std::nullopt;
  try {
    const codec::ViewFile file(path);
    const std::string record = readFile(folder / errorPath(view), 1 << 12);
    codec::ViewSummary summary;
    std::istringstream words(record);
    words.imbue(std::locale::classic());
    std::string hash;
    words >> hash >> summary.squaredError >> summary.clippedSquaredError;
    if (errorText(file, summary) != record) return std::nullopt;
    summary.fileBytes = fs::file_size(path);
    for (uint32_t index = 0; index < file.blockCount(); ++index) {
      const codec::Block block = file.read(index);
      summary.objectTexels += static_cast<uint64_t>(std::popcount(block.present));
      summary.blocksOfRank.resize(std::max(summary.blocksOfRank.size(), static_cast<size_t>(block.rank) + 1));
      ++summary.blocksOfRank[static_cast<size_t>(block.rank)];
    }
    summary.values = summary.objectTexels * static_cast<uint64_t>(file.header().lights) * 3;
    return summary;
  } catch (const Error&) {
    return std::nullopt;
  }
}

void removeViews(const fs::path& folder) {
  std::vector<fs::path> views;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "views"))
    if (isOfViews(entry.path().filename().string())) views.push_back(entry.path());
  for (const fs::path& view : views) fs::remove(view);
}

} // namespace surflect::model
