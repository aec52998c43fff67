#include "srf/capture/picture_encoding.h"

#include "surfel/base/error.h"

namespace surflect {

Transfer usualTransfer(int bits) { return {bits == 8 ? Transfer::Curve::srgb : Transfer::Curve::linear}; }

ColorEncoding encodingOf(const std::optional<ColorSpace>& ofCapture,
                         const std::optional<ColorStatement>& ofFile, const std::filesystem::path& picture) {
  if (ofCapture)
    return {Transfer{*ofCapture == ColorSpace::srgb ? Transfer::Curve::srgb : Transfer::Curve::linear},
            kRec709, nullptr};
  if (!ofFile) return {};
  if (!ofFile->problem.empty())
    throw Error(ofFile->problem + "; color_space of the capture, linear or srgb, would overrule it (import: "
                                  "--color-space)")
        .at(ofFile->source)
        .in(picture);
  return ofFile->encoding;
}

} // namespace surflect
