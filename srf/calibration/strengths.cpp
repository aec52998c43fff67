// Lambert's law in the inverse strength t_l = 1 / s_l is linear in both unknowns,
//
//   t_l I_l(p) = b(p) . l_l,
//
// so after eliminating b (variable projection) t is the smallest eigenvector of an n x n matrix, for any
// selection of samples. Rejecting samples and solving alternate.
//
// Near lamps and narrow beams have s_l(p) = s_l exp(g_l . p). The current g_l is divided out of I_l; the
// remaining t_l(p) = t_l + u_l . p is linear too, in a matrix of 3 n rows, and g_l changes by -u_l / t_l. A
// factor exp(a . p) common to all lights is absorbed by b, so the mean of the gradients is held at zero.
//
//   I_l(p)  radiance of pixel p under light l     b(p)  albedo times unit normal
//   l_l     unit direction towards light l        w_l   weight of a sample
//   s_l     strength in the middle                g_l   gradient of its logarithm
//   n       number of lights                      p     position in the picture, from its middle
#include "srf/calibration/strengths.h"

#include "srf/image/color.h"
#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

namespace surflect::calibration {

namespace {

// Shares of the largest group's pixels.
constexpr double kSmall = 0.1;
constexpr double kSmallGap = 0.01;
// Share of the threshold. Shadows get some light from their surroundings: on the Middlebury temple and
// dinosaur, at threshold 0.05, gaps have medians of 0.00 to 0.14 and shadows of 0.22 to 0.85.
constexpr double kDark = 0.18;

float medianOf(const image::Group& group, const std::vector<float>& luminance) {
  std::vector<float> values;
  for (const size_t i : group.pixels) values.push_back(luminance[i]);
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

std::vector<float> largestLuminance(std::span<const image::Image> photographs) {
  std::vector<float> largest(static_cast<size_t>(photographs[0].width) *
                             static_cast<size_t>(photographs[0].height));
  for (const image::Image& image : photographs) {
    if (image.width != photographs[0].width || image.height != photographs[0].height)
      throw Error("photographs of one view have different sizes");
    const size_t channels = static_cast<size_t>(image.channels);
    for (size_t i = 0; i < largest.size(); ++i) {
      const float* texel = image.values.data() + i * channels;
      largest[i] =
          std::max(largest[i], channels >= 3 ? image::luma({texel[0], texel[1], texel[2]}) : texel[0]);
    }
  }
  return largest;
}

} // namespace

image::Mask objectByThreshold(std::span<const image::Image> photographs, double threshold) {
  assert(!photographs.empty());
  const std::vector<float> luminance = largestLuminance(photographs);
  image::PercentileCounter counter;
  for (const float value : luminance) counter.add(value);
  const double level = threshold * counter.percentile(0.995);
  image::Mask mask(photographs[0].width, photographs[0].height);
  for (size_t i = 0; i < luminance.size(); ++i) mask.inside[i] = static_cast<double>(luminance[i]) > level;

  const std::vector<image::Group> parts = image::groupsOf(mask, 1, true);
  size_t largest = 0;
  for (const image::Group& part : parts) largest = std::max(largest, part.pixels.size());
  const auto isBelow = [&](const image::Group& group, double share) {
    return static_cast<double>(group.pixels.size()) < share * static_cast<double>(largest);
  };
  const auto isGap = [&](const image::Group& hole) {
    return !isBelow(hole, kSmallGap) && static_cast<double>(medianOf(hole, luminance)) < kDark * level;
  };
  for (const image::Group& part : parts)
    if (isBelow(part, kSmall))
      for (const size_t i : part.pixels) mask.inside[i] = 0;
  for (const image::Group& hole : image::groupsOf(mask, 0, false))
    if (!hole.touchesBorder && isBelow(hole, kSmall) && !isGap(hole))
      for (const size_t i : hole.pixels) mask.inside[i] = 1;
  return mask;
}

namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Samples {
  Eigen::ArrayXXd i; // radiance in units of the pixel's mean, or NaN; a row per light, a column per pixel
  Eigen::Matrix2Xd place; // per pixel: right and down from the picture's middle, in picture heights
};
using Weights = Eigen::ArrayXXd; // same layout as Samples::i

// Strengths s_l(p).
struct Lamps {
  ArrayXd s;          // at the middle; mean 1
  Eigen::MatrixX2d g; // gradients of the logarithm

  ArrayXd gains(const Vec2<double>& p) const { return (g * p).array().exp(); }
  ArrayXd at(const Vec2<double>& p) const { return s * gains(p); }
};

constexpr size_t kMostPixels = 20000, kFewestPixels = 50;
constexpr Eigen::Index kChunk =
    512; // pixels summed together, so that results do not depend on the thread count
constexpr int kRounds = 40, kFirstRounds = 8, kPixelRounds = 3;
constexpr double kSettled = 3e-5;     // largest change of a strength or gradient in the last round
constexpr double kSteepest = 3;       // largest fall-off over the object, as in gainAt
constexpr double kDarkest = 0.05;     // darker pixels, relative to the brightest, are mostly noise
constexpr double kGrazing = 0.05;     // smaller n . l is in or near the attached shadow
constexpr double kRejected = 3;       // standard deviations beyond which residuals have no weight
constexpr double kNormalMad = 1.4826; // standard deviation of a normal distribution over its median |x|

Error unclear() {
  return Error("the photographs do not tell how strong the lights were: the surface is flat or far from "
               "Lambert, or light directions are wrong");
}

template <class Body> void forChunks(Eigen::Index pixels, const Body& body) {
  const Eigen::Index chunks = (pixels + kChunk - 1) / kChunk;
  tbb::parallel_for(Eigen::Index{0}, chunks, [&](Eigen::Index chunk) {
    body(chunk, chunk * kChunk, std::min(pixels, (chunk + 1) * kChunk));
  });
}

// Throws unless the directions determine all strengths: no linear map but a multiple of the identity may keep
// all of them. Such a map A would turn L into L diag(s), and the surface b into A^-T b.
void checkDirections(const MatrixXd& towards) {
  const Eigen::Index n = towards.cols();
  MatrixXd kept(3 * n, 9); // unknowns are the nine entries of A, row by row: l x A l = 0
  for (Eigen::Index l = 0; l < n; ++l)
    for (int entry = 0; entry < 9; ++entry) {
      Vec3<double> image = Vec3<double>::Zero();
      image[entry / 3] = towards(entry % 3, l);
      kept.block<3, 1>(3 * l, entry) = towards.col(l).head<3>().cross(image);
    }
  // Squared singular values, rising.
  const VectorXd values =
      Eigen::SelfAdjointEigenSolver<MatrixXd>(kept.transpose() * kept, Eigen::EigenvaluesOnly).eigenvalues();
  if (n < 4 || values[1] < 1e-6 * values[8])
    throw Error::mismatch("at least four lights, no three of four in a plane with the object",
                          std::to_string(n) + " whose strengths could be traded for another surface")
        .at("lights");
}

void checkCount(size_t pixels) {
  if (pixels < kFewestPixels)
    throw Error::mismatch("at least " + std::to_string(kFewestPixels) + " lit object pixels",
                          std::to_string(pixels));
}

// Object pixels, evenly subsampled.
Samples samplesOf(std::span<const image::Image> radiance, const image::Mask& object, size_t channel) {
  const auto n = static_cast<Eigen::Index>(radiance.size());
  std::vector<size_t> pixels;
  for (size_t i = 0; i < object.inside.size(); ++i)
    if (object.inside[i]) pixels.push_back(i);
  checkCount(pixels.size());
  const size_t step = (pixels.size() + kMostPixels - 1) / kMostPixels;
  for (size_t i = 0; i * step < pixels.size(); ++i) pixels[i] = pixels[i * step];
  if (step > 1) pixels.resize((pixels.size() + step - 1) / step);

  const auto width = static_cast<size_t>(object.width);
  const Vec2<double> middle(object.width / 2., object.height / 2.);
  Samples samples{Eigen::ArrayXXd(n, pixels.size()), Eigen::Matrix2Xd(2, pixels.size())};
  for (Eigen::Index p = 0; p < samples.i.cols(); ++p) {
    const size_t pixel = pixels[static_cast<size_t>(p)];
    const Vec2<double> center(static_cast<double>(pixel % width) + 0.5,
                              static_cast<double>(pixel / width) + 0.5);
    samples.place.col(p) = (center - middle) / object.height;
    for (Eigen::Index l = 0; l < n; ++l) {
      const image::Image& image = radiance[static_cast<size_t>(l)];
      const auto channels = static_cast<size_t>(image.channels);
      samples.i(l, p) = image.values[pixel * channels + (channels == 3 ? channel : 0)];
    }
  }
  for (Eigen::Index l = 0; l < n; ++l) { // a clipped photograph is clipped at its largest value
    const double largest = samples.i.row(l).maxCoeff<Eigen::PropagateNumbers>();
    samples.i.row(l) = (samples.i.row(l) > 0 && samples.i.row(l) < largest).select(samples.i.row(l), NAN);
  }
  const ArrayXd brightness = samples.i.isNaN().select(0, samples.i).colwise().mean().transpose();
  std::vector<double> sorted(brightness.begin(), brightness.end());
  std::sort(sorted.begin(), sorted.end());
  const double darkest = kDarkest * sorted[sorted.size() * 99 / 100];
  Eigen::Index kept = 0;
  for (Eigen::Index p = 0; p < samples.i.cols(); ++p)
    if (brightness[p] > darkest) {
      samples.place.col(kept) = samples.place.col(p);
      samples.i.col(kept++) = samples.i.col(p) / brightness[p];
    }
  samples.i.conservativeResize(n, kept);
  samples.place.conservativeResize(2, kept);
  checkCount(static_cast<size_t>(kept));
  return samples;
}

// Returns whether weighted lights span space and so determine b.
bool isRegular(const Mat3<double>& normal) {
  const double mean = normal.trace() / 3;
  return normal.determinant() > 1e-6 * mean * mean * mean;
}

// The minimum over b of sum_l w_l (i_l - s_l b . l_l)^2; zero where the weighted lights span no space.
Vec3<double> fitSurface(const MatrixXd& towards, const ArrayXd& i, const ArrayXd& s, const ArrayXd& w) {
  Mat3<double> normal = Mat3<double>::Zero();
  Vec3<double> right = Vec3<double>::Zero();
  for (Eigen::Index l = 0; l < i.size(); ++l) {
    if (!(w[l] > 0)) continue;
    const Vec3<double> shaded = s[l] * towards.col(l).head<3>();
    normal += w[l] * shaded * shaded.transpose();
    right += w[l] * i[l] * shaded;
  }
  if (!isRegular(normal)) return Vec3<double>::Zero();
  return normal.inverse() * right;
}

ArrayXd residuals(const MatrixXd& towards, const ArrayXd& i, const ArrayXd& s, const Vec3<double>& b) {
  return i - s * (towards.transpose() * b).array();
}

// Tukey's biweight of a residual in units of the rejection bound.
double biweight(double x) { return std::abs(x) < 1 ? (1 - x * x) * (1 - x * x) : 0; }

// Weights of one pixel's samples that approximate a least absolute residuals fit, which is robust to
// outliers. All zero if the samples do not determine b.
ArrayXd firstWeights(const MatrixXd& towards, const ArrayXd& i, const ArrayXd& s) {
  const ArrayXd usable = i.isNaN().select(ArrayXd::Zero(i.size()), ArrayXd::Ones(i.size()));
  ArrayXd w = usable;
  for (int round = 0; round < kFirstRounds; ++round) {
    const Vec3<double> b = fitSurface(towards, i, s, w);
    if (b.isZero(0)) return ArrayXd::Zero(i.size());
    w = (usable > 0).select(residuals(towards, i, s, b).abs().max(0.1).inverse(), 0);
  }
  return w;
}

// Next weights, which reject residuals beyond the bound, and samples that the fit puts into shadow. All zero
// if fewer than four samples are left, which any b and s fit.
ArrayXd nextWeights(const MatrixXd& towards, const ArrayXd& i, const ArrayXd& s, ArrayXd w, double bound) {
  for (int round = 0; round < kPixelRounds; ++round) {
    const Vec3<double> b = fitSurface(towards, i, s, w);
    if (b.isZero(0)) return ArrayXd::Zero(i.size());
    const ArrayXd e = residuals(towards, i, s, b), cosine = (towards.transpose() * b).array() / b.norm();
    for (Eigen::Index l = 0; l < i.size(); ++l)
      w[l] = !std::isnan(i[l]) && cosine[l] > kGrazing ? biweight(e[l] / bound) : 0;
  }
  return (w > 0).count() >= 4 ? w : ArrayXd::Zero(i.size());
}

struct Step {
  Lamps lamps;
  double noise = 0, next = 0; // the two smallest eigenvalues: noise variance, and that of the next best t
};

// The t that minimises the part of t_l I_l(p) outside the range of b(p) . l_l. Noise of variance v in I adds
// v times `noise` to the matrix in expectation, so the generalised eigenvector is unbiased.
Step stepFrom(const Lamps& lamps, const MatrixXd& towards, const Samples& samples, const Weights& weights,
              bool holdsGradients) {
  const Eigen::Index n = towards.cols(), terms = holdsGradients ? 1 : 3, pixels = samples.i.cols();
  const auto chunks = static_cast<size_t>((pixels + kChunk - 1) / kChunk);
  std::vector<MatrixXd> matrices(chunks, MatrixXd::Zero(terms * n, terms * n)), noises = matrices;
  forChunks(pixels, [&](Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
    MatrixXd& matrix = matrices[static_cast<size_t>(chunk)];
    MatrixXd& noise = noises[static_cast<size_t>(chunk)];
    for (Eigen::Index p = begin; p < end; ++p) {
      const Vec2<double> place = samples.place.col(p);
      const ArrayXd gains = lamps.gains(place);
      // Noise of t I is t times that of I, so weights are scaled by s^2.
      const ArrayXd w = weights.col(p) * (lamps.s * gains).square();
      const MatrixXd weighted = towards * w.matrix().asDiagonal();
      const Mat3<double> normal = weighted * towards.transpose();
      if (!isRegular(normal)) continue;
      MatrixXd rest = -weighted.transpose() * normal.inverse() * weighted; // W - W L^T (L W L^T)^-1 L W
      rest.diagonal().array() += w;
      const ArrayXd i = samples.i.col(p).isNaN().select(0, samples.i.col(p)) / gains;
      const MatrixXd ofPixel = i.matrix().asDiagonal() * rest * i.matrix().asDiagonal();
      const ArrayXd noiseOfPixel = rest.diagonal().array() / gains.square();
      const Vec3<double> q(1, place.x(), place.y());
      for (Eigen::Index j = 0; j < terms; ++j)
        for (Eigen::Index k = 0; k <= j; ++k) { // the solver reads the lower triangle
          matrix.block(j * n, k * n, n, n) += q[j] * q[k] * ofPixel;
          noise.block(j * n, k * n, n, n).diagonal().array() += q[j] * q[k] * noiseOfPixel;
        }
    }
  });
  MatrixXd matrix = MatrixXd::Zero(terms * n, terms * n), noise = matrix;
  for (size_t chunk = 0; chunk < chunks; ++chunk) {
    matrix += matrices[chunk];
    noise += noises[chunk];
  }
  for (Eigen::Index l = 0; l < n; ++l)
    if (!(noise(l, l) > 0))
      throw Error("no object pixel is lit by it as a Lambert surface would be")
          .at("lights[" + std::to_string(l) + "]");
  const double stiff = matrix.trace(); // fixes the mean gradient: sum s_l u_l = 0
  for (Eigen::Index j = 1; j < terms; ++j)
    matrix.block(j * n, j * n, n, n) += stiff * lamps.s.matrix() * lamps.s.matrix().transpose();

  const Eigen::LLT<MatrixXd> root(noise); // the solver below does not check definiteness
  if (root.info() != Eigen::Success || !(root.rcond() > 1e-9)) throw unclear();
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(matrix, noise);
  if (solver.info() != Eigen::Success) throw unclear();
  VectorXd t = solver.eigenvectors().col(0);
  if (t.head(n).sum() < 0) t = -t;
  if (!(t.head(n).minCoeff() > 1e-6 * t.head(n).maxCoeff())) throw unclear();
  const ArrayXd strengths = t.head(n).array().inverse();
  Step step{{strengths / strengths.mean(), lamps.g}, solver.eigenvalues()[0], solver.eigenvalues()[1]};
  if (holdsGradients) return step;
  for (Eigen::Index j = 1; j < terms; ++j)
    step.lamps.g.col(j - 1).array() -= t.segment(j * n, n).array() * strengths;
  step.lamps.g.rowwise() -= step.lamps.g.colwise().mean();
  return step;
}

// Median |residual| as standard deviation over all lit samples, also rejected ones, so that rejecting more
// does not make it smaller.
double spread(const Lamps& lamps, const MatrixXd& towards, const Samples& samples, const Weights& weights) {
  Eigen::ArrayXXd lit(samples.i.rows(), samples.i.cols()); // |residual|, or NaN
  forChunks(samples.i.cols(), [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    for (Eigen::Index p = begin; p < end; ++p) {
      const ArrayXd i = samples.i.col(p), w = weights.col(p), s = lamps.at(samples.place.col(p));
      const Vec3<double> b = fitSurface(towards, i, s, w);
      const ArrayXd cosine = (towards.transpose() * b).array() / b.norm();
      lit.col(p) = (cosine <= kGrazing).select(NAN, residuals(towards, i, s, b).abs());
    }
  });
  std::vector<double> sizes;
  for (const double size : lit.reshaped())
    if (!std::isnan(size)) sizes.push_back(size);
  if (sizes.empty()) throw unclear();
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return kNormalMad * *middle;
}

// Initial strengths: medians over the surface, robust to outliers.
ArrayXd medianStrengths(const Samples& samples) {
  ArrayXd s(samples.i.rows());
  for (Eigen::Index l = 0; l < samples.i.rows(); ++l) {
    std::vector<double> values;
    for (const double v : samples.i.row(l))
      if (!std::isnan(v)) values.push_back(v);
    if (values.empty()) throw Error("no object pixel is lit").at("lights[" + std::to_string(l) + "]");
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    s[l] = *middle;
  }
  return s / s.mean();
}

// Fits strengths, and gradients unless they are held.
Lamps fitLamps(Lamps lamps, const MatrixXd& towards, const Samples& samples, bool holdsGradients) {
  Weights weights(samples.i.rows(), samples.i.cols());
  const auto weigh = [&](const auto& weightsOf) {
    forChunks(samples.i.cols(), [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
      for (Eigen::Index p = begin; p < end; ++p)
        weights.col(p) = weightsOf(p, samples.i.col(p), lamps.at(samples.place.col(p)));
    });
  };
  weigh([&](Eigen::Index, const ArrayXd& i, const ArrayXd& s) { return firstWeights(towards, i, s); });
  double bound = 1; // on residuals, in units of a pixel's mean; narrows from accepting all
  Step step;
  for (int round = 0; round < kRounds; ++round) {
    weigh([&](Eigen::Index p, const ArrayXd& i, const ArrayXd& s) {
      return nextWeights(towards, i, s, weights.col(p), bound);
    });
    step = stepFrom(lamps, towards, samples, weights, holdsGradients);
    const double change =
        std::max((step.lamps.s - lamps.s).abs().maxCoeff(), (step.lamps.g - lamps.g).cwiseAbs().maxCoeff());
    lamps = step.lamps;
    const double target = std::max(kRejected * spread(lamps, towards, samples, weights), 1e-6);
    const bool settled = change < kSettled && bound <= 1.05 * target;
    bound = std::max(target, 0.5 * bound);
    if (settled) break;
  }
  if (!(step.next > 2 * step.noise)) throw unclear();
  return lamps;
}

// Directions as columns, checked.
MatrixXd checkedDirections(std::span<const image::Image> radiance, const image::Mask& object,
                           std::span<const Direction3<AcquisitionSpace, double>> towards) {
  assert(radiance.size() == towards.size());
  for (size_t l = 0; l < radiance.size(); ++l)
    if (radiance[l].width != object.width || radiance[l].height != object.height)
      throw Error::mismatch(sizeText(object.width, object.height),
                            sizeText(radiance[l].width, radiance[l].height))
          .at("photograph " + std::to_string(l));
  MatrixXd directions(3, static_cast<Eigen::Index>(towards.size()));
  for (size_t l = 0; l < towards.size(); ++l) directions.col(static_cast<Eigen::Index>(l)) = towards[l].raw();
  checkDirections(directions);
  return directions;
}

size_t channelsOf(std::span<const image::Image> radiance) {
  const auto isGray = [](const image::Image& image) { return image.channels == 1; };
  return std::ranges::all_of(radiance, isGray) ? 1 : 3;
}

} // namespace

std::vector<Rgb> lightStrengths(std::span<const image::Image> radiance, const image::Mask& object,
                                std::span<const Direction3<AcquisitionSpace, double>> towards,
                                std::span<const StrengthGradient> gradients) {
  assert(gradients.empty() || gradients.size() == towards.size());
  const MatrixXd directions = checkedDirections(radiance, object, towards);
  Eigen::MatrixX2d g = Eigen::MatrixX2d::Zero(directions.cols(), 2);
  for (size_t l = 0; l < gradients.size(); ++l) g.row(static_cast<Eigen::Index>(l)) = gradients[l];
  std::vector<ArrayXd> s;
  for (size_t channel = 0; channel < channelsOf(radiance); ++channel) {
    const Samples samples = samplesOf(radiance, object, channel);
    s.push_back(fitLamps({medianStrengths(samples), g}, directions, samples, true).s);
  }
  std::vector<Rgb> strengths;
  for (Eigen::Index l = 0; l < directions.cols(); ++l) {
    const auto of = [&](size_t channel) { return static_cast<float>(s[std::min(channel, s.size() - 1)][l]); };
    strengths.push_back({of(0), of(1), of(2)});
  }
  return strengths;
}

std::vector<StrengthGradient> lightGradients(std::span<const image::Image> radiance,
                                             const image::Mask& object,
                                             std::span<const Direction3<AcquisitionSpace, double>> towards) {
  constexpr Eigen::Index kFewestLights = 6;
  const MatrixXd directions = checkedDirections(radiance, object, towards);
  if (directions.cols() < kFewestLights)
    throw Error::mismatch("at least six lights", std::to_string(directions.cols())).at("lights");
  // Gradients are equal in all channels.
  Eigen::MatrixX2d mean = Eigen::MatrixX2d::Zero(directions.cols(), 2);
  const Eigen::MatrixX2d none = mean;
  const size_t channels = channelsOf(radiance);
  for (size_t channel = 0; channel < channels; ++channel) {
    const Samples samples = samplesOf(radiance, object, channel);
    const Lamps even = fitLamps({medianStrengths(samples), none}, directions, samples, true);
    const Lamps uneven = fitLamps(even, directions, samples, false);
    if (!((uneven.g * samples.place).cwiseAbs().maxCoeff() < kSteepest)) throw unclear();
    mean += uneven.g / static_cast<double>(channels);
  }
  std::vector<StrengthGradient> gradients;
  for (Eigen::Index l = 0; l < directions.cols(); ++l) gradients.push_back(mean.row(l));
  return gradients;
}

} // namespace surflect::calibration
