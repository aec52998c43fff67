// The one door of the module that reads foreign picture formats. Not linked: image_file.cpp loads the module
// when a foreign file comes, because OpenImageIO costs every process that links it 160 ms and 133 MB.
#pragma once

#include "srf/image/image.h"

#include <string>

namespace surflect::image {

struct ForeignPicture {
  Image image;
  int bits = 0; // these three as in Picture
  bool alphaPremultiplied = false;
  int orientation = 1;
  std::string iccProfile; // of JPEG and TIFF; empty: none
  int targaAlphaType = 0; // of a Targa's extension area; 0: no alpha, or the file does not say
};

enum class ForeignExtent { header, pixels }; // header: the picture's image has its size and no values

// Fills the picture, or returns false with the problem in one line.
using ReadForeign = bool(const char* path, ForeignExtent extent, ForeignPicture& picture,
                         std::string& problem);

inline constexpr const char* readForeignSymbol = "surflectReadForeign";

} // namespace surflect::image
