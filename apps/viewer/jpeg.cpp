#include "apps/viewer/jpeg.h"

#include "surfel/base/error.h"

#include <turbojpeg.h>

#include <memory>

namespace surflect::viewer {

std::string jpegBytes(const DisplayPicture& picture, JpegQuality quality) {
  const bool isStill = quality == JpegQuality::still;
  const std::unique_ptr<void, decltype(&tjDestroy)> encoder(tjInitCompress(), &tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed =
      encoder
          ? tjCompress2(encoder.get(), picture.rgb.data(), picture.width, 0, picture.height, TJPF_RGB, &bytes,
                        &size, isStill ? TJSAMP_444 : TJSAMP_420, isStill ? 95 : 80, TJFLAG_FASTDCT)
          : -1;
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owned(bytes, &tjFree);
  if (failed != 0) throw Error(std::string("a picture cannot be encoded as JPEG: ") + tjGetErrorStr());
  return {reinterpret_cast<const char*>(bytes), size};
}

} // namespace surflect::viewer
