// The page of one view under a lamp that is dragged: principal planes in tiles, and the page that draws them.
//
// In the folder (page_folder.h):
//
//   data.js                        size, levels, ranges of planes, lights, functions of the light
//   tiles/LEVEL/X_Y.js             a grey JPEG of each plane, base64; level 0 is the full picture,
//                                  each further one half of it
//   object.ptm                     if asked for: the photographs for other RTI viewers
//   annotations.json, .js          annotations, for people and for the page (annotations.h)
#pragma once

#include "apps/web/page_folder.h"
#include "srf/planes/left_out.h"
#include "srf/planes/stack.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <string>
#include <vector>

namespace surflect::web {

inline constexpr const char* kPtmFile = "object.ptm";
inline constexpr int kTile = 512;      // pixels a side
inline constexpr int kMostPlanes = 14; // and two of normals: browsers draw with at least 16 textures

struct PageOptions {
  int planes = 9;
  int quality = 90;      // of the JPEG of the widest plane
  bool ptm = false;      // object.ptm beside the page
  bool readOnly = false; // visitors write no annotations
};

struct PageReport {
  int planes = 0, levels = 0, tiles = 0;
  bool hasNormals = false;
  double white = 1;        // share of reflected light that is shown as white
  planes::Errors captured; // photographs under their own lights, as the page shows them
  std::vector<planes::LeftOutLight> leftOut;
};

// Writes the page, but its annotations, into a folder that exists. `complete` gives the mark of an object,
// whose scale is pixels per millimetre.
PageReport writeRelitPage(const planes::Stack& stack, const std::filesystem::path& folder,
                          const PageOptions& options, const CompleteMark& complete, const Progress& progress);

} // namespace surflect::web
