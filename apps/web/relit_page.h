// The page of one view under a lamp that is dragged: principal planes in tiles, and the page that draws them.
//
// The folder, which browsers open from a disk, where they read scripts but no pixels of other files:
//
//   index.html, style.css, *.js    the page
//   data.js                        size, levels, ranges of planes, lights, functions of the light
//   tiles/LEVEL/X_Y.js             a grey JPEG of each plane, base64; level 0 is the full picture,
//                                  each further one half of it
//   object.ptm                     if asked for: the photographs for other RTI viewers
//   annotations.json, .js          annotations, for people and for the page (annotations.h)
//   surflect-page.json             marks the folder as a page that another export may replace
#pragma once

#include "srf/planes/left_out.h"
#include "srf/planes/stack.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::web {

inline constexpr const char* kMarkFile = "surflect-page.json";
inline constexpr int kTile = 512;      // pixels a side
inline constexpr int kMostPlanes = 14; // and two of normals: browsers draw with at least 16 textures

inline constexpr double kLeastScale = 1e-6, kGreatestScale = 1e6; // pixels per millimetre

// A page that is there: its object, by the hash of photographs and lights, with its title and scale.
struct EarlierPage {
  std::string object, title;
  std::optional<double> pixelsPerMm;
};

struct PageOptions {
  std::string title; // empty: that of the earlier page of the same object, else the name
  std::string name;
  EarlierPage earlier;
  int planes = 9;
  int quality = 90;                  // of the JPEG of the widest plane
  std::optional<double> pixelsPerMm; // none: that of the earlier page of the same object
  bool ptm = false;                  // object.ptm beside the page
};

struct PageReport {
  int planes = 0, levels = 0, tiles = 0;
  bool hasNormals = false;
  double white = 1;        // share of reflected light that is shown as white
  planes::Errors captured; // photographs under their own lights, as the page shows them
  std::vector<planes::LeftOutLight> leftOut;
};

// Reads what the page in a folder keeps for its next export; of another folder, nothing.
EarlierPage earlierPage(const std::filesystem::path& folder);

// Returns whether exports write a file or folder of this name at the top of a page's folder.
bool isOfRelitPage(std::string_view name);

// Writes the page, but its annotations, into a folder that exists.
PageReport writeRelitPage(const planes::Stack& stack, const std::filesystem::path& folder,
                          const PageOptions& options, const Progress& progress);

} // namespace surflect::web
