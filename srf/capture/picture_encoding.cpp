#include "srf/capture/picture_encoding.h"

#include "surfel/base/error.h"

namespace surflect::capture {

image::Transfer usualTransfer(int bits) {
  return {bits == 8 ? image::Transfer::Curve::srgb : image::Transfer::Curve::linear};
}

image::ColorEncoding encodingOf(const std::optional<ColorSpace>& ofCapture,
                                const std::optional<image::ColorStatement>& ofFile,
                                const std::filesystem::path& picture) {
  if (ofCapture)
    return {image::Transfer{*ofCapture == ColorSpace::srgb ? image::Transfer::Curve::srgb
                                                           : image::Transfer::Curve::linear},
            image::kRec709, nullptr};
  if (!ofFile) return {};
  if (!ofFile->problem.empty())
    throw Error(ofFile->problem + "; color_space of the capture, linear or srgb, would overrule it (import: "
                                  "--color-space)")
        .at(ofFile->source)
        .in(picture);
  return ofFile->encoding;
}

} // namespace surflect::capture
