#include "render/lightfield/olf/opacity_maps.h"

#include "render/lightfield/lfm/lfm_file.h"
#include "surfel/base/error.h"

namespace surflect::olf {

namespace {

void describeMapNumbers(lightfield::NumberArchive& archive, OpacityMaps& maps) {
  archive.number("white", maps.white, {1e-30, 1e30});
  archive.number("order", maps.order, {0, static_cast<double>(Order::peel)});
}

} // namespace

namespace {

lightfield::Numbers numbersOf(const OpacityMaps& maps) {
  lightfield::Numbers numbers = lfm::numbersOf(maps.maps);
  numbers.merge(lightfield::numbersOf(maps, describeMapNumbers));
  return numbers;
}

} // namespace

void writeMaps(const OpacityMaps& maps, const capture::Capture& capture, const std::filesystem::path& folder,
               const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kMapFormat, kMapVersion);
  writer.write(lfm::kMapsFile, lfm::mapsBytes(maps.maps));
  writer.commit(capture, maps.maps.mesh, numbersOf(maps), progress);
}

void writeMaps(const OpacityMaps& maps, const lightfield::LightFieldFolder& source,
               const std::filesystem::path& folder, const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kMapFormat, kMapVersion);
  writer.write(lfm::kMapsFile, lfm::mapsBytes(maps.maps));
  writer.commit(source, numbersOf(maps), progress);
}

OpacityMaps readMaps(const lightfield::LightFieldFolder& folder, const Progress& progress) {
  OpacityMaps maps;
  lightfield::NumberArchive numbers(folder);
  describeMapNumbers(numbers, maps);
  if (folder.mesh().triangles.empty()) throw Error("has no triangles").in(folder.path() / "mesh.bin");
  maps.maps = lfm::readMaps(folder, kMapChannels, progress);
  return maps;
}

} // namespace surflect::olf
