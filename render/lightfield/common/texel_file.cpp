#include "render/lightfield/common/texel_file.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <string>

namespace surflect::lightfield {

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
