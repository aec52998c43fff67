#include "srf/model/white_level.h"

#include <algorithm>

namespace surflect::model {

void WhiteLevel::add(const codec::ReflectanceStack& stack, const image::Mask& object,
                     const Progress& progress) {
  for (const image::Image& light : stack.lights) {
    progress.checkpoint();
    for (size_t texel = 0; texel < object.inside.size(); ++texel)
      if (object.inside[texel])
        for (size_t c = 0; c < 3; ++c) values_.add(light.values[3 * texel + c]);
  }
}

double WhiteLevel::value() const { return std::clamp(values_.percentile(0.995), 1e-20, 1e20); }

} // namespace surflect::model
