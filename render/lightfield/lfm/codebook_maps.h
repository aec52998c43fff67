// Light field maps as indices into codebooks.  [Chen et al. 2002, §4]
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/vector_quantization.h"
#include "surfel/base/progress.h"

namespace surflect::lfm {

struct MapCodebookOptions {
  CodebookStart start = CodebookStart::split;
  double ratio = 10;     // maps per codeword, at least 1; 0: no bound
  double distortion = 0; // mean squared error of a map's values that suffices; 0: no bound
  bool means = false;    // whether mean maps get a codebook, too
};

// Maps of coding `bytes` with a codebook for the surface maps, and one for the view maps, of each term.
// Surface maps take the scalar layout. There are about as few codewords as the bounds allow. Errors are
// weighted by the squares of the vertices' scales; users of scale 0 have no map afterwards. Throws Error if
// both bounds are 0, and Cancelled.
LightFieldMaps withCodebooks(const LightFieldMaps& maps, const MapCodebookOptions& options = {},
                             const Progress& progress = {});

} // namespace surflect::lfm
