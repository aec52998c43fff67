// Symbols: X radiance, rows (present texel, channel), columns lights; E eigenimages; A coefficients;
//          sigma_k^2 the energy of term k; K the rank.
#include "srf/store/block.h"

#include "srf/store/bytes.h"
#include "surfel/error.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>

namespace surflect {

namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

constexpr uint64_t allPresent = ~uint64_t{0};
constexpr uint8_t floatCoefficients = 1, partialBlock = 2; // flags of a record
constexpr std::array precisions = {16, 8, 4};              // bits of a term, in the record's order
constexpr float coefficientLimit = 1e33f; // far above what radiances below 1e30 need; sums stay finite
// What 16 bits at full rank reach, as part of the norm: half a quantiser step in each of up to 192 rows is
// sqrt(192) / (2 * 32639) = 2.1e-4.
constexpr double kReachable = 2.5e-4;
constexpr double kFaint = 1e-3;      // of white: darker blocks may err as if they were that bright
constexpr double nullEnergy = 1e-14; // of the strongest term: below lies the noise of the Gram matrix

// Of terms at 16 bits; others have levels for coefficients as for eigenimages, of the same precision.
enum class CoefficientType { half, single };

size_t bytesOf(CoefficientType type) { return type == CoefficientType::half ? 2 : 4; }

float asStored(float coefficient, CoefficientType type) {
  if (type == CoefficientType::single) return coefficient;
  return imath_half_to_float(imath_float_to_half(coefficient));
}

// The quantiser is symmetric: -levels .. levels. Of 16 bits it has as many as  256 high + low,  both of 8.
int levelsOf(int bits) { return bits == 16 ? 257 * 127 : (1 << (bits - 1)) - 1; }
// Coefficients are in memory times 1 / M, the step of their image. Such is one of a term at 16 bits; and, for
// those below, what one level of coefficients makes whose last level is the peak.
float inImageSteps(float coefficient) {
  return static_cast<float>(coefficient / static_cast<double>(levelsOf(16)));
}
double levelInImageSteps(float peak, int bits) {
  return peak / static_cast<double>(levelsOf(bits) * levelsOf(bits));
}

size_t levelBytes(size_t values, int bits) { return (values * bits + 7) / 8; }
size_t coefficientBytes(size_t lights, int bits, CoefficientType type) {
  return bits == 16 ? lights * bytesOf(type) : sizeof(float) + levelBytes(lights, bits);
}

// Of V X W.
struct Factors {
  MatrixXd images;   // E, rows x K, orthonormal columns
  MatrixXd lights;   // lights x K, orthonormal columns
  VectorXd energies; // sigma_k^2, falling
};

// Singular value decomposition through the Gram matrix of the shorter side.
Factors factorise(const MatrixXd& x) {
  const bool overLights = x.cols() <= x.rows();
  const MatrixXd gram = overLights ? MatrixXd(x.transpose() * x) : MatrixXd(x * x.transpose());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
  const VectorXd energies = solver.eigenvalues().reverse();
  Eigen::Index terms = 0;
  while (terms < energies.size() && energies[terms] > nullEnergy * energies[0]) ++terms;

  const MatrixXd vectors = solver.eigenvectors().rowwise().reverse().leftCols(terms);
  const VectorXd strongest = energies.head(terms);
  const auto inverse = strongest.cwiseSqrt().cwiseInverse().asDiagonal();
  if (overLights) return {x * vectors * inverse, vectors, strongest};
  return {vectors, x.transpose() * vectors * inverse, strongest};
}

// The levels nearest to values of which the largest is put on the last one.
VectorXd quantised(const VectorXd& values, int bits) {
  return (values * (levelsOf(bits) / values.cwiseAbs().maxCoeff())).array().round();
}

// What the best multiple of b leaves of the unit vector a: sin^2 of the angle between them.
double residual(const VectorXd& a, const VectorXd& b) {
  const double along = a.dot(b);
  return (a - along / b.squaredNorm() * b).squaredNorm();
}

// Of coefficients whose weighted norm is 1: the squared error of their levels, weighted.
double coefficientError(const VectorXd& coefficients, const VectorXd& weights, int bits) {
  const double step = coefficients.cwiseAbs().maxCoeff() / levelsOf(bits);
  return ((coefficients - step * quantised(coefficients, bits)).cwiseProduct(weights)).squaredNorm();
}

// What is to be stored, and how well.
struct Target {
  MatrixXd x;
  VectorXd rows, lights;   // the diagonals of V and W
  double squaredBound = 0; // of V X W
};

// A step of one term from a precision (at first: none) to a higher one.
struct Upgrade {
  int term = 0;
  int bits = 0;
  double saved = 0; // squared error
  double savedPerByte = 0;
};

// All steps worth taking, best first; every beginning of the list is the cheapest choice of rank and
// precisions for the error that it leaves (a Lagrangian optimum: per term the steps follow the convex hull).
std::vector<Upgrade> upgradesOf(const Factors& factors, const Target& target, CoefficientType type) {
  struct Choice {
    int bits;
    double bytes, squaredError;
  };
  std::vector<Upgrade> upgrades;
  for (int k = 0; k < factors.energies.size(); ++k) {
    const VectorXd image = factors.images.col(k);
    const VectorXd coefficients = factors.lights.col(k).cwiseQuotient(target.lights);
    std::vector<Choice> choices = {{0, 0, factors.energies[k]}};
    for (const int bits : {4, 8, 16}) {
      const size_t bytes =
          levelBytes(image.size(), bits) + coefficientBytes(target.lights.size(), bits, type);
      const VectorXd levels = quantised(image.cwiseQuotient(target.rows), bits);
      const double rounded = bits == 16 ? 0 : coefficientError(coefficients, target.lights, bits);
      const double left = factors.energies[k] * (residual(image, levels.cwiseProduct(target.rows)) + rounded);
      choices.push_back({bits, static_cast<double>(bytes), left});
    }
    for (size_t from = 0;;) {
      Upgrade steepest;
      size_t to = from;
      for (size_t i = from + 1; i < choices.size(); ++i) {
        const double saved = choices[from].squaredError - choices[i].squaredError;
        const double savedPerByte = saved / (choices[i].bytes - choices[from].bytes);
        if (savedPerByte <= steepest.savedPerByte) continue;
        steepest = {k, choices[i].bits, saved, savedPerByte};
        to = i;
      }
      if (to == from) break;
      upgrades.push_back(steepest);
      from = to;
    }
  }
  std::ranges::stable_sort(upgrades, std::greater{}, &Upgrade::savedPerByte);
  return upgrades;
}

// A choice of terms as it would be stored.
struct Encoding {
  CoefficientType type = CoefficientType::half;
  std::vector<int> bits;           // per stored term, falling
  MatrixXd levels;                 // rows x K
  MatrixXf coefficients;           // K x lights; of terms at 16 bits
  MatrixXf perLevel;               // coefficients as decoded: X' = levels perLevel
  MatrixXd lightLevels;            // lights x K; of terms below 16 bits
  std::vector<float> peaks;        // per stored term: the coefficient of the last level; below 16 bits
  double squaredError = 0;         // of X
  double squaredWeightedError = 0; // of V X W

  MatrixXd decoded() const { return levels * perLevel.cast<double>(); }
};

// Puts solved coefficients, K x lights, into the form in which they are stored.
void store(const MatrixXd& solved, Encoding& encoding) {
  encoding.coefficients.setZero(solved.rows(), solved.cols());
  encoding.perLevel.resize(solved.rows(), solved.cols());
  encoding.lightLevels.setZero(solved.cols(), solved.rows());
  encoding.peaks.assign(static_cast<size_t>(solved.rows()), 0);
  for (Eigen::Index k = 0; k < solved.rows(); ++k) {
    const int bits = encoding.bits[static_cast<size_t>(k)];
    const VectorXd row = solved.row(k);
    if (bits == 16) {
      encoding.coefficients.row(k) =
          row.cast<float>().unaryExpr([&](float a) { return asStored(a, encoding.type); });
      encoding.perLevel.row(k) =
          encoding.coefficients.row(k).unaryExpr([](float a) { return inImageSteps(a); });
      continue;
    }
    const auto peak = static_cast<float>(row.cwiseAbs().maxCoeff());
    encoding.peaks[static_cast<size_t>(k)] = peak;
    if (peak > 0) encoding.lightLevels.col(k) = quantised(row, bits);
    encoding.perLevel.row(k) = (levelInImageSteps(peak, bits) * encoding.lightLevels.col(k)).cast<float>();
  }
}

Encoding realise(const Target& target, const Factors& factors, std::span<const Upgrade> upgrades,
                 CoefficientType type) {
  const MatrixXd& x = target.x;
  std::vector<int> bitsOfTerm(factors.energies.size());
  for (const Upgrade& upgrade : upgrades) bitsOfTerm[upgrade.term] = upgrade.bits;

  Encoding encoding;
  encoding.type = type;
  const auto rank = std::ranges::count_if(bitsOfTerm, [](int bits) { return bits > 0; });
  encoding.levels.resize(x.rows(), rank);
  MatrixXd basis(x.rows(), rank);
  for (const int bits : precisions) {
    for (size_t k = 0; k < bitsOfTerm.size(); ++k) {
      if (bitsOfTerm[k] != bits) continue;
      const auto column = static_cast<Eigen::Index>(encoding.bits.size());
      encoding.levels.col(column) = quantised(factors.images.col(k).cwiseQuotient(target.rows), bits);
      basis.col(column) = encoding.levels.col(column) / levelsOf(bits);
      encoding.bits.push_back(bits);
    }
  }
  // Coefficients are solved for again, now that the eigenimages have moved.
  MatrixXd solved(0, x.cols());
  if (rank > 0)
    solved = (target.rows.asDiagonal() * basis).colPivHouseholderQr().solve(target.rows.asDiagonal() * x);
  store(solved, encoding);
  const MatrixXd error = x - encoding.decoded();
  encoding.squaredError = error.squaredNorm();
  encoding.squaredWeightedError =
      (target.rows.asDiagonal() * error * target.lights.asDiagonal()).squaredNorm();
  return encoding;
}

// Empty where no choice with coefficients of this type keeps the bound.
std::optional<Encoding> cheapest(const Target& target, const Factors& factors, CoefficientType type) {
  const std::vector<Upgrade> all = upgradesOf(factors, target, type);
  const std::span<const Upgrade> upgrades(all);
  const auto realised = [&](size_t count) { return realise(target, factors, upgrades.first(count), type); };
  const auto keepsBound = [&](const Encoding& c) { // NaN does not
    return c.squaredWeightedError <= target.squaredBound;
  };

  size_t count = 0;
  for (double left = factors.energies.sum(); left > target.squaredBound && count < upgrades.size(); ++count)
    left -= upgrades[count].saved;

  // From the predicted choice up until the actual error is small enough, then down while it still is.
  Encoding encoding = realised(count);
  for (size_t step = 1; !keepsBound(encoding); step *= 2) {
    if (count == upgrades.size()) return std::nullopt;
    count = std::min(count + step, upgrades.size());
    encoding = realised(count);
  }
  for (; count > 0; --count) {
    Encoding cheaper = realised(count - 1);
    if (!keepsBound(cheaper)) break;
    encoding = std::move(cheaper);
  }
  return encoding;
}

Target targetOf(const MatrixXd& x, double tolerance, double white) {
  const BlockWeights weights = blockWeights(x, white);
  const VectorXd rows = weights.channels.replicate(x.rows() / 3, 1);
  const double bound = blockErrorBound(x, weights, tolerance, white);
  return {x, rows, weights.lights, bound * bound};
}

double clippedSquaredError(const MatrixXd& x, const MatrixXd& stored, double white) {
  const auto clipped = [&](const MatrixXd& m) { return m.cwiseMax(0).cwiseMin(white); };
  return (clipped(x) - clipped(stored)).squaredNorm();
}

void appendLevels(std::vector<std::byte>& record, const VectorXd& levels, int bits) {
  if (bits == 16)
    for (const double level : levels) append(record, static_cast<int16_t>(level));
  else if (bits == 8)
    for (const double level : levels) append(record, static_cast<int8_t>(level));
  else
    for (Eigen::Index i = 0; i < levels.size(); i += 2) {
      const int low = static_cast<int>(levels[i]);
      const int high = i + 1 < levels.size() ? static_cast<int>(levels[i + 1]) : 0;
      append(record, static_cast<uint8_t>((low & 15) | (high & 15) << 4));
    }
}

// use(i, level), for each.
template <class Use> void takeLevels(ByteReader& reader, int bits, size_t count, const Use& use) {
  const std::span<const std::byte> raw = reader.take(levelBytes(count, bits));
  ByteReader levels(raw);
  for (size_t i = 0; i < count; ++i) {
    int level = 0;
    if (bits == 16)
      level = levels.take<int16_t>();
    else if (bits == 8)
      level = levels.take<int8_t>();
    else
      level = ((std::to_integer<int>(raw[i / 2]) >> (i % 2 * 4) & 15) ^ 8) - 8;
    use(i, std::clamp(level, -levelsOf(bits), levelsOf(bits)));
  }
}

// Of 8 bits, as levels are in memory.
int planesOf(int bits) { return bits == 16 ? 2 : 1; }

// Written to e[0], e[stride], ...; of 16 bits, high ones to e[0], low ones to e[1].
void takeImage(ByteReader& reader, int bits, size_t count, int8_t* e, size_t stride) {
  takeLevels(reader, bits, count, [&](size_t i, int level) {
    const auto low = static_cast<int8_t>(level);
    if (bits == 16) {
      e[i * stride] = static_cast<int8_t>((level - low) / 256);
      e[i * stride + 1] = low;
    } else {
      e[i * stride] = low;
    }
  });
}

void appendCoefficient(std::vector<std::byte>& record, float a, CoefficientType type) {
  if (type == CoefficientType::half)
    append(record, imath_float_to_half(a));
  else
    append(record, a);
}

float takeCoefficient(ByteReader& reader, CoefficientType type) {
  const float a =
      type == CoefficientType::half ? imath_half_to_float(reader.take<uint16_t>()) : reader.take<float>();
  if (!(std::abs(a) < coefficientLimit))
    throw Error::mismatch("a number below 1e33", std::to_string(a)).at("coefficients");
  return a;
}

// Of the planes that takeImage makes, times what a level stands for.
void takeCoefficients(ByteReader& reader, int bits, CoefficientType type, size_t lights, float* a,
                      size_t stride) {
  if (bits == 16) {
    for (size_t l = 0; l < lights; ++l) {
      const float low = inImageSteps(takeCoefficient(reader, type));
      a[l * stride] = 256 * low;
      a[l * stride + 1] = low;
    }
    return;
  }
  const double ofLevel = levelInImageSteps(takeCoefficient(reader, CoefficientType::single), bits);
  takeLevels(reader, bits, lights,
             [&](size_t l, int level) { a[l * stride] = static_cast<float>(ofLevel * level); });
}

std::vector<std::byte> recordOf(uint64_t present, const Encoding& encoding) {
  std::vector<std::byte> record;
  uint8_t flags = encoding.type == CoefficientType::single ? floatCoefficients : 0;
  if (present != allPresent) flags |= partialBlock;
  append(record, flags);
  for (const int bits : precisions)
    append(record, static_cast<uint8_t>(std::ranges::count(encoding.bits, bits)));
  if (present != allPresent) append(record, present);
  for (size_t k = 0; k < encoding.bits.size(); ++k) {
    const auto term = static_cast<Eigen::Index>(k);
    if (encoding.bits[k] == 16) {
      for (const float a : encoding.coefficients.row(term)) appendCoefficient(record, a, encoding.type);
    } else {
      append(record, encoding.peaks[k]);
      appendLevels(record, encoding.lightLevels.col(term), encoding.bits[k]);
    }
    appendLevels(record, encoding.levels.col(term), encoding.bits[k]);
  }
  return record;
}

// The present texel nearest to an absent one, the first of those equally near.
int nearestPresent(uint64_t present, int texel) {
  int nearest = 0, least = 2 * blockTexels;
  for (uint64_t rest = present; rest != 0; rest &= rest - 1) {
    const int other = std::countr_zero(rest);
    const int dx = other % blockSize - texel % blockSize, dy = other / blockSize - texel / blockSize;
    if (dx * dx + dy * dy >= least) continue;
    least = dx * dx + dy * dy;
    nearest = other;
  }
  return nearest;
}

} // namespace

double errorWeight(double rms, double white) {
  constexpr double kDark = 0.01;
  const double r = rms / white;
  return 1 / std::sqrt(r * r + r + kDark);
}

BlockWeights blockWeights(const MatrixXd& x, double white) {
  const Eigen::Index texels = x.rows() / 3;
  BlockWeights weights{Eigen::Vector3d::Zero(), VectorXd(x.cols())};
  for (Eigen::Index l = 0; l < x.cols(); ++l) {
    const Eigen::Vector3d squares = x.col(l).reshaped(3, texels).rowwise().squaredNorm() / texels;
    weights.lights[l] = errorWeight(std::sqrt(squares.mean()), white);
    for (int c = 0; c < 3; ++c)
      weights.channels[c] += std::pow(errorWeight(std::sqrt(squares[c]), white) / weights.lights[l], 2);
  }
  weights.channels = (weights.channels / x.cols()).cwiseSqrt();
  return weights;
}

double blockErrorBound(const MatrixXd& x, const BlockWeights& weights, double tolerance, double white) {
  const VectorXd rows = weights.channels.replicate(x.rows() / 3, 1);
  const double floor =
      kFaint * white * errorWeight(kFaint * white, white) * std::sqrt(static_cast<double>(x.size()));
  const double reachable =
      kReachable * weights.channels.maxCoeff() * (x * weights.lights.asDiagonal()).norm();
  const double weighed = (rows.asDiagonal() * x * weights.lights.asDiagonal()).norm();
  return std::max(tolerance * std::max(weighed, floor), reachable);
}

EncodedBlock encodeBlock(uint64_t present, const MatrixXf& radiance, double tolerance, double white) {
  assert(present != 0 && radiance.rows() == 3 * std::popcount(present) && radiance.cols() > 0 && white > 0);
  const MatrixXd x = radiance.cast<double>();
  const Target target = targetOf(x, tolerance, white);
  const Factors factors = factorise(target.rows.asDiagonal() * x * target.lights.asDiagonal());
  std::optional<Encoding> encoding = cheapest(target, factors, CoefficientType::half);
  if (!encoding) encoding = cheapest(target, factors, CoefficientType::single);
  if (!encoding) throw Error("a block spans too many orders of magnitude to be stored within the tolerance");

  EncodedBlock block;
  block.record = recordOf(present, *encoding);
  block.rank = static_cast<int>(encoding->bits.size());
  block.squaredError = encoding->squaredError;
  const MatrixXd stored = encoding->decoded();
  block.clippedSquaredError = clippedSquaredError(x, stored, white);
  return block;
}

Block decodeBlock(std::span<const std::byte> record, size_t lights) {
  ByteReader reader(record);
  const auto flags = reader.take<uint8_t>();
  if ((flags & ~(floatCoefficients | partialBlock)) != 0)
    throw Error::mismatch("0..3", std::to_string(flags)).at("flags");
  std::array<int, precisions.size()> terms{}; // at each precision
  for (int& count : terms) count = reader.take<uint8_t>();

  Block block;
  block.present = flags & partialBlock ? reader.take<uint64_t>() : allPresent;
  if (block.present == 0) throw Error::mismatch("at least one texel", "none").at("present");
  for (const int count : terms) block.rank += count;
  const size_t rows = 3 * std::popcount(block.present);
  if (const size_t limit = std::min(rows, lights); static_cast<size_t>(block.rank) > limit)
    throw Error::mismatch("at most " + std::to_string(limit), std::to_string(block.rank)).at("rank");
  for (size_t p = 0; p < precisions.size(); ++p) block.stride += terms[p] * planesOf(precisions[p]);
  block.stride = (block.stride + 3) / 4 * 4;

  const CoefficientType type = flags & floatCoefficients ? CoefficientType::single : CoefficientType::half;
  size_t bytes = 0;
  for (size_t p = 0; p < precisions.size(); ++p)
    bytes += terms[p] * (coefficientBytes(lights, precisions[p], type) + levelBytes(rows, precisions[p]));
  if (reader.left() != bytes)
    throw Error::mismatch(std::to_string(bytes) + " bytes of terms", std::to_string(reader.left()));
  block.lights = lights;
  const size_t texelLevels = 3 * static_cast<size_t>(block.stride);
  block.values.resize(lights * block.stride * sizeof(float) + blockTexels * texelLevels);
  auto* const coefficients = reinterpret_cast<float*>(block.values.data());
  std::vector<int8_t> packed(rows * block.stride); // [present texels x channels][stride]
  int k = 0;
  for (size_t p = 0; p < precisions.size(); ++p)
    for (int i = 0; i < terms[p]; ++i, k += planesOf(precisions[p])) {
      takeCoefficients(reader, precisions[p], type, lights, coefficients + k, block.stride);
      takeImage(reader, precisions[p], rows, packed.data() + k, block.stride);
    }

  auto* const levels = reinterpret_cast<int8_t*>(coefficients + lights * block.stride);
  for (int t = 0; t < blockTexels; ++t) {
    const int source = block.present >> t & 1 ? t : nearestPresent(block.present, t);
    const int packedTexel = std::popcount(block.present & ((uint64_t{1} << source) - 1));
    std::copy_n(packed.data() + packedTexel * texelLevels, texelLevels, levels + t * texelLevels);
  }
  return block;
}

} // namespace surflect
