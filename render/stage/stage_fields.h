// Values of a stage file. All functions throw Error with the bounds if a value is outside.
#pragma once

#include "render/scene/script_fields.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <string_view>

namespace surflect::stage {

using scene::numberIn, scene::asVector;
double positive(const scene::Entry& entry); // 1e-9 to 1e9
int integerOr(const scene::Section& section, std::string_view key, int least, int most, int otherwise);
Point3<AcquisitionSpace, double> pointOr0(const scene::Section& section, std::string_view key);
Rgb asColor(const scene::Entry& entry, double least, double most); // [r, g, b]

} // namespace surflect::stage
