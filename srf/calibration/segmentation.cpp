// [Anscombe 1948]  The transformation of Poisson, binomial and negative-binomial data.
// [Horprasert et al. 1999]  A statistical approach for real-time robust background subtraction and shadow
//                           detection: a shadow scales the background's colour.
// [Smith and Blinn 1996]  Blue screen matting.
//
//   I  photograph     B  plate, times the gain     g  gain of each channel
//   v  sqrt(x + o), the variance-stabilised value of x; o is read noise
//   t  mean over channels of ((v(I) - v(B)) / sigma)^2: about 1 on the background
#include "srf/calibration/segmentation.h"

#include "srf/image/color.h"
#include "surfel/math/median.h"

#include <Eigen/Cholesky>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace surflect::calibration {

namespace {

constexpr float kReadNoise = 0.004f;     // o, of the 99.5th percentile of luma
constexpr float kLeastSigma = 0.002f;    // of the root of that percentile: half a step of 8 bits
constexpr float kFittedSigma = 0.012f;   // of the same, of a fitted plate
constexpr float kMostSigma = 0.04f;      // of the same: more is another scene
constexpr float kDarkShare = 0.05f;      // of that percentile: darker pixels have no certain colour
constexpr float kStrong = 16, kWeak = 5; // t of an object's pixels, and of those connected with them
constexpr double kDarkestShadow = 0.2, kBrightestShadow = 1.1;
constexpr double kShadowFit = 3;   // mean squared residual of a shadow, in units of sigma^2
constexpr double kSaturated = 0.6; // standard deviation of the channels over their mean, whose hue is certain

bool isInBorder(const image::Image& image, int x, int y) {
  const int reach = std::max(1, std::min(image.width, image.height) / 8);
  return std::min(std::min(x, image.width - 1 - x), std::min(y, image.height - 1 - y)) < reach;
}

template <class Visit> void forBorder(const image::Image& image, const Visit& visit) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (isInBorder(image, x, y)) visit(x, y);
}

Rgb colorAt(const image::Image& image, int x, int y) {
  const auto texel = image.at(x, y);
  return {texel[0], texel[1], texel[2]};
}

float topOf(const image::Image& image) {
  image::PercentileCounter counter;
  for (size_t i = 0; i < image.values.size(); i += 3)
    counter.add(image::luma({image.values[i], image.values[i + 1], image.values[i + 2]}));
  return std::max(static_cast<float>(counter.percentile(0.995)), 1e-12f);
}

// Relation of a photograph to its plate.
struct Comparison {
  std::array<float, 3> gain{1, 1, 1}, sigma{};
  float offset = 0;     // o
  float dark = 0;       // luma of pixels that are background if the plate is as dark
  double explained = 0; // share of the border with t below 9

  float stable(float x) const { return std::sqrt(std::max(x, 0.f) + offset); }
  // Variance of x from that of v(x): dv/dx = 1 / (2 v).
  float variance(size_t c, float x) const {
    const float deviation = 2 * sigma[c] * stable(x);
    return deviation * deviation;
  }
  float deviation(std::span<const float> photograph, std::span<const float> plate) const {
    const auto isDark = [&](std::span<const float> color) {
      return image::luma({color[0], color[1], color[2]}) < dark;
    };
    if (isDark(photograph) && isDark(plate)) return 0;
    float sum = 0;
    for (size_t c = 0; c < 3; ++c) {
      const float d = (stable(photograph[c]) - stable(gain[c] * plate[c])) / sigma[c];
      sum += d * d / 3;
    }
    return sum;
  }
};

// Gain by the most frequent ratio of lumas in the border, within a stop; then per channel the median ratio of
// the pixels near it, within a quarter of a stop.
std::array<float, 3> gainOf(const image::Image& photograph, const image::Image& plate, float top) {
  constexpr int kBins = 129;
  constexpr double kNear = 0.15, kTint = 0.25; // stops
  std::array<double, kBins> counts{};
  const auto stopsAt = [&](int x, int y) -> std::optional<double> {
    const float of = image::luma(colorAt(photograph, x, y)), to = image::luma(colorAt(plate, x, y));
    if (!(of > 0) || !(to > kDarkShare * top)) return std::nullopt;
    const double stops = std::log2(static_cast<double>(of) / static_cast<double>(to));
    return std::abs(stops) <= 1 ? std::optional(stops) : std::nullopt;
  };
  forBorder(photograph, [&](int x, int y) {
    if (const auto stops = stopsAt(x, y)) ++counts[static_cast<size_t>((*stops + 1) / 2 * (kBins - 1) + 0.5)];
  });
  double most = 0, mode = 0;
  for (size_t i = 0; i < kBins; ++i) {
    double sum = 0;
    for (size_t k = i > 2 ? i - 2 : 0; k <= std::min<size_t>(kBins - 1, i + 2); ++k) sum += counts[k];
    if (sum > most) most = sum, mode = 2.0 * static_cast<double>(i) / (kBins - 1) - 1;
  }
  std::array<float, 3> gain{1, 1, 1};
  for (size_t c = 0; c < 3; ++c) {
    std::vector<double> ratios;
    forBorder(photograph, [&](int x, int y) {
      const auto stops = stopsAt(x, y);
      if (stops && std::abs(*stops - mode) < kNear && plate.at(x, y)[c] > kDarkShare * top)
        ratios.push_back(static_cast<double>(photograph.at(x, y)[c] / plate.at(x, y)[c]));
    });
    const double stops = ratios.size() < 16 ? mode : std::log2(std::max(median(std::move(ratios)), 1e-6));
    gain[c] = static_cast<float>(std::exp2(std::clamp(stops, mode - kTint, mode + kTint)));
  }
  return gain;
}

Comparison compare(const image::Image& photograph, const image::Image& plate, PlateKind kind) {
  // Lower tercile of |x| for a normal distribution of deviation 1. Sigma is right if the whole border is
  // background, and too large otherwise; its clamp bounds the error.
  constexpr double kNormalThird = 0.4307;
  Comparison comparison;
  const float top = std::max(topOf(plate), topOf(photograph));
  comparison.offset = kReadNoise * top;
  if (kind == PlateKind::fitted) comparison.dark = kDarkShare * top;
  const float least = (kind == PlateKind::fitted ? kFittedSigma : kLeastSigma) * std::sqrt(top);
  comparison.gain = gainOf(photograph, plate, top);
  for (size_t c = 0; c < 3; ++c) {
    std::vector<double> differences;
    forBorder(photograph, [&](int x, int y) {
      const float d = comparison.stable(photograph.at(x, y)[c]) -
                      comparison.stable(comparison.gain[c] * plate.at(x, y)[c]);
      differences.push_back(std::abs(static_cast<double>(d)));
    });
    const auto third = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 3);
    std::ranges::nth_element(differences, third);
    comparison.sigma[c] =
        std::clamp(static_cast<float>(*third / kNormalThird), least, kMostSigma * std::sqrt(top));
  }
  size_t border = 0, near = 0;
  forBorder(photograph, [&](int x, int y) {
    ++border;
    near += comparison.deviation(photograph.at(x, y), plate.at(x, y)) < 9;
  });
  comparison.explained = static_cast<double>(near) / static_cast<double>(border);
  return comparison;
}

// Means over 3 x 3 pixels.
std::vector<float> blurred(const std::vector<float>& values, int width, int height) {
  std::vector<float> means(values.size());
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0, count = 0;
      for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i)
          sum += values[static_cast<size_t>(j) * static_cast<size_t>(width) + static_cast<size_t>(i)],
              ++count;
      means[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)] = sum / count;
    }
  });
  return means;
}

// Pixels of weak groups that hold a strong pixel.
image::Mask connected(const std::vector<float>& t, int width, int height) {
  image::Mask weak(width, height);
  for (size_t i = 0; i < t.size(); ++i) weak.inside[i] = t[i] > kWeak;
  for (const image::Group& group : image::groupsOf(weak, 1, true))
    if (std::ranges::none_of(group.pixels, [&](size_t i) { return t[i] > kStrong; }))
      for (const size_t i : group.pixels) weak.inside[i] = 0;
  return weak;
}

// ---------------------------------------------------------------------------------------------------------
// Shadows.

// Weighted least-squares fit of samples by (a + b x + c y) times a factor of each sample.
class SlopeFit {
public:
  void add(double x, double y, double factor, double value, double weight) {
    const Vec3<double> row = factor * Vec3<double>(1, x, y);
    normal_ += weight * row * row.transpose();
    right_ += weight * value * row;
    squares_ += weight * value * value;
  }
  Vec3<double> solution() const { return normal_.ldlt().solve(right_); }
  // Sum of weighted squared residuals of the solution.
  double least(const Vec3<double>& solution) const { return std::max(0.0, squares_ - solution.dot(right_)); }
  double least() const { return least(solution()); }

private:
  Mat3<double> normal_ = Mat3<double>::Identity() * 1e-12;
  Vec3<double> right_ = Vec3<double>::Zero();
  double squares_ = 0;
};

// Removes the pixels of `mask` that are shadows on the plate: in some window of 5 x 5 samples around them,
// one, two or four pixels apart, I = s B, where the factor s varies linearly over the window [Horprasert et
// al. 1999]. Where the plate has texture, an even colour must fit worse; where it has none but is saturated,
// an even grey must. A shadow begins beside the background, and is no speck.
void dropShadows(image::Mask& mask, const image::Image& photograph, const image::Image& plate,
                 const Comparison& comparison, const Progress& progress) {
  constexpr int kReach = 2;             // samples
  constexpr double kLeastShadow = 0.01; // of the mask's pixels
  const int width = mask.width, height = mask.height;
  const auto indexOf = [&](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  };
  const auto windowAt = [&](int x, int y, int step, const auto& visit) {
    for (int j = std::max(-kReach, -y / step); j <= std::min(kReach, (height - 1 - y) / step); ++j)
      for (int i = std::max(-kReach, -x / step); i <= std::min(kReach, (width - 1 - x) / step); ++i)
        visit(x + i * step, y + j * step);
  };
  const auto below = [&](int x, int y, size_t c) {
    return static_cast<double>(comparison.gain[c] * plate.at(x, y)[c]);
  };
  const auto weightAt = [&](int x, int y, size_t c) {
    return 1 / static_cast<double>(comparison.variance(c, photograph.at(x, y)[c]));
  };
  // Mean squared residual of a pixel, in units of sigma^2.
  const auto restAt = [&](int x, int y, double factor) {
    double squares = 0;
    for (size_t c = 0; c < 3; ++c) {
      const double rest = static_cast<double>(photograph.at(x, y)[c]) - factor * below(x, y, c);
      squares += rest * rest * weightAt(x, y, c) / 3;
    }
    return squares;
  };
  const auto isPossible = [&](int x, int y) { // by its hue alone
    double along = 0, length = 0;
    for (size_t c = 0; c < 3; ++c) {
      along += weightAt(x, y, c) * static_cast<double>(photograph.at(x, y)[c]) * below(x, y, c);
      length += weightAt(x, y, c) * below(x, y, c) * below(x, y, c);
    }
    const double factor = along / std::max(length, 1e-30);
    return factor > kDarkestShadow / 2 && factor < 1.5 && restAt(x, y, factor) < 3 * kShadowFit;
  };
  const auto fitAt = [&](int x, int y, int step) -> std::optional<Vec3<double>> {
    SlopeFit shade;
    double samples = 0;
    windowAt(x, y, step, [&](int i, int j) {
      for (size_t c = 0; c < 3; ++c, ++samples)
        shade.add(i - x, j - y, below(i, j, c), static_cast<double>(photograph.at(i, j)[c]),
                  weightAt(i, j, c));
    });
    const Vec3<double> factor = shade.solution();
    const double asShadow = shade.least(factor);
    if (!(factor[0] >= kDarkestShadow && factor[0] <= kBrightestShadow && asShadow < kShadowFit * samples))
      return std::nullopt;
    SlopeFit gray;
    std::array<SlopeFit, 3> even, plain; // of the photograph's and the plate's channels
    double sum = 0, squares = 0;
    windowAt(x, y, step, [&](int i, int j) {
      for (size_t c = 0; c < 3; ++c) {
        const auto value = static_cast<double>(photograph.at(i, j)[c]);
        const double back = below(i, j, c), weight = weightAt(i, j, c);
        gray.add(i - x, j - y, 1, value, weight);
        even[c].add(i - x, j - y, 1, value, weight);
        plain[c].add(i - x, j - y, 1, back, weight);
        sum += back, squares += back * back;
      }
    });
    double asEven = 0, texture = 0;
    for (size_t c = 0; c < 3; ++c) asEven += even[c].least(), texture += plain[c].least();
    if (factor[0] * factor[0] * texture > samples) // else the shadow would not show the texture
      return asEven > asShadow + samples / 2 ? std::optional(factor) : std::nullopt;
    const double saturation = std::sqrt(std::max(0.0, squares * samples - sum * sum)) / std::max(sum, 1e-30);
    return saturation > kSaturated && gray.least() > asShadow + samples / 2 ? std::optional(factor)
                                                                            : std::nullopt;
  };
  const Vec3<float> none = Vec3<float>::Zero(); // no shadow
  image::Mask possible(width, height), shadow(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x)
      possible.inside[indexOf(x, y)] = mask.inside[indexOf(x, y)] && isPossible(x, y);
  });
  for (const int step : {1, 2, 4}) {
    std::vector<Vec3<float>> fits(mask.inside.size(), none);
    tbb::parallel_for(0, height, [&](int y) {
      progress.checkpoint();
      for (int x = 0; x < width; ++x)
        if (possible.inside[indexOf(x, y)])
          if (const auto fit = fitAt(x, y, step)) fits[indexOf(x, y)] = fit->cast<float>();
    });
    tbb::parallel_for(0, height, [&](int y) {
      progress.checkpoint();
      for (int x = 0; x < width; ++x) {
        if (!mask.inside[indexOf(x, y)] || shadow.inside[indexOf(x, y)]) continue;
        windowAt(x, y, step, [&](int i, int j) {
          const Vec3<float>& fit = fits[indexOf(i, j)];
          const auto factor = static_cast<double>(
              fit.dot(Vec3<float>(1, static_cast<float>(x - i), static_cast<float>(y - j))));
          shadow.inside[indexOf(x, y)] |= fit[0] > 0 && restAt(x, y, factor) < 3 * kShadowFit;
        });
      }
    });
  }
  const auto isBeside = [&](size_t i) { // the background
    const int x = static_cast<int>(i % static_cast<size_t>(width)),
              y = static_cast<int>(i / static_cast<size_t>(width));
    bool found = false;
    for (int row = std::max(0, y - 1); row <= std::min(height - 1, y + 1); ++row)
      for (int column = std::max(0, x - 1); column <= std::min(width - 1, x + 1); ++column)
        found |= !mask.inside[indexOf(column, row)];
    return found;
  };
  const auto pixels = std::ranges::count(mask.inside, uint8_t{1});
  std::vector<image::Group> groups = image::groupsOf(shadow, 1, true);
  std::erase_if(groups, [&](const image::Group& group) {
    return static_cast<double>(group.pixels.size()) < kLeastShadow * static_cast<double>(pixels) ||
           std::ranges::none_of(group.pixels, isBeside);
  });
  for (const image::Group& group : groups)
    for (const size_t i : group.pixels) mask.inside[i] = 0;
}

} // namespace

// ---------------------------------------------------------------------------------------------------------

PlateVote::PlateVote(int width, int height)
    : shape_(width, height), object_(shape_.inside.size()), votes_(shape_.inside.size()) {}

double PlateVote::add(const image::Image& photograph, const image::Image& plate, PlateKind kind,
                      const Progress& progress) {
  constexpr float kVisible = 4; // sigma
  assert(photograph.width == shape_.width && photograph.height == shape_.height);
  assert(plate.width == shape_.width && plate.height == shape_.height);
  progress.checkpoint();
  const Comparison comparison = compare(photograph, plate, kind);
  if (comparison.explained < kExplained) return comparison.explained;
  std::vector<float> t(shape_.inside.size());
  for (size_t i = 0; i < t.size(); ++i)
    t[i] = std::min(100.f, comparison.deviation(std::span(photograph.values).subspan(3 * i, 3),
                                                std::span(plate.values).subspan(3 * i, 3)));
  t = blurred(t, shape_.width, shape_.height);
  image::Mask object = connected(t, shape_.width, shape_.height);
  dropShadows(object, photograph, plate, comparison, progress);
  for (size_t i = 0; i < t.size(); ++i) {
    bool isVisible = object.inside[i];
    for (size_t c = 0; c < 3; ++c)
      isVisible |= comparison.stable(comparison.gain[c] * plate.values[3 * i + c]) - comparison.stable(0) >
                   kVisible * comparison.sigma[c];
    votes_[i] += isVisible;
    object_[i] += object.inside[i];
  }
  return comparison.explained;
}

image::Mask PlateVote::outcome() const {
  constexpr double kSmallGroup = 0.1, kSmallHole = 0.001; // of the largest group's pixels
  image::Mask mask = shape_;
  for (size_t i = 0; i < mask.inside.size(); ++i) mask.inside[i] = 2 * object_[i] > votes_[i];
  const std::vector<image::Group> groups = image::groupsOf(mask, 1, true);
  size_t largest = 0;
  for (const image::Group& group : groups) largest = std::max(largest, group.pixels.size());
  const auto isBelow = [&](const image::Group& group, double share) {
    return static_cast<double>(group.pixels.size()) < share * static_cast<double>(largest);
  };
  for (const image::Group& group : groups)
    if (isBelow(group, kSmallGroup))
      for (const size_t i : group.pixels) mask.inside[i] = 0;
  for (const image::Group& hole : image::groupsOf(mask, 0, false))
    if (!hole.touchesBorder && isBelow(hole, kSmallHole))
      for (const size_t i : hole.pixels) mask.inside[i] = 1;
  return mask;
}

EdgeCoverage::EdgeCoverage(image::Mask object)
    : object_(std::move(object)), core_(image::eroded(object_, 2)), middle_(image::eroded(object_, 1)) {
  for (size_t i = 0; i < object_.inside.size(); ++i)
    if (object_.inside[i] && !core_.inside[i]) ring_.push_back({.pixel = i});
}

void EdgeCoverage::add(const image::Image& photograph, const image::Image& plate, PlateKind kind,
                       const Progress& progress) {
  constexpr int kReach = 4; // pixels
  const Comparison comparison = compare(photograph, plate, kind);
  const int width = object_.width, height = object_.height;
  const auto meanOf = [&](const image::Mask& mask, int x, int y) -> std::optional<Vec3<double>> {
    Vec3<double> sum = Vec3<double>::Zero();
    double count = 0;
    for (int j = std::max(0, y - kReach); j <= std::min(height - 1, y + kReach); ++j)
      for (int i = std::max(0, x - kReach); i <= std::min(width - 1, x + kReach); ++i) {
        if (!mask.inside[static_cast<size_t>(j) * static_cast<size_t>(width) + static_cast<size_t>(i)])
          continue;
        for (int c = 0; c < 3; ++c)
          sum[c] += static_cast<double>(photograph.at(i, j)[static_cast<size_t>(c)]);
        ++count;
      }
    return count > 0 ? std::optional<Vec3<double>>(sum / count) : std::nullopt;
  };
  tbb::parallel_for(size_t{0}, ring_.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    RingPixel& at = ring_[i];
    const int x = static_cast<int>(at.pixel % static_cast<size_t>(width)),
              y = static_cast<int>(at.pixel / static_cast<size_t>(width));
    auto front = meanOf(core_, x, y);
    if (!front) front = meanOf(middle_, x, y);
    if (!front) return;
    for (size_t c = 0; c < 3; ++c) {
      const double back = static_cast<double>(comparison.gain[c] * plate.at(x, y)[c]),
                   reach = (*front)[static_cast<Eigen::Index>(c)] - back,
                   weight = 1 / static_cast<double>(comparison.variance(c, photograph.at(x, y)[c]));
      at.along += weight * (static_cast<double>(photograph.at(x, y)[c]) - back) * reach;
      at.length += weight * reach * reach;
    }
  });
}

image::Image EdgeCoverage::outcome() const {
  constexpr double kCertain = 25; // |F - B|^2 in units of sigma^2
  constexpr double kRest = 0.05;  // alpha that noise and texture give
  image::Image raw(object_.width, object_.height, 1);
  std::ranges::copy(object_.inside, raw.values.begin());
  for (const RingPixel& at : ring_)
    if (at.length > kCertain)
      raw.values[at.pixel] =
          static_cast<float>(std::clamp((at.along / at.length - kRest) / (1 - 2 * kRest), 0.0, 1.0));
  image::Image coverage = raw;
  for (const RingPixel& at : ring_) {
    const int x = static_cast<int>(at.pixel % static_cast<size_t>(raw.width)),
              y = static_cast<int>(at.pixel / static_cast<size_t>(raw.width));
    if (x == 0 || y == 0 || x + 1 == raw.width || y + 1 == raw.height) continue;
    std::array<float, 9> near;
    for (size_t k = 0; k < near.size(); ++k)
      near[k] = raw.at(x - 1 + static_cast<int>(k % 3), y - 1 + static_cast<int>(k / 3))[0];
    std::ranges::nth_element(near, near.begin() + 4);
    coverage.values[at.pixel] = near[4];
  }
  return coverage;
}

// ---------------------------------------------------------------------------------------------------------
// Backgrounds of one colour.

void BorderColor::add(const image::Image& photograph) {
  const float top = topOf(photograph);
  forBorder(photograph, [&](int x, int y) {
    const Rgb color = colorAt(photograph, x, y);
    const Rgb positive{std::max(0.f, color.r), std::max(0.f, color.g), std::max(0.f, color.b)};
    const float sum = positive.r + positive.g + positive.b;
    size_t cell = cells_.size() - 1;
    if (image::luma(positive) > kDarkShare * top) {
      const auto at = [&](float share) {
        return std::min(kCells - 1, static_cast<size_t>(share / sum * static_cast<float>(kCells)));
      };
      cell = at(positive.r) * kCells + at(positive.g);
    }
    ++cells_[cell].pixels;
    cells_[cell].r += static_cast<double>(positive.r);
    cells_[cell].g += static_cast<double>(positive.g);
    cells_[cell].b += static_cast<double>(positive.b);
  });
}

BorderColor::Cell BorderColor::fullest() const {
  Cell most = cells_.back();
  for (size_t r = 1; r + 1 < kCells; ++r)
    for (size_t g = 1; g + 1 < kCells; ++g) {
      Cell sum;
      for (size_t i = r - 1; i <= r + 1; ++i)
        for (size_t k = g - 1; k <= g + 1; ++k) {
          const Cell& cell = cells_[i * kCells + k];
          sum.pixels += cell.pixels, sum.r += cell.r, sum.g += cell.g, sum.b += cell.b;
        }
      if (sum.pixels > most.pixels) most = sum;
    }
  return most;
}

Rgb BorderColor::color() const {
  const Cell cell = fullest();
  if (!(cell.pixels > 0)) return {};
  return {static_cast<float>(cell.r / cell.pixels), static_cast<float>(cell.g / cell.pixels),
          static_cast<float>(cell.b / cell.pixels)};
}

double BorderColor::share() const {
  double all = 0;
  for (const Cell& cell : cells_) all += cell.pixels;
  return all > 0 ? fullest().pixels / all : 0;
}

std::optional<image::Image> fittedPlate(const image::Image& photograph, Rgb key) {
  constexpr float kHue = 0.25f; // |I - e K| / |e K|, e the factor nearest to I
  constexpr double kLeastShare = 0.2, kInlier = 3;
  constexpr int kRounds = 8;
  constexpr size_t kMostSamples = 1 << 16;
  using Row = Eigen::Matrix<double, 6, 1>;
  const float top = topOf(photograph);
  const Vec3<float> k(key.r, key.g, key.b);
  const bool isDark = image::luma(key) < 0.02f;
  const auto hasKey = [&](int x, int y) {
    const Rgb color = colorAt(photograph, x, y);
    if (isDark) return image::luma(color) < kDarkShare * top;
    const Vec3<float> value(color.r, color.g, color.b);
    const float factor = value.dot(k) / k.squaredNorm();
    return image::luma(color) > kDarkShare * top && (value - factor * k).norm() < kHue * factor * k.norm();
  };
  const auto rowAt = [&](int x, int y) {
    const double u = 2 * (x + 0.5) / photograph.width - 1, v = 2 * (y + 0.5) / photograph.height - 1;
    return Row(1, u, v, u * u, u * v, v * v);
  };
  struct Sample {
    Row row;
    Vec3<double> value; // stabilised
    bool isBorder;
  };
  const float offset = kReadNoise * top;
  const auto stable = [&](float x) { return std::sqrt(static_cast<double>(std::max(x, 0.f) + offset)); };
  int step = 1;
  while (static_cast<size_t>(photograph.width / step) * static_cast<size_t>(photograph.height / step) >
         kMostSamples)
    ++step;
  std::vector<Sample> samples;
  size_t border = 0, ofKey = 0;
  for (int y = 0; y < photograph.height; y += step)
    for (int x = 0; x < photograph.width; x += step) {
      const bool isBorder = isInBorder(photograph, x, y);
      border += isBorder;
      if (!hasKey(x, y)) continue;
      ofKey += isBorder;
      const Rgb color = colorAt(photograph, x, y);
      samples.push_back({rowAt(x, y), {stable(color.r), stable(color.g), stable(color.b)}, isBorder});
    }
  if (static_cast<double>(ofKey) < kLeastShare * static_cast<double>(border) || ofKey < 16)
    return std::nullopt;

  std::vector<char> isIn(samples.size());
  for (size_t i = 0; i < samples.size(); ++i) isIn[i] = samples[i].isBorder;
  Eigen::Matrix<double, 6, 3> fit = Eigen::Matrix<double, 6, 3>::Zero();
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity() * 1e-9;
    Eigen::Matrix<double, 6, 3> right = Eigen::Matrix<double, 6, 3>::Zero();
    for (size_t i = 0; i < samples.size(); ++i)
      if (isIn[i]) {
        normal += samples[i].row * samples[i].row.transpose();
        right += samples[i].row * samples[i].value.transpose();
      }
    fit = normal.ldlt().solve(right);
    std::vector<double> rests;
    for (size_t i = 0; i < samples.size(); ++i)
      if (isIn[i]) rests.push_back((samples[i].value - fit.transpose() * samples[i].row).norm());
    const double reach =
        kInlier * std::max(median(std::move(rests)), static_cast<double>(kLeastSigma * std::sqrt(top)));
    for (size_t i = 0; i < samples.size(); ++i)
      isIn[i] = (samples[i].value - fit.transpose() * samples[i].row).norm() < reach;
  }
  image::Image plate(photograph.width, photograph.height, 3);
  tbb::parallel_for(0, plate.height, [&](int y) {
    for (int x = 0; x < plate.width; ++x) {
      const Vec3<double> value = fit.transpose() * rowAt(x, y);
      for (int c = 0; c < 3; ++c)
        plate.at(x, y)[static_cast<size_t>(c)] =
            std::max(0.f, static_cast<float>(value[c] * std::abs(value[c])) - offset);
    }
  });
  return plate;
}

double spillOf(const image::Image& photograph, const image::Mask& object, Rgb key) {
  const auto chromaOf = [](Rgb color) {
    const auto root = [](float value) { return std::sqrt(static_cast<double>(std::max(value, 0.f))); };
    const Vec3<double> roots(root(color.r), root(color.g), root(color.b));
    return Vec3<double>(roots - Vec3<double>::Constant(roots.mean()));
  };
  const Vec3<double> axis = chromaOf(key);
  if (!(axis.squaredNorm() > 1e-3)) return 0;
  const auto shareBetween = [&](int outer, int inner) -> std::optional<double> {
    const image::Mask wide = image::eroded(object, outer), narrow = image::eroded(object, inner);
    double sum = 0, pixels = 0;
    for (size_t i = 0; i < wide.inside.size(); ++i) {
      if (!wide.inside[i] || narrow.inside[i]) continue;
      const float* color = &photograph.values[3 * i];
      sum += chromaOf({color[0], color[1], color[2]}).dot(axis) / axis.squaredNorm();
      ++pixels;
    }
    return pixels > 0 ? std::optional(sum / pixels) : std::nullopt;
  };
  const auto rim = shareBetween(1, 3), within = shareBetween(5, 9);
  return rim && within ? *rim - *within : 0;
}

} // namespace surflect::calibration
