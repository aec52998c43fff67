#include "srf/image/color.h"

#include "srf/image/icc.h"
#include "surfel/base/error.h"

#include <Eigen/LU>

#include <array>
#include <cassert>
#include <cmath>
#include <utility>

namespace surflect::image {

namespace {

// Tolerance for rounding of primaries: 64000/100000 in PNG, 0.64 as float in EXR, 0.3127 or 0.31271.
constexpr double kRounding = 1e-3;

bool isNear(const Chromaticity& a, const Chromaticity& b) {
  return std::abs(a.x - b.x) <= kRounding && std::abs(a.y - b.y) <= kRounding;
}

bool isNear(const Primaries& a, const Primaries& b) {
  return isNear(a.red, b.red) && isNear(a.green, b.green) && isNear(a.blue, b.blue) &&
         isNear(a.white, b.white);
}

// XYZ of a white point, scaled to Y = 1.
Vec3<double> xyzOf(const Chromaticity& c) { return {c.x / c.y, 1, (1 - c.x - c.y) / c.y}; }

Error noColors() {
  return Error::mismatch("chromaticities of three primaries around a white", "others").at("primaries");
}

// Inverse of the camera's curve: 4.5 L below L = 0.018, 1.099 L^0.45 - 0.099 above.  [BT.709, item 1.2]
float linearFromBt709(float stored) {
  return stored < 0.081f ? stored / 4.5f : std::pow((stored + 0.099f) / 1.099f, 1 / 0.45f);
}

} // namespace

bool isRec709(const Primaries& primaries) { return isNear(primaries, kRec709); }

Mat3<double> xyzFromRgb(const Primaries& primaries) {
  Mat3<double> P;
  P << Vec3<double>(primaries.red.x, primaries.red.y, 1 - primaries.red.x - primaries.red.y),
      Vec3<double>(primaries.green.x, primaries.green.y, 1 - primaries.green.x - primaries.green.y),
      Vec3<double>(primaries.blue.x, primaries.blue.y, 1 - primaries.blue.x - primaries.blue.y);
  // Scaling to Y = 1 would make a primary without luminance infinite, so columns are scaled to sum 1.
  const double area = P.determinant();
  if (!(std::abs(area) > 1e-4) || !(primaries.white.y > 1e-3)) throw noColors();
  const Vec3<double> W = xyzOf(primaries.white), s = P.inverse() * W;
  if (!s.allFinite() || !(s.minCoeff() > 0)) throw noColors();
  return P * s.asDiagonal();
}

Mat3<double> adaptation(const Chromaticity& from, const Chromaticity& to) {
  if (from == to) return Mat3<double>::Identity();
  Mat3<double> bradford;
  bradford << 0.8951, 0.2664, -0.1614, //
      -0.7502, 1.7135, 0.0367,         //
      0.0389, -0.0685, 1.0296;
  const Vec3<double> scale = (bradford * xyzOf(to)).cwiseQuotient(bradford * xyzOf(from));
  return bradford.inverse() * scale.asDiagonal() * bradford;
}

Mat3<double> rec709From(const Primaries& primaries) {
  const Mat3<double> xyz = xyzFromRgb(primaries);
  if (isRec709(primaries)) return Mat3<double>::Identity();
  return xyzFromRgb(kRec709).inverse() * adaptation(primaries.white, kRec709.white) * xyz;
}

float linearised(const Transfer& transfer, float stored) {
  switch (transfer.curve) {
  case Transfer::Curve::linear:
    return stored;
  case Transfer::Curve::srgb:
    return linearFromSrgb(stored);
  case Transfer::Curve::bt709:
    return linearFromBt709(stored);
  case Transfer::Curve::gamma:
    return std::copysign(std::pow(std::abs(stored), static_cast<float>(transfer.exponent)), stored);
  }
  return stored;
}

std::string described(const ColorEncoding& encoding, const Transfer& fallback) {
  if (encoding.profile) return "ICC profile '" + encoding.profile->name() + "'";
  const Transfer transfer = encoding.transfer.value_or(fallback);
  std::string text;
  switch (transfer.curve) {
  case Transfer::Curve::linear:
    text = "linear";
    break;
  case Transfer::Curve::srgb:
    text = "sRGB";
    break;
  case Transfer::Curve::bt709:
    text = "Rec. 709's curve";
    break;
  case Transfer::Curve::gamma:
    text = "gamma " + numberText(std::round(1000 * transfer.exponent) / 1000);
    break;
  }
  if (!encoding.primaries || isRec709(*encoding.primaries)) return text;
  static constexpr std::array<std::pair<Primaries, const char*>, 5> known{{{kAdobeRgb, "Adobe RGB"},
                                                                           {kDisplayP3, "Display P3"},
                                                                           {kRec2020, "Rec. 2020"},
                                                                           {kAces, "ACES"},
                                                                           {kAcesCg, "ACEScg"}}};
  for (const auto& [primaries, name] : known)
    if (isNear(primaries, *encoding.primaries)) return text + ", primaries of " + name;
  return text + ", other primaries";
}

ColorDecoder::ColorDecoder(const ColorEncoding& encoding, const Transfer& fallback)
    : transfer_(encoding.transfer.value_or(fallback)), profile_(encoding.profile) {
  if (!profile_ && encoding.primaries && !isRec709(*encoding.primaries))
    rec709_ = rec709From(*encoding.primaries).cast<float>();
}

void ColorDecoder::toRec709(float* linearRgb) const {
  if (!rec709_) return;
  Eigen::Map<Vec3<float>> color(linearRgb);
  color = (*rec709_ * color).eval();
}

Image decoded(const Image& colors, const ColorDecoder& decoder) {
  assert(colors.channels == 1 || colors.channels == 3);
  Image linear(colors.width, colors.height, 3);
  const size_t pixels = linear.values.size() / 3;
  if (decoder.profile()) {
    assert(decoder.profile()->channels() == colors.channels);
    decoder.profile()->toRec709(colors.values.data(), linear.values.data(), pixels);
    return linear;
  }
  for (size_t i = 0; i < pixels; ++i) {
    float* rgb = linear.values.data() + 3 * i;
    for (size_t c = 0; c < 3; ++c)
      rgb[c] = decoder.linear(colors.values[colors.channels == 3 ? 3 * i + c : i]);
    if (colors.channels == 3) decoder.toRec709(rgb);
  }
  return linear;
}

} // namespace surflect::image
