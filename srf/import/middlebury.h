// Middlebury multi-view stereo: NAME_par.txt with pictures beside it, fixed light.
//
// The first line is the number of pictures; then one line each: img.png k11 k12 .. k33 r11 r12 .. r33 t1 t2
// t3 with P = K [R t], x right, y down, z forwards. Whole pixel coordinates are pixel centres. [Seitz et al.
// 2006, https://vision.middlebury.edu/mview/data/]
#pragma once

#include "srf/import/foreign_capture.h"

#include <filesystem>

namespace surflect::importers {

// K may have any scale, but no skew. Pictures that NAME_good_silhouette_images.txt beside it does not list
// have poor silhouettes. Throws Error with the line.
ForeignCapture readMiddlebury(const std::filesystem::path& parameters, bool allowOutside);

} // namespace surflect::importers
