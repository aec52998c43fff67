// Entry point of the module that reads foreign picture formats. image_file.cpp loads the module at run time,
// because OpenImageIO costs every process that links it time and memory.
#pragma once

#include "srf/image/image.h"

#include <string>

namespace surflect::image {

struct ForeignPicture {
  Image image;
  int bits = 0; // bits, alphaPremultiplied and orientation as in Picture
  bool alphaPremultiplied = false;
  int orientation = 1;
  std::string iccProfile; // of JPEG and TIFF; empty if there is none
  int targaAlphaType = 0; // from a Targa's extension area; 0: no alpha, or not stated
};

enum class ForeignExtent { header, pixels }; // header: `image` has a size but no values

// Fills the picture, or returns false with the problem in one line.
using ReadForeign = bool(const char* path, ForeignExtent extent, ForeignPicture& picture,
                         std::string& problem);

inline constexpr const char* readForeignSymbol = "surflectReadForeign";

} // namespace surflect::image
