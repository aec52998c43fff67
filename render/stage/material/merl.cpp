#include "render/stage/material/merl.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <string>

namespace surflect::material {

namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in memory");

constexpr size_t kBins = MerlTable::kThetaH * MerlTable::kThetaD * MerlTable::kPhiD;
constexpr size_t kHeader = 3 * sizeof(int32_t);
constexpr size_t kBytes = kHeader + 3 * kBins * sizeof(double);
constexpr std::array kScales{1.0 / 1500, 1.15 / 1500, 1.66 / 1500};

template <class T> T valueAt(const std::string& bytes, size_t offset) {
  T value;
  std::memcpy(&value, &bytes[offset], sizeof(T));
  return value;
}

std::string sizes(const std::array<int32_t, 3>& d) {
  return std::to_string(d[0]) + " x " + std::to_string(d[1]) + " x " + std::to_string(d[2]);
}

std::vector<Rgb> decoded(const std::string& bytes) {
  const std::array<int32_t, 3> wanted{MerlTable::kThetaH, MerlTable::kThetaD, MerlTable::kPhiD};
  if (bytes.size() < kHeader)
    throw Error::mismatch(std::to_string(kBytes) + " bytes", std::to_string(bytes.size()));
  const std::array<int32_t, 3> found{valueAt<int32_t>(bytes, 0), valueAt<int32_t>(bytes, 4),
                                     valueAt<int32_t>(bytes, 8)};
  if (found != wanted) throw Error::mismatch(sizes(wanted), sizes(found)).at("dimensions");
  if (bytes.size() != kBytes)
    throw Error::mismatch(std::to_string(kBytes) + " bytes", std::to_string(bytes.size()));
  std::vector<Rgb> values(kBins);
  for (size_t channel = 0; channel < 3; ++channel)
    for (size_t i = 0; i < kBins; ++i) {
      const double value =
          kScales[channel] * valueAt<double>(bytes, kHeader + (channel * kBins + i) * sizeof(double));
      if (!(std::abs(value) <= 1e30)) // fits into a float
        throw Error::mismatch("a finite number", numberText(value)).at("values[" + std::to_string(i) + "]");
      (channel == 0   ? values[i].r
       : channel == 1 ? values[i].g
                      : values[i].b) = static_cast<float>(std::max(0.0, value));
    }
  return values;
}

// Coordinates in bins.
double placeOfThetaH(double theta) { return std::sqrt(theta / (kPi / 2)) * MerlTable::kThetaH; }
double thetaHAt(double place) { return kPi / 2 * squared(place / MerlTable::kThetaH); }

// The two bins with nearest centres, and the interpolation weight of the second.
struct Neighbors {
  size_t low, high;
  float fraction;
};
Neighbors between(double place, size_t bins) {
  const double x = std::clamp(place - 0.5, 0.0, static_cast<double>(bins - 1));
  const auto low = static_cast<size_t>(x);
  return {low, std::min(low + 1, bins - 1), static_cast<float>(x - std::floor(x))};
}
Neighbors around(double place, size_t bins) {
  const double x = place - 0.5 + (place < 0.5 ? static_cast<double>(bins) : 0);
  const auto low = static_cast<size_t>(x);
  return {low % bins, (low + 1) % bins, static_cast<float>(x - std::floor(x))};
}

// Polar angle, without acos's loss of digits near 0.
double angleOf(const ShadingDirection& w) { return std::atan2(std::hypot(w.x(), w.y()), w.z()); }

// wi in the frame with pole h, in which the normal has azimuth 180 degrees.  [Rusinkiewicz 1998]
ShadingDirection difference(const ShadingDirection& wi, const ShadingDirection& h) {
  const double sine = std::hypot(h.x(), h.y());
  const double c = sine > 0 ? h.x() / sine : 1, s = sine > 0 ? h.y() / sine : 0;
  const ShadingDirection turned(c * wi.x() + s * wi.y(), c * wi.y() - s * wi.x(), wi.z());
  return {h.z() * turned.x() - sine * turned.z(), turned.y(), sine * turned.x() + h.z() * turned.z()};
}

} // namespace

MerlTable::MerlTable(const std::filesystem::path& file) {
  try {
    values_ = decoded(readFile(file, 2 * kBytes));
  } catch (Error& e) {
    throw std::move(e).in(file);
  }
  makeHalfDensities();
}

Rgb MerlTable::at(const ShadingDirection& wi, const ShadingDirection& wo) const {
  const ShadingDirection h = normalized(wi + wo), d = difference(wi, h);
  double phi = std::atan2(d.y(), d.x());
  if (phi < 0) phi += kPi; // exchanging wi and wo turns d by 180 degrees
  const Neighbors a = between(placeOfThetaH(angleOf(h)), kThetaH);
  const Neighbors b = between(angleOf(d) / (kPi / 2) * kThetaD, kThetaD);
  const Neighbors c = around(phi / kPi * kPhiD, kPhiD);
  Rgb sum;
  for (int corner = 0; corner < 8; ++corner) {
    const bool i = corner & 1, j = corner & 2, k = corner & 4;
    const float weight = (i ? a.fraction : 1 - a.fraction) * (j ? b.fraction : 1 - b.fraction) *
                         (k ? c.fraction : 1 - c.fraction);
    const size_t bin = ((i ? a.high : a.low) * kThetaD + (j ? b.high : b.low)) * kPhiD + (k ? c.high : c.low);
    sum = sum + weight * values_[bin];
  }
  return sum;
}

void MerlTable::makeHalfDensities() {
  // Grazing light is excluded: it is bright for any h.
  constexpr size_t kSteep = 60;
  double sum = 0;
  for (size_t i = 0; i < kThetaH; ++i) {
    double brightness = 1e-6;
    for (size_t j = 0; j < kSteep * kPhiD; ++j) brightness += brightest(values_[i * kThetaD * kPhiD + j]);
    const double low = std::cos(thetaHAt(static_cast<double>(i))),
                 high = std::cos(thetaHAt(static_cast<double>(i + 1)));
    sum += brightness * (squared(low) - squared(high)); // projected solid angle
    halfCumulated_.push_back(sum);
  }
  for (double& share : halfCumulated_) share /= sum;
}

// Uniform within a bin.
ShadingDirection MerlTable::halfDirection(double u, double v) const {
  const auto bin = static_cast<size_t>(
      std::min(std::upper_bound(halfCumulated_.begin(), halfCumulated_.end() - 1, u) - halfCumulated_.begin(),
               static_cast<std::ptrdiff_t>(kThetaH - 1)));
  const double before = bin > 0 ? halfCumulated_[bin - 1] : 0;
  const double within = std::clamp((u - before) / (halfCumulated_[bin] - before), 0.0, 1.0);
  const double low = std::cos(thetaHAt(static_cast<double>(bin))),
               high = std::cos(thetaHAt(static_cast<double>(bin + 1)));
  const double z = low + within * (high - low), r = std::sqrt(std::max(0.0, 1 - z * z)), phi = 2 * kPi * v;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

double MerlTable::halfDensity(const ShadingDirection& h) const {
  const auto bin = std::min(static_cast<size_t>(placeOfThetaH(angleOf(h))), kThetaH - 1);
  const double share = halfCumulated_[bin] - (bin > 0 ? halfCumulated_[bin - 1] : 0);
  const double low = std::cos(thetaHAt(static_cast<double>(bin))),
               high = std::cos(thetaHAt(static_cast<double>(bin + 1)));
  return share / (2 * kPi * (low - high));
}

Rgb evaluate(const MeasuredBsdf& bsdf, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(bsdf.wo)) return {};
  assert(bsdf.table);
  return scaled(wi.z(), bsdf.table->at(wi, bsdf.wo));
}

double pdf(const MeasuredBsdf& bsdf, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(bsdf.wo)) return 0;
  const ShadingDirection h = normalized(wi + bsdf.wo);
  return 0.5 * bsdf.table->halfDensity(h) / (4 * halfCosine(wi, bsdf.wo)) + 0.5 * cosineDensity(wi);
}

std::optional<ScatterSample> sample(const MeasuredBsdf& bsdf, const Uniforms& u) {
  if (!isAbove(bsdf.wo)) return std::nullopt;
  const ShadingDirection wi =
      u[0] < 0.5 ? mirrored(bsdf.wo, bsdf.table->halfDirection(u[1], u[2])) : cosineDirection(u[1], u[2]);
  const double density = pdf(bsdf, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(bsdf, wi)), density};
}

} // namespace surflect::material
