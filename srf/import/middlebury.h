// Multi-view stereo data of Middlebury: NAME_par.txt, pictures beside it, fixed light.
//
// First line the number of pictures, then one a line: img.png k11 k12 .. k33 r11 r12 .. r33 t1 t2 t3 with
// P = K [R t], x right, y down, z forwards. Whole pixel coordinates are pixel centres.
// [Seitz et al. 2006, https://vision.middlebury.edu/mview/data/]
#pragma once

#include "srf/import/source.h"

#include <filesystem>

namespace surflect::importers {

// K without skew, of any scale. Where NAME_good_silhouette_images.txt lies beside, pictures that it does not
// list have poor silhouettes. Throws Error with the line.
Source readMiddlebury(const std::filesystem::path& parameters, bool allowOutside);

} // namespace surflect::importers
