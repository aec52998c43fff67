// Lambert's law in the inverse strength t_l = 1 / s_l is linear in both unknowns,
//
//   t_l I_l(p) = b(p) . l_l,
//
// so with b eliminated (variable projection) t is the smallest eigenvector of an n x n matrix, whatever
// samples are left out. Leaving out and solving alternate.
//
//   I_l(p)  radiance of pixel p under light l     b(p)  albedo times unit normal
//   l_l     unit direction towards light l        w_l   weight of a sample
//   n       number of lights
#include "srf/calibration/strengths.h"

#include "surfel/error.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <string>

namespace surflect {

namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Samples = Eigen::ArrayXXd; // one row a light, one column a pixel

constexpr size_t kMostPixels = 20000, kFewestPixels = 50;
constexpr Eigen::Index kChunk = 512; // pixels whose sums are made together: the same for any thread count
constexpr int kRounds = 40, kFirstRounds = 8, kPixelRounds = 3;
constexpr double kSettled = 3e-5;     // change of a strength in the last round
constexpr double kDarkest = 0.05;     // pixels darker than this share of the brightest are mostly noise
constexpr double kGrazing = 0.05;     // n . l below which a sample is in or near the attached shadow
constexpr double kRejected = 3;       // residuals beyond this many standard deviations have no weight
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

// Every strength can be told only if no linear map but a multiple of the identity keeps all directions: such
// a map A would turn L into L diag(s), and the surface b into A^-T b.
void checkDirections(const MatrixXd& towards) {
  const Eigen::Index n = towards.cols();
  MatrixXd kept(3 * n, 9); // of the nine entries of A, row by row: l x A l = 0
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

// Object pixels, evenly thinned, in units of their own brightness; unusable samples are NaN.
Samples samplesOf(std::span<const Image> radiance, const Mask& object, size_t channel) {
  const auto n = static_cast<Eigen::Index>(radiance.size());
  std::vector<size_t> pixels;
  for (size_t i = 0; i < object.inside.size(); ++i)
    if (object.inside[i]) pixels.push_back(i);
  checkCount(pixels.size());
  const size_t step = (pixels.size() + kMostPixels - 1) / kMostPixels;
  for (size_t i = 0; i * step < pixels.size(); ++i) pixels[i] = pixels[i * step];
  if (step > 1) pixels.resize((pixels.size() + step - 1) / step);

  Samples samples(n, static_cast<Eigen::Index>(pixels.size()));
  for (Eigen::Index l = 0; l < n; ++l) {
    const Image& image = radiance[static_cast<size_t>(l)];
    const auto channels = static_cast<size_t>(image.channels);
    for (Eigen::Index p = 0; p < samples.cols(); ++p)
      samples(l, p) = static_cast<double>(
          image.values[pixels[static_cast<size_t>(p)] * channels + (channels == 3 ? channel : 0)]);
  }
  for (Eigen::Index l = 0; l < n; ++l) { // where a photograph is clipped, it is so at its largest value
    const double largest = samples.row(l).maxCoeff<Eigen::PropagateNumbers>();
    samples.row(l) = (samples.row(l) > 0 && samples.row(l) < largest).select(samples.row(l), NAN);
  }
  const ArrayXd brightness = samples.isNaN().select(0, samples).colwise().mean().transpose();
  std::vector<double> sorted(brightness.begin(), brightness.end());
  std::sort(sorted.begin(), sorted.end());
  const double darkest = kDarkest * sorted[sorted.size() * 99 / 100];
  Eigen::Index kept = 0;
  for (Eigen::Index p = 0; p < samples.cols(); ++p)
    if (brightness[p] > darkest) samples.col(kept++) = samples.col(p) / brightness[p];
  samples.conservativeResize(n, kept);
  checkCount(static_cast<size_t>(kept));
  return samples;
}

// Do weighted lights span space, so that they determine b?
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

// Weights of the samples of one pixel that come near to least absolute residuals: a fit that outliers do not
// move far. All zero where the samples do not determine b.
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

// From the weights so far, those that leave out what lies beyond the bound, and what the fit itself puts into
// shadow. All zero where fewer than four samples are left, which any b and s fit.
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

struct Fit {
  ArrayXd s;                  // strengths, mean 1
  double noise = 0, next = 0; // the two smallest eigenvalues: variance of the noise, and of the next best t
};

// The t that leaves the least of t_l I_l(p) outside what b(p) . l_l can be. Noise of variance v in I adds
// v times `noise` to the matrix in expectation, so that the generalised eigenvector is without bias.
Fit fitStrengths(const MatrixXd& towards, const Samples& samples, const Samples& weights, const ArrayXd& s) {
  const Eigen::Index n = samples.rows(), chunks = (samples.cols() + kChunk - 1) / kChunk;
  std::vector<MatrixXd> matrices(static_cast<size_t>(chunks), MatrixXd::Zero(n, n));
  std::vector<VectorXd> noises(static_cast<size_t>(chunks), VectorXd::Zero(n));
  forChunks(samples.cols(), [&](Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
    MatrixXd& matrix = matrices[static_cast<size_t>(chunk)];
    VectorXd& noise = noises[static_cast<size_t>(chunk)];
    for (Eigen::Index p = begin; p < end; ++p) {
      // In t I, noise is t times that of I: weigh by s^2.
      const ArrayXd w = weights.col(p) * s.square();
      const MatrixXd weighted = towards * w.matrix().asDiagonal();
      const Mat3<double> normal = weighted * towards.transpose();
      if (!isRegular(normal)) continue;
      MatrixXd rest = -weighted.transpose() * normal.inverse() * weighted; // W - W L^T (L W L^T)^-1 L W
      rest.diagonal().array() += w;
      const ArrayXd i = samples.col(p).isNaN().select(0, samples.col(p));
      matrix += i.matrix().asDiagonal() * rest * i.matrix().asDiagonal();
      noise += rest.diagonal();
    }
  });
  MatrixXd matrix = MatrixXd::Zero(n, n);
  VectorXd noise = VectorXd::Zero(n);
  for (size_t chunk = 0; chunk < matrices.size(); ++chunk) {
    matrix += matrices[chunk];
    noise += noises[chunk];
  }
  for (Eigen::Index l = 0; l < n; ++l)
    if (!(noise[l] > 0))
      throw Error("no object pixel is lit by it as a Lambert surface would be")
          .at("lights[" + std::to_string(l) + "]");
  const VectorXd perNoise = noise.array().rsqrt();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(perNoise.asDiagonal() * matrix *
                                                       perNoise.asDiagonal());
  VectorXd t = perNoise.cwiseProduct(solver.eigenvectors().col(0));
  if (t.sum() < 0) t = -t;
  if (!(t.minCoeff() > 1e-6 * t.maxCoeff())) throw unclear();
  const ArrayXd strengths = t.array().inverse();
  return {strengths / strengths.mean(), solver.eigenvalues()[0], solver.eigenvalues()[1]};
}

// The median |residual| as standard deviation: of all lit samples, left out or not, so that leaving out more
// does not make it smaller.
double spread(const MatrixXd& towards, const Samples& samples, const Samples& weights, const ArrayXd& s) {
  std::vector<double> sizes;
  for (Eigen::Index p = 0; p < samples.cols(); ++p) {
    const ArrayXd i = samples.col(p), w = weights.col(p);
    const Vec3<double> b = fitSurface(towards, i, s, w);
    const ArrayXd e = residuals(towards, i, s, b), cosine = (towards.transpose() * b).array() / b.norm();
    for (Eigen::Index l = 0; l < i.size(); ++l)
      if (!std::isnan(i[l]) && !(cosine[l] <= kGrazing)) sizes.push_back(std::abs(e[l]));
  }
  if (sizes.empty()) throw unclear();
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return kNormalMad * *middle;
}

ArrayXd channelStrengths(const MatrixXd& towards, const Samples& samples) {
  // Medians over the surface are a start that no outlier moves far.
  ArrayXd s(samples.rows());
  for (Eigen::Index l = 0; l < samples.rows(); ++l) {
    std::vector<double> values;
    for (const double v : samples.row(l))
      if (!std::isnan(v)) values.push_back(v);
    if (values.empty()) throw Error("no object pixel is lit").at("lights[" + std::to_string(l) + "]");
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    s[l] = *middle;
  }
  s /= s.mean();

  Samples weights(samples.rows(), samples.cols());
  forChunks(samples.cols(), [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    for (Eigen::Index p = begin; p < end; ++p) weights.col(p) = firstWeights(towards, samples.col(p), s);
  });
  double bound = 1; // of residuals, in units of a pixel's mean: narrows down from all that is
  Fit fit;
  for (int round = 0; round < kRounds; ++round) {
    forChunks(samples.cols(), [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
      for (Eigen::Index p = begin; p < end; ++p)
        weights.col(p) = nextWeights(towards, samples.col(p), s, weights.col(p), bound);
    });
    fit = fitStrengths(towards, samples, weights, s);
    const double change = (fit.s - s).abs().maxCoeff();
    s = fit.s;
    const double target = std::max(kRejected * spread(towards, samples, weights, s), 1e-6);
    const bool settled = change < kSettled && bound <= 1.05 * target;
    bound = std::max(target, 0.5 * bound);
    if (settled) break;
  }
  if (!(fit.next > 2 * fit.noise)) throw unclear();
  return s;
}

} // namespace

std::vector<Rgb> lightStrengths(std::span<const Image> radiance, const Mask& object,
                                std::span<const Direction3<AcquisitionSpace, double>> towards) {
  assert(radiance.size() == towards.size());
  for (size_t l = 0; l < radiance.size(); ++l)
    if (radiance[l].width != object.width || radiance[l].height != object.height)
      throw Error::mismatch(std::to_string(object.width) + " x " + std::to_string(object.height),
                            std::to_string(radiance[l].width) + " x " + std::to_string(radiance[l].height))
          .at("photograph " + std::to_string(l));
  MatrixXd directions(3, static_cast<Eigen::Index>(towards.size()));
  for (size_t l = 0; l < towards.size(); ++l) directions.col(static_cast<Eigen::Index>(l)) = towards[l].raw();
  checkDirections(directions);

  const bool gray = std::ranges::all_of(radiance, [](const Image& image) { return image.channels == 1; });
  std::array<ArrayXd, 3> s;
  for (size_t channel = 0; channel < 3; ++channel)
    s[channel] =
        gray && channel > 0 ? s[0] : channelStrengths(directions, samplesOf(radiance, object, channel));
  std::vector<Rgb> strengths;
  for (Eigen::Index l = 0; l < directions.cols(); ++l)
    strengths.push_back(
        {static_cast<float>(s[0][l]), static_cast<float>(s[1][l]), static_cast<float>(s[2][l])});
  return strengths;
}

} // namespace surflect
