#include "render/lightfield/common/light_field_folder.h"

#include "srf/capture/json_fields.h"
#include "srf/capture/writer.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>
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

// Checksum of a file that may be larger than memory: hash of the hashes of its portions.
std::string checksumOf(const OpenFile& file, const Progress& progress) {
  constexpr uint64_t kPortion = uint64_t{1} << 20;
  std::vector<uint64_t> hashes((file.bytes() + kPortion - 1) / kPortion);
  tbb::parallel_for(size_t{0}, hashes.size(), [&](size_t i) {
    progress.checkpoint();
    UninitializedVector<std::byte> portion(std::min(kPortion, file.bytes() - i * kPortion));
    file.read(i * kPortion, portion);
    hashes[i] = contentHash(portion);
  });
  return hex(contentHash(std::as_bytes(std::span(hashes))));
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

// Format of a finished light field in a folder; empty if there is none.
std::string formatOf(const fs::path& folder) {
  std::error_code unknown; // reported when reading or writing
  if (!fs::exists(folder / kManifestFile, unknown)) return "";
  const Json json = Json::parse(readFile(folder / kManifestFile, kLargestText), nullptr, false);
  if (!json.is_object() || !json.contains("files")) return ""; // a surfel model has no such field
  const Json& format = capture::valueAt(json, "format");
  return format.is_string() ? format.get<std::string>() : "";
}

// Whether a light field was written, or begun, in a folder.
bool isLightField(const fs::path& folder) {
  return fs::exists(folder / kUnfinishedFile) || formatOf(folder).starts_with(kTagStart);
}

size_t wholeNumber(const Json& value) {
  if (!value.is_number_unsigned()) throw Error::mismatch("a count", capture::shown(value));
  return value.get<size_t>();
}

} // namespace

void describeMesh(Archive& archive, TriangleMesh& mesh) {
  size_t positions = mesh.positions.size(), triangles = mesh.triangles.size();
  archive.number<uint64_t>("positions", positions, {});
  archive.number<uint64_t>("triangles", triangles, {});
  archive.array<float>("positions", mesh.positions, positions);
  archive.array<uint32_t>("triangles", mesh.triangles, triangles, Below(positions));
}

void requireDisk(const std::filesystem::path& folder, double bytes, const std::string& what) {
  const std::optional<uint64_t> free = freeBytes(folder);
  if (!free) return;       // reported when writing
  std::error_code failure; // likewise
  auto available = static_cast<double>(*free);
  for (const auto& entry : std::filesystem::directory_iterator(folder, failure))
    if (entry.is_regular_file(failure)) available += static_cast<double>(entry.file_size(failure));
  if (bytes <= available) return;
  constexpr double kGibibyte = 1 << 30;
  throw Error(fmt::format("needs {:.1f} GiB on disk for {}, but {:.1f} GiB are free at {}", bytes / kGibibyte,
                          what, available / kGibibyte, folder.string()));
}

bool isFinished(const fs::path& folder, std::string_view format) { return formatOf(folder) == format; }

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

void LightFieldWriter::write(std::string_view name, std::span<const std::byte> content) {
  writeFileAtomically(file(name), content);
}

void LightFieldWriter::commit(const capture::Capture& capture, const TriangleMesh& mesh,
                              const Numbers& numbers, const Progress& progress) {
  capture::writeCapture(rigOf(capture), folder_);
  file(kRigFile);
  write(kMeshFile, written(mesh, describeMesh));
  finish(numbers, progress);
}

void LightFieldWriter::commit(const LightFieldFolder& source, const Numbers& numbers,
                              const Progress& progress) {
  for (const char* name : {kRigFile, kMeshFile})
    source.read(name, progress, [&](std::span<const std::byte> bytes) { write(name, bytes); });
  finish(numbers, progress);
}

void LightFieldWriter::finish(const Numbers& numbers, const Progress& progress) {
  Json json = {{"format", format_}, {"version", version_}, {"numbers", numbers}, {"files", Json::object()}};
  for (const auto& [name, path] : files_) {
    const OpenFile file(path);
    json["files"][name] = {{"bytes", file.bytes()}, {"checksum", checksumOf(file, progress)}};
  }
  writeFileAtomically(folder_ / kManifestFile, capture::sealedText(json));
  fs::remove(folder_ / kUnfinishedFile);
}

LightFieldFolder::LightFieldFolder(fs::path folder, std::string_view format, int version,
                                   const Progress& progress)
    : folder_(std::move(folder)) {
  const fs::path manifest = folder_ / kManifestFile;
  if (!fs::exists(manifest) && fs::exists(folder_ / kUnfinishedFile))
    throw Error("unfinished light field: run the same build again").in(manifest);
  inFile(manifest, [&] {
    const Json json = capture::parseSealed(readFile(manifest, kLargestText), format, {version});
    identity_ = contentHash(json["checksum"].get<std::string>());
    const Json numbers = capture::required(json, "numbers", capture::objectOf);
    for (const auto& [name, value] : numbers.items()) {
      const Json& number = value;
      numbers_[name] = atField("numbers." + name, [&] { return capture::numberOf(number); });
    }
    const Json files = capture::required(json, "files", capture::objectOf);
    for (const auto& [name, value] : files.items()) {
      if (fs::path(name).filename() != name) throw Error("leads out of the folder").at("files." + name);
      entries_[name] = {capture::required(value, "bytes", wholeNumber),
                        capture::required(value, "checksum", capture::textOf)};
    }
  });
  checked(kRigFile, progress);
  rig_ = capture::readCapture(folder_, capture::PathRule::unmade);
  mesh_ = storedMesh(*this, kMeshFile, progress);
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

OpenFile LightFieldFolder::checked(std::string_view name, const Progress& progress) const {
  OpenFile file(this->file(name));
  const Entry& entry = entries_.find(name)->second;
  if (file.bytes() != entry.bytes)
    throw Error::mismatch(std::to_string(entry.bytes) + " bytes", std::to_string(file.bytes()) + " bytes")
        .in(file.path());
  if (const std::string found = checksumOf(file, progress); found != entry.checksum)
    throw Error::mismatch(entry.checksum, found).at("checksum").in(file.path());
  return file;
}

TriangleMesh storedMesh(const LightFieldFolder& folder, std::string_view name, const Progress& progress) {
  TriangleMesh mesh;
  folder.read(name, progress, [&](std::span<const std::byte> bytes) {
    parse(bytes, [&](Archive& archive) { describeMesh(archive, mesh); });
  });
  return mesh;
}

uint64_t LightFieldFolder::bytes() const {
  uint64_t sum = OpenFile(folder_ / kManifestFile).bytes();
  for (const auto& [name, entry] : entries_) sum += entry.bytes;
  return sum;
}

void requireTexels(const OpenFile& file, uint64_t texels) {
  if (file.bytes() % sizeof(Texel) != 0 || file.bytes() / sizeof(Texel) != texels)
    throw Error::mismatch(std::to_string(texels) + " texels of 8 bytes",
                          std::to_string(file.bytes()) + " bytes")
        .in(file.path());
}

void readTexels(const OpenFile& file, uint64_t first, std::span<Texel> texels, const Progress& progress) {
  constexpr size_t kPortion = size_t{1} << 20;
  for (size_t begin = 0; begin < texels.size(); begin += kPortion) {
    progress.checkpoint();
    const auto portion = texels.subspan(begin, std::min(kPortion, texels.size() - begin));
    file.read((first + begin) * sizeof(Texel), std::as_writable_bytes(portion));
    if (const auto bad = std::ranges::find_if_not(portion, isFinite); bad != portion.end())
      throw Error("is not finite")
          .at("texel " + std::to_string(first + begin + static_cast<size_t>(bad - portion.begin())))
          .in(file.path());
  }
}

} // namespace surflect::lightfield
