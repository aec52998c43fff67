#include "render/splat/pixel_layers.h"

#include "render/splat/footprint.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace surflect::splat {

float saturated(float area) {
  return std::clamp((area - (1 - kOpaqueArea)) / (2 * kOpaqueArea - 1), 0.f, 1.f);
}

void layersOf(const std::vector<Fragment>& fragments, bool keepsHidden, std::vector<Layer>& layers) {
  layers.clear();
  float area = 0, alpha = 0;
  for (size_t begin = 0, end; begin < fragments.size() && (keepsHidden || alpha < 1); begin = end) {
    float layerArea = 0, back = -std::numeric_limits<float>::infinity();
    for (end = begin; end < fragments.size(); ++end) {
      const Fragment& f = fragments[end];
      if (end > begin && f.order - f.tolerance > back) break;
      if (layerArea < kLayerAnchorArea) back = std::max(back, f.order + f.tolerance);
      layerArea += f.area;
    }
    area += layerArea;
    const float alphaBefore = std::exchange(alpha, saturated(area));
    layers.push_back({begin, end, layerArea, alpha - alphaBefore});
  }
}

} // namespace surflect::splat
