// [Andersson 2020] as in flip.h; [Abasi 2020] Abasi, Amani Tehran, Fairchild: Distance Metrics for Very Large
// Color Differences (HyAB); [Hunt 1952] Hunt: Light and Dark Adaptation and the Perception of Color.
//
//   Y Cx Cz  opponent colours, linear in XYZ         L a b  CIELAB, adjusted for Hunt's effect
//   p        pixels per degree                       q_c q_f p_c p_t  constants of the paper
//   dE_c     colour difference, 0..1                 dE_f   feature difference, 0..1
#include "render/evaluation/flip.h"

#include "srf/image/color.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace surflect::evaluation {

namespace {

using Kernel = std::vector<double>; // odd length; the middle is at the pixel
using Color = std::array<double, 3>;

// Values of one channel, row 0 on top.
struct Plane {
  int width, height;
  std::vector<double> values;

  Plane(int w, int h) : width(w), height(h), values(static_cast<size_t>(w) * static_cast<size_t>(h)) {}
  double* row(int y) { return values.data() + static_cast<size_t>(y) * static_cast<size_t>(width); }
  const double* row(int y) const {
    return values.data() + static_cast<size_t>(y) * static_cast<size_t>(width);
  }
};

// Filters along rows; pixels outside repeat the border.
Plane alongRows(const Plane& plane, const Kernel& kernel) {
  Plane result(plane.width, plane.height);
  const int radius = static_cast<int>(kernel.size() / 2);
  tbb::parallel_for(0, plane.height, [&](int y) {
    std::vector<double> padded(static_cast<size_t>(plane.width + 2 * radius));
    for (int x = 0; x < plane.width + 2 * radius; ++x)
      padded[static_cast<size_t>(x)] = plane.row(y)[std::clamp(x - radius, 0, plane.width - 1)];
    double* out = result.row(y);
    for (size_t i = 0; i < kernel.size(); ++i)
      for (int x = 0; x < plane.width; ++x) out[x] += kernel[i] * padded[static_cast<size_t>(x) + i];
  });
  return result;
}

// Filters along columns; pixels outside repeat the border.
Plane alongColumns(const Plane& plane, const Kernel& kernel) {
  Plane result(plane.width, plane.height);
  const int radius = static_cast<int>(kernel.size() / 2);
  tbb::parallel_for(0, plane.height, [&](int y) {
    double* out = result.row(y);
    for (int i = -radius; i <= radius; ++i) {
      const double weight = kernel[static_cast<size_t>(i + radius)];
      const double* in = plane.row(std::clamp(y + i, 0, plane.height - 1));
      for (int x = 0; x < plane.width; ++x) out[x] += weight * in[x];
    }
  });
  return result;
}

// Gaussian at whole pixels, without a factor.
Kernel gaussian(double sigma, int radius) {
  Kernel kernel;
  for (int x = -radius; x <= radius; ++x) kernel.push_back(std::exp(-0.5 * x * x / (sigma * sigma)));
  return kernel;
}

double sumOf(const Kernel& kernel) {
  double sum = 0;
  for (const double weight : kernel) sum += weight;
  return sum;
}

// Scales positive weights to the sum 1 and negative ones to -1.  [Andersson 2020, §4.2]
Kernel balanced(Kernel kernel) {
  double positive = 0, negative = 0;
  for (const double weight : kernel) (weight > 0 ? positive : negative) += weight;
  for (double& weight : kernel) weight /= weight > 0 ? positive : negative < 0 ? -negative : 1;
  return kernel;
}

// Contrast sensitivity of a channel as a sum of Gaussians in degrees, a sqrt(pi / b) exp(-(pi x)^2 / b).
// [Andersson 2020, Eq. 3, Table 1]
struct Sensitivity {
  double a, b;

  double sigma(double p) const { return p * std::sqrt(b / 2) / std::numbers::pi; } // pixels
};
constexpr Sensitivity kAchromatic{1, 0.0047}, kRedGreen{1, 0.0053};
constexpr std::array<Sensitivity, 2> kBlueYellow{{{34.1, 0.04}, {13.5, 0.025}}};

// Filters a channel with a sum of Gaussians that are cut off at a common radius and sum to one.
template <size_t n> Plane sensed(const Plane& plane, const std::array<Sensitivity, n>& terms, double p) {
  const int radius = static_cast<int>(std::ceil(3 * kBlueYellow[0].sigma(p)));
  Plane result(plane.width, plane.height);
  double total = 0;
  for (const Sensitivity& term : terms) {
    const Kernel kernel = gaussian(term.sigma(p), radius);
    const double factor = term.a * std::sqrt(std::numbers::pi / term.b);
    total += factor * sumOf(kernel) * sumOf(kernel);
    const Plane filtered = alongColumns(alongRows(plane, kernel), kernel);
    for (size_t i = 0; i < result.values.size(); ++i) result.values[i] += factor * filtered.values[i];
  }
  for (double& value : result.values) value /= total;
  return result;
}

struct ColorSpaces {
  Mat3<double> xyzFromRgb = image::xyzFromRgb(image::kRec709);
  Mat3<double> rgbFromXyz = xyzFromRgb.inverse();
  Vec3<double> white = xyzFromRgb * Vec3<double>::Ones();

  // XYZ over that of white; linear YCxCz is CIELAB without the cube root.
  Vec3<double> relative(const Vec3<double>& rgb) const { return (xyzFromRgb * rgb).cwiseQuotient(white); }
  static Color opponent(const Vec3<double>& t) {
    return {116 * t.y() - 16, 500 * (t.x() - t.y()), 200 * (t.y() - t.z())};
  }
  // Inverse of opponent(relative()), clipped to displayable colours.
  Vec3<double> displayable(const Color& c) const {
    const double y = (c[0] + 16) / 116;
    const Vec3<double> t(y + c[1] / 500, y, y - c[2] / 200);
    return (rgbFromXyz * t.cwiseProduct(white)).cwiseMax(0).cwiseMin(1);
  }
  // CIELAB with a and b scaled by lightness: colours look less colourful in the dark.  [Hunt 1952]
  Color lab(const Vec3<double>& rgb) const {
    const Vec3<double> t = relative(rgb);
    constexpr double d = 6.0 / 29;
    const auto f = [](double v) { return v > d * d * d ? std::cbrt(v) : v / (3 * d * d) + 4.0 / 29; };
    const Color c = opponent({f(t.x()), f(t.y()), f(t.z())});
    return {c[0], 0.01 * c[0] * c[1], 0.01 * c[0] * c[2]};
  }
};

// Distance of two colours, for differences large and small.  [Abasi 2020]
double hyab(const Color& a, const Color& b) {
  const double x = a[1] - b[1], y = a[2] - b[2];
  return std::abs(a[0] - b[0]) + std::sqrt(x * x + y * y);
}

// dE_c: the distance raised to q_c; up to the share p_c of the largest one it maps to 0..p_t, and beyond that
// to the rest.  [Andersson 2020, §4.1.3]
double redistributed(double distance, double largest) {
  constexpr double q_c = 0.7, p_c = 0.4, p_t = 0.95;
  const double d = std::pow(distance, q_c), c_max = std::pow(largest, q_c);
  return d < p_c * c_max ? p_t / (p_c * c_max) * d
                         : p_t + (d - p_c * c_max) / (c_max - p_c * c_max) * (1 - p_t);
}

// Colours of a picture as they are perceived, and how much of an edge or a point each pixel is.
struct Perceived {
  std::vector<Color> lab;
  std::vector<double> edges, points;
};

Perceived perceived(const image::Image& image, double p, const ColorSpaces& spaces) {
  const int width = image.width, height = image.height;
  std::array<Plane, 3> opponent{Plane(width, height), Plane(width, height), Plane(width, height)};
  Plane luminance(width, height);
  const size_t pixels = luminance.values.size(), channels = static_cast<size_t>(image.channels);
  for (size_t i = 0; i < pixels; ++i) {
    const float* rgb = image.values.data() + i * channels;
    const Vec3<double> t = spaces.relative({rgb[0], rgb[1], rgb[2]});
    const Color c = ColorSpaces::opponent(t);
    for (size_t k = 0; k < 3; ++k) opponent[k].values[i] = c[k];
    luminance.values[i] = t.y();
  }

  const Plane Y = sensed(opponent[0], std::array{kAchromatic}, p);
  const Plane Cx = sensed(opponent[1], std::array{kRedGreen}, p);
  const Plane Cz = sensed(opponent[2], kBlueYellow, p);
  Perceived result{std::vector<Color>(pixels), std::vector<double>(pixels), std::vector<double>(pixels)};
  tbb::parallel_for(size_t{0}, pixels, [&](size_t i) {
    result.lab[i] = spaces.lab(spaces.displayable({Y.values[i], Cx.values[i], Cz.values[i]}));
  });

  // First and second derivative of a Gaussian as wide as the features that are seen.  [Andersson 2020, §4.2]
  constexpr double w = 0.082; // degrees
  const double sigma = 0.5 * w * p;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  Kernel smooth = gaussian(sigma, radius), first = smooth, second = smooth;
  const double total = sumOf(smooth);
  for (int x = -radius; x <= radius; ++x) {
    const auto i = static_cast<size_t>(x + radius);
    smooth[i] /= total;
    first[i] *= -x;
    second[i] *= x * x / (sigma * sigma) - 1;
  }
  first = balanced(first), second = balanced(second);
  const Plane rows = alongRows(luminance, smooth);
  const auto strength = [&](const Kernel& kernel) {
    const Plane horizontal = alongColumns(alongRows(luminance, kernel), smooth);
    const Plane vertical = alongColumns(rows, kernel);
    std::vector<double> lengths(pixels);
    for (size_t i = 0; i < pixels; ++i)
      lengths[i] =
          std::sqrt(horizontal.values[i] * horizontal.values[i] + vertical.values[i] * vertical.values[i]);
    return lengths;
  };
  result.edges = strength(first);
  result.points = strength(second);
  return result;
}

} // namespace

image::Image flip(const image::Image& a, const image::Image& b, double pixelsPerDegree) {
  assert(a.width == b.width && a.height == b.height && a.channels >= 3 && b.channels >= 3);
  const ColorSpaces spaces;
  const Perceived seenA = perceived(a, pixelsPerDegree, spaces),
                  seenB = perceived(b, pixelsPerDegree, spaces);
  const double largest = hyab(spaces.lab({0, 1, 0}), spaces.lab({0, 0, 1}));
  image::Image result(a.width, a.height, 1);
  tbb::parallel_for(size_t{0}, result.values.size(), [&](size_t i) {
    constexpr double q_f = 0.5;
    const double dE_c = redistributed(hyab(seenA.lab[i], seenB.lab[i]), largest);
    const double feature =
        std::max(std::abs(seenA.edges[i] - seenB.edges[i]), std::abs(seenA.points[i] - seenB.points[i]));
    const double dE_f = std::min(1.0, std::pow(feature / std::numbers::sqrt2, q_f));       // Eq. 8
    result.values[i] = static_cast<float>(std::clamp(std::pow(dE_c, 1 - dE_f), 0.0, 1.0)); // Eq. 9
  });
  return result;
}

PooledMean meanOver(const image::Image& values, const image::Mask& mask) {
  assert(values.channels == 1 && values.values.size() == mask.inside.size());
  PooledMean mean;
  for (size_t i = 0; i < mask.inside.size(); ++i)
    if (mask.inside[i]) mean += {values.values[i], 1};
  return mean;
}

// Nine evenly spaced colours of the map "magma" (van der Walt and Smith 2015, CC0), linear between them.
Rgb errorColor(double error) {
  static constexpr std::array<std::array<int, 3>, 9> kMagma = {{{0, 0, 4},
                                                                {29, 17, 71},
                                                                {81, 18, 124},
                                                                {130, 38, 129},
                                                                {182, 54, 121},
                                                                {230, 81, 100},
                                                                {251, 136, 97},
                                                                {254, 194, 135},
                                                                {252, 253, 191}}};
  const double place = (kMagma.size() - 1) * std::clamp(error, 0.0, 1.0);
  const size_t i = std::min(static_cast<size_t>(place), kMagma.size() - 2);
  const auto channel = [&](size_t c) {
    return static_cast<float>(std::lerp(kMagma[i][c], kMagma[i + 1][c], place - static_cast<double>(i)) /
                              255);
  };
  return {channel(0), channel(1), channel(2)};
}

} // namespace surflect::evaluation
