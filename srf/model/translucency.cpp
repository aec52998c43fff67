#include "srf/model/translucency.h"

#include <algorithm>
#include <cassert>

namespace surflect::model {

namespace {

// Alpha that 8 bits tell from clear and from opaque.
constexpr float kClear = 0.5f / 255, kOpaque = 1 - kClear;
constexpr int kEdge = 2; // pixels

bool isEdge(const image::Image& alpha, int x, int y) {
  bool hasClear = false, hasOpaque = false;
  for (int j = std::max(0, y - kEdge); j <= std::min(alpha.height - 1, y + kEdge); ++j)
    for (int i = std::max(0, x - kEdge); i <= std::min(alpha.width - 1, x + kEdge); ++i) {
      hasClear |= alpha.at(i, j)[0] < kClear;
      hasOpaque |= alpha.at(i, j)[0] > kOpaque;
    }
  return hasClear && hasOpaque;
}

} // namespace

void TranslucencySurvey::add(const image::Image& alpha) {
  assert(alpha.channels == 1);
  for (int y = 0; y < alpha.height; ++y)
    for (int x = 0; x < alpha.width; ++x) {
      const float own = alpha.at(x, y)[0];
      if (!(own >= kClear)) continue;
      ++object_;
      translucent_ += own <= kOpaque && !isEdge(alpha, x, y);
    }
}

double TranslucencySurvey::share() const {
  return object_ > 0 ? static_cast<double>(translucent_) / static_cast<double>(object_) : 0;
}

} // namespace surflect::model
