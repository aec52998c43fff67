#include "render/lightfield/slf/texture_file.h"

#include "render/lightfield/common/texel_file.h"
#include "surfel/base/error.h"

#include <cassert>
#include <string>

namespace surflect::slf {

TextureFile::TextureFile(OpenFile file, TexturePlaces places, std::span<const Region> regions)
    : file_(std::move(file)), places_(std::move(places)) {
  assert(places_.size() == regions.size());
  for (const Region& region : regions) sizes_.push_back(region.chart.texels());
}

std::vector<Texel> TextureFile::read(size_t region, size_t direction) const {
  std::vector<Texel> texels(sizes_[region]); // black
  const uint64_t place = places_[region][direction];
  if (place == kNotStored) return texels;
  try {
    lightfield::readTexels(file_, place, texels);
  } catch (Error& error) {
    throw std::move(error).at("texture " + std::to_string(direction) + " of region " +
                              std::to_string(region));
  }
  return texels;
}

} // namespace surflect::slf
