#include "render/lightfield/olf/opacity_map_file.h"

#include "render/lightfield/lfm/lfm_file.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <span>
#include <string>
#include <utility>

namespace surflect::olf {

void writeMaps(const OpacityMaps& maps, const capture::Capture& capture, const std::filesystem::path& folder,
               const Progress& progress) {
  lightfield::LightFieldWriter writer(folder, kMapFormat, kMapVersion);
  writeFileAtomically(writer.file(lfm::kMapsFile), lfm::mapsBytes(maps.maps));
  writer.commit(capture, maps.maps.mesh,
                {{"terms", static_cast<double>(maps.maps.terms.size())},
                 {"samples", maps.maps.samples},
                 {"view_size", maps.maps.viewSize},
                 {"order", static_cast<double>(maps.order)},
                 {"white", maps.white}},
                progress);
}

OpacityMaps readMaps(const lightfield::LightFieldFolder& folder, const Progress& progress) {
  OpacityMaps maps;
  maps.white = folder.number("white", 1e-30, 1e30);
  maps.order = static_cast<Order>(folder.count("order", 0, static_cast<size_t>(Order::peel)));
  if (folder.mesh().triangles.empty()) throw Error("has no triangles").in(folder.path() / "mesh.bin");
  folder.check(lfm::kMapsFile, progress);
  const std::filesystem::path file = folder.file(lfm::kMapsFile);
  try {
    const std::string content = readFile(file, kLargestFile, progress);
    maps.maps = lfm::parseMaps(std::as_bytes(std::span(content)), folder.mesh(), kMapChannels);
  } catch (Error& error) {
    throw std::move(error).in(file);
  }
  return maps;
}

} // namespace surflect::olf
