// Light field maps as indices into codebooks.  [Chen et al. 2002, §4]
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/vector_quantization.h"
#include "surfel/base/progress.h"

namespace surflect::lfm {

struct MapCodebookOptions {
  CodebookStart start = CodebookStart::split;
  double ratio = 10;     // maps for each codeword, at least 1; 0: no bound
  double distortion = 0; // mean squared error of a map's values: no more codewords than it takes, nearly
  bool means = false;    // whether mean maps have a codebook, too
};

// Maps of coding `bytes` with a codebook for the surface maps, and one for the view maps, of each term.
// Surface maps take the scalar layout. Errors count by the squares of the vertices' scales; users of scale 0
// lose their maps. Throws Error where both bounds are 0, and Cancelled.
LightFieldMaps withCodebooks(const LightFieldMaps& maps, const MapCodebookOptions& options = {},
                             const Progress& progress = {});

} // namespace surflect::lfm
