#include "render/lightfield/spherical/detail_control.h"

namespace surflect::spherical {

DetailControl::DetailControl(size_t levels, const ControlOptions& options)
    : finest_(3 * (static_cast<int>(levels) - 1)), options_(options) {}

double DetailControl::choose(const std::function<double(double detail)>& predicted) {
  const auto fits = [&](int thirds, double share) {
    return predicted(thirds / 3.0) <= share * options_.budget;
  };
  if (!fits(thirds_, 1)) {
    while (thirds_ > 0 && !fits(thirds_, 1)) --thirds_;
    waiting_ = options_.patience;
    return thirds_ / 3.0;
  }
  if (waiting_ > 0) {
    --waiting_;
    return thirds_ / 3.0;
  }
  const int next = thirds_ + 1, whole = thirds_ / 3 * 3 + 3;
  if (next <= finest_ && fits(next, options_.headroom))
    thirds_ = next;
  else if (whole <= finest_ && fits(whole, options_.headroom))
    thirds_ = whole;
  return thirds_ / 3.0;
}

} // namespace surflect::spherical
