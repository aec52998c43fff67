#include "srf/image/foreign/foreign.h"
#include "srf/image/foreign_file.h"
#include "srf/image/radiance.h"
#include "surfel/base/error.h"
#include "tests/fuzz/fuzz.h"

#include <unistd.h>

#include <array>
#include <string>

namespace surflect {
extern "C" image::ReadForeign surflectReadForeign; // foreign.cpp, linked here without its module
}

// The first byte says of what format.
void surflect::fuzz_foreign(std::string_view input) {
  static constexpr std::array extensions = {"jpg", "tif", "hdr", "bmp", "tga", "ppm", "webp"};
  if (input.empty()) return;
  const auto content = memoryFile(input.substr(1));
  const std::string extension = extensions[static_cast<uint8_t>(input[0]) % extensions.size()];
  if (extension == "hdr") {
    const image::RadiancePicture picture = image::readRadiance(content);
    if (picture.header.color && picture.header.color->problem.empty())
      image::decoded(picture.image, {picture.header.color->encoding, {}});
    return;
  }
  const std::filesystem::path path = std::filesystem::temp_directory_path() /
                                     ("surflect_fuzz." + std::to_string(::getpid()) + "." + extension);
  std::filesystem::create_symlink(content, path); // OpenImageIO chooses by the extension
  image::ForeignPicture picture;
  std::string problem;
  const bool read = surflectReadForeign(path.c_str(), image::ForeignExtent::pixels, picture, problem);
  std::filesystem::remove(path);
  if (!read) throw Error(problem);
  image::completed(std::move(picture), content, "." + extension);
}
