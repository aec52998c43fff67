#include "render/lightfield/common/light_field_folder.h"

#include "render/lightfield/common/mesh_file.h"
#include "srf/capture/json_fields.h"
#include "srf/capture/writer.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/hash.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

namespace surflect::lightfield {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kManifestFile = "manifest.json";
constexpr const char* kRigFile = "transforms.json";
constexpr const char* kMeshFile = "mesh.bin";
// Says that a folder is a light field that is being written; removed when it is finished.
constexpr const char* kUnfinishedFile = "light-field.unfinished";
constexpr std::string_view kTagStart = "surflect "; // of every format

// Checksum of a file too large for memory: hash of the hashes of its portions.
std::string checksumOf(const fs::path& path, const Progress& progress) {
  constexpr size_t kPortion = size_t{1} << 20;
  std::ifstream file(path, std::ios::binary);
  std::vector<char> portion(kPortion);
  std::vector<uint64_t> hashes;
  while (file) {
    progress.checkpoint();
    file.read(portion.data(), static_cast<std::streamsize>(kPortion));
    if (file.gcount() > 0)
      hashes.push_back(
          contentHash(std::as_bytes(std::span(portion).first(static_cast<size_t>(file.gcount())))));
  }
  if (!file.eof()) throw Error("cannot be read").in(path);
  return hex(contentHash(std::as_bytes(std::span(hashes))));
}

uint64_t sizeOf(const fs::path& path) {
  std::error_code failure;
  const uint64_t bytes = fs::file_size(path, failure);
  if (failure) throw Error("cannot open (" + failure.message() + ")").in(path);
  return bytes;
}

// The training views of a capture, as a capture without files.
capture::Capture rigOf(const capture::Capture& capture) {
  capture::Capture rig = capture::subset(
      capture, [](const capture::Frame& frame) { return frame.split == capture::Split::train; });
  rig.geometry.clear();
  rig.colorSpace = capture::ColorSpace::linear;
  rig.response.reset();
  for (capture::Frame& frame : rig.frames) {
    frame.layer.clear(), frame.alphaLayer.clear(), frame.mask.clear(), frame.further.clear();
    frame.exposure = 1;
  }
  return rig;
}

// ---------------------------------------------------------------------------------------------------------

// Checksum of all fields other than `checksum`.
std::string ownChecksum(Json json) {
  json.erase("checksum");
  return hex(contentHash(json.dump()));
}

// Whether a light field was written, or begun, in a folder.
bool isLightField(const fs::path& folder) {
  if (fs::exists(folder / kUnfinishedFile)) return true;
  if (!fs::exists(folder / kManifestFile)) return false;
  const Json json = Json::parse(readFile(folder / kManifestFile, kLargestText), nullptr, false);
  if (!json.is_object() || !json.contains("files")) return false; // a surfel model has no such field
  const Json& format = capture::valueAt(json, "format");
  return format.is_string() && format.get<std::string>().starts_with(kTagStart);
}

size_t wholeNumber(const Json& value) {
  if (!value.is_number_unsigned()) throw Error::mismatch("a count", capture::shown(value));
  return value.get<size_t>();
}

} // namespace

void requireLightFieldFolder(const fs::path& folder) {
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder)) throw Error("is not a folder").in(folder);
  if (!fs::is_empty(folder) && !isLightField(folder))
    throw Error("exists and is not a light field: give the output a folder of its own").in(folder);
}

void beginLightFieldFolder(const fs::path& folder) {
  requireLightFieldFolder(folder);
  createFolder(folder);
  writeFileAtomically(folder / kUnfinishedFile, "run the same build again\n");
}

LightFieldWriter::LightFieldWriter(fs::path folder, std::string format, int version)
    : folder_(std::move(folder)), format_(std::move(format)), version_(version) {
  beginLightFieldFolder(folder_);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
    if (entry.path().filename() != kUnfinishedFile && entry.is_regular_file()) fs::remove(entry.path());
}

fs::path LightFieldWriter::file(std::string_view name) {
  return files_.insert_or_assign(std::string(name), folder_ / name).first->second;
}

void LightFieldWriter::commit(const capture::Capture& capture, const TriangleMesh& mesh,
                              const Numbers& numbers, const Progress& progress) {
  capture::writeCapture(rigOf(capture), folder_);
  writeMeshFile(folder_ / kMeshFile, mesh);
  file(kRigFile), file(kMeshFile);
  Json json = {{"format", format_}, {"version", version_}, {"numbers", numbers}, {"files", Json::object()}};
  for (const auto& [name, path] : files_)
    json["files"][name] = {{"bytes", sizeOf(path)}, {"checksum", checksumOf(path, progress)}};
  json["checksum"] = ownChecksum(json);
  writeFileAtomically(folder_ / kManifestFile, json.dump(2) + "\n");
  fs::remove(folder_ / kUnfinishedFile);
}

LightFieldFolder::LightFieldFolder(fs::path folder, std::string_view format, int version,
                                   const Progress& progress)
    : folder_(std::move(folder)) {
  const fs::path manifest = folder_ / kManifestFile;
  if (!fs::exists(manifest) && fs::exists(folder_ / kUnfinishedFile))
    throw Error("unfinished light field: run the same build again").in(manifest);
  try {
    const Json json = capture::parseJson(readFile(manifest, kLargestText));
    capture::objectOf(json);
    if (const Json& found = capture::valueAt(json, "format"); found != format)
      throw Error::mismatch('"' + std::string(format) + '"', capture::shown(found)).at("format");
    if (const Json& found = capture::valueAt(json, "version"); found != version)
      throw Error::mismatch(std::to_string(version), capture::shown(found)).at("version");
    const std::string stated = capture::required(json, "checksum", capture::textOf);
    if (const std::string found = ownChecksum(json); stated != found)
      throw Error::mismatch(stated, found).at("checksum");
    identity_ = contentHash(stated);
    const Json numbers = capture::required(json, "numbers", capture::objectOf);
    for (const auto& [name, value] : numbers.items())
      numbers_[name] = capture::within("numbers." + name, [&] { return capture::numberOf(value); });
    const Json files = capture::required(json, "files", capture::objectOf);
    for (const auto& [name, value] : files.items()) {
      if (fs::path(name).filename() != name) throw Error("leads out of the folder").at("files." + name);
      entries_[name] = {capture::required(value, "bytes", wholeNumber),
                        capture::required(value, "checksum", capture::textOf)};
    }
  } catch (Error& error) {
    throw std::move(error).in(manifest);
  }
  check(kRigFile, progress);
  rig_ = capture::readCapture(folder_, capture::PathRule::unmade);
  check(kMeshFile, progress);
  mesh_ = readMeshFile(folder_ / kMeshFile, progress);
}

double LightFieldFolder::number(std::string_view name, double lowest, double highest) const {
  const auto found = numbers_.find(std::string(name));
  const auto fail = [&](const std::string& value) {
    return Error::mismatch("a number from " + numberText(lowest) + " to " + numberText(highest), value)
        .at("numbers." + std::string(name))
        .in(folder_ / kManifestFile);
  };
  if (found == numbers_.end()) throw fail("nothing");
  if (!(found->second >= lowest && found->second <= highest)) throw fail(numberText(found->second));
  return found->second;
}

size_t LightFieldFolder::count(std::string_view name, size_t lowest, size_t highest) const {
  const double value = number(name, static_cast<double>(lowest), static_cast<double>(highest));
  if (value != std::floor(value))
    throw Error::mismatch("a whole number", numberText(value))
        .at("numbers." + std::string(name))
        .in(folder_ / kManifestFile);
  return static_cast<size_t>(value);
}

fs::path LightFieldFolder::file(std::string_view name) const {
  if (!entries_.contains(name))
    throw Error("missing").at("files." + std::string(name)).in(folder_ / kManifestFile);
  return folder_ / name;
}

void LightFieldFolder::check(std::string_view name, const Progress& progress) const {
  const fs::path path = file(name);
  const Entry& entry = entries_.find(name)->second;
  if (const uint64_t found = sizeOf(path); found != entry.bytes)
    throw Error::mismatch(std::to_string(entry.bytes) + " bytes", std::to_string(found) + " bytes").in(path);
  if (const std::string found = checksumOf(path, progress); found != entry.checksum)
    throw Error::mismatch(entry.checksum, found).at("checksum").in(path);
}

uint64_t LightFieldFolder::bytes() const {
  uint64_t sum = sizeOf(folder_ / kManifestFile);
  for (const auto& [name, entry] : entries_) sum += entry.bytes;
  return sum;
}

} // namespace surflect::lightfield
