// Entry points of the module that reads foreign picture formats and OpenColorIO's configurations. It is
// loaded at run time, because OpenImageIO costs every process that links it time and memory.
#pragma once

#include "srf/image/image.h"

#include <memory>
#include <string>
#include <vector>

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

// A view on a display of the configuration that $OCIO names.
struct ForeignView {
  std::string display, view;                // wanted; or empty, to be filled with the preferred ones
  std::vector<std::string> displays, views; // those there are; views of the display, if there is such a one
  std::string source;                       // colour space that the pictures are taken to be in
  // Colours of the display from linear colours, RGB, in place. Thread-safe. Null if display or view is not
  // there.
  std::shared_ptr<const void> processor;
  void (*apply)(const void* processor, float* rgb, size_t pixels) = nullptr;
};

// Opens the view, or returns false with the problem in one line.
using OpenForeignView = bool(ForeignView& view, std::string& problem);

inline constexpr const char* openForeignViewSymbol = "surflectOpenForeignView";

// Address of an entry point in the loaded module. Throws Error if the module is missing or cannot be loaded.
void* foreignDoor(const char* symbol);

} // namespace surflect::image
