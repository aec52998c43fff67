#include "srf/calibration/lamp_places.h"

#include "surfel/base/error.h"
#include "surfel/math/median.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace surflect::calibration {

namespace {

constexpr double kGrazingShade = 0.2; // least cosine of light and view
constexpr double kMirror = 0.92;   // greatest cosine between normal and half vector: 23 degrees from a mirror
constexpr double kShadowed = 0.05; // of a point's brightest shade; darker ones are in shadow
const double kUnlit = std::log1p(9.0); // cost of a residual of three scales
constexpr size_t kFewestPoints = 50;
constexpr int kParts = 8;                                           // of the surface, for standard errors
constexpr int kIterations = 60, kIterationsWithoutPart = 10;        // the latter start at the solution
constexpr size_t kMostChunks = 16, kChunkDoubles = size_t{1} << 24; // of the points: their matrices' sizes
constexpr Eigen::Index kBatch = 64; // points whose products are added together
constexpr double kRidge = 1e-9;     // of the mean diagonal; the common strength of all lamps is free

using Unknowns = Eigen::VectorXd; // x, y, z and logarithm of the strength of each lamp
using Row4 = Eigen::Matrix<double, 4, 1>;

// Logarithm of the shade of albedo 1, with its derivatives by a lamp's four unknowns.
struct Shade {
  double logarithm = 0;
  Row4 derivative = Row4::Zero();
  bool isLit = false;      // the lamp stands well above the surface
  bool isAccepted = false; // it is lit, neither grazing nor near mirror direction
};
Shade shadeOf(const LampPhotograph& photograph, const Vec3<double>& p, const Vec3<double>& n,
              const Unknowns& unknowns) {
  const Vec3<double> place = unknowns.segment<3>(static_cast<Eigen::Index>(4 * photograph.lamp));
  const Vec3<double> d = photograph.turn * place + photograph.shift - p;
  const double distance = d.norm(), across = n.dot(d), length = n.norm();
  Shade shade;
  shade.isLit = across > kGrazingShade * length * distance;
  if (!shade.isLit) return shade;
  const Vec3<double> view = (photograph.eye - p).normalized();
  shade.isAccepted =
      n.dot(view) > kGrazingShade * length && n.dot((view + d / distance).normalized()) <= kMirror * length;
  // log b = log(n . d) - 3 log |d|
  shade.logarithm = std::log(across) - 3 * std::log(distance) +
                    unknowns[static_cast<Eigen::Index>(4 * photograph.lamp + 3)];
  const Vec3<double> byPlace = n / across - 3 / (distance * distance) * d;
  shade.derivative << photograph.turn.transpose() * byPlace, 1;
  return shade;
}

// Shades of one point, sorted by point.
struct PointShades {
  uint32_t point;
  size_t first, end;
};

struct Observations {
  const ShadedSurface& surface;
  std::vector<ShadedPoint> shades; // by point, without shadows
  std::vector<PointShades> points;
  std::vector<int> part; // of each of `points`
  Vec3<double> middle;
};

// Shades relative to the mean of their lamp, which may be dim, tell shadows: darker than most of the point's
// others.
Observations observationsOf(const ShadedSurface& surface, size_t lamps) {
  std::vector<double> sums(lamps), counts(lamps);
  const auto lampOf = [&](const ShadedPoint& shade) { return surface.photographs[shade.photograph].lamp; };
  for (const ShadedPoint& shade : surface.shades) {
    sums[lampOf(shade)] += static_cast<double>(shade.luminance);
    ++counts[lampOf(shade)];
  }
  std::vector<double> brightest(surface.points.size());
  const auto relative = [&](const ShadedPoint& shade) {
    return static_cast<double>(shade.luminance) * counts[lampOf(shade)] / sums[lampOf(shade)];
  };
  for (const ShadedPoint& shade : surface.shades)
    brightest[shade.point] = std::max(brightest[shade.point], relative(shade));
  Observations all{surface, {}, {}, {}, surface.middle()};
  for (const ShadedPoint& shade : surface.shades)
    if (relative(shade) > kShadowed * brightest[shade.point]) all.shades.push_back(shade);
  std::ranges::stable_sort(all.shades, {}, &ShadedPoint::point);
  for (size_t first = 0; first < all.shades.size();) {
    size_t end = first;
    while (end < all.shades.size() && all.shades[end].point == all.shades[first].point) ++end;
    const uint32_t point = all.shades[first].point;
    all.points.push_back({point, first, end});
    const Vec3<double> from = surface.points[point] - all.middle;
    all.part.push_back((from.x() > 0) + 2 * (from.y() > 0) + 4 * (from.z() > 0));
    first = end;
  }
  return all;
}

// Normal equations of the places after albedo was eliminated, and the weighted sum of squares.
struct Equations {
  Eigen::MatrixXd matrix; // its lower half
  Eigen::VectorXd right;
  double cost = 0;
  size_t points = 0;            // with two accepted shades or more
  std::vector<size_t> shadesOf; // accepted ones, by lamp
  std::vector<double> residuals;
  size_t unlit = 0; // shades

  void add(const Equations& further) {
    matrix.triangularView<Eigen::Lower>() += further.matrix;
    right += further.right;
    cost += further.cost;
    points += further.points;
    for (size_t l = 0; l < shadesOf.size(); ++l) shadesOf[l] += further.shadesOf[l];
    residuals.insert(residuals.end(), further.residuals.begin(), further.residuals.end());
    unlit += further.unlit;
  }
};

// Equations by some of the points.
Equations equationsOf(const Observations& all, size_t begin, size_t end, const Unknowns& unknowns,
                      double scale, int withoutPart) {
  struct Accepted {
    double residual, weight;
    Row4 derivative;
    size_t lamp;
  };
  const Eigen::Index size = unknowns.size();
  Equations equations{Eigen::MatrixXd::Zero(size, size),
                      Eigen::VectorXd::Zero(size),
                      0,
                      0,
                      std::vector<size_t>(static_cast<size_t>(size) / 4),
                      {},
                      0};
  std::vector<Accepted> accepted;
  std::vector<double> residuals;
  // Weighted sums of derivatives over a point's shades, over the root of their weights: a column a point.
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(size, kBatch);
  Eigen::Index batched = 0;
  const auto takeBatch = [&] {
    equations.matrix.selfadjointView<Eigen::Lower>().rankUpdate(sums.leftCols(batched), -1);
    sums.setZero();
    batched = 0;
  };
  for (size_t i = begin; i < end; ++i) {
    if (all.part[i] == withoutPart) continue;
    const PointShades& point = all.points[i];
    accepted.clear();
    for (size_t s = point.first; s < point.end; ++s) {
      const ShadedPoint& shade = all.shades[s];
      const LampPhotograph& photograph = all.surface.photographs[shade.photograph];
      const Shade model =
          shadeOf(photograph, all.surface.points[point.point], shade.normal.cast<double>(), unknowns);
      // A place from which what the photograph shows is unlit is as wrong as an outlier.
      if (!model.isLit) equations.cost += scale * scale * kUnlit, ++equations.unlit;
      if (model.isAccepted)
        accepted.push_back({std::log(static_cast<double>(shade.luminance)) - model.logarithm, 1,
                            model.derivative, photograph.lamp});
    }
    if (accepted.size() < 2) continue;
    // The albedo: the median first, then a mean with Cauchy weights about it.
    residuals.clear();
    for (const Accepted& one : accepted) residuals.push_back(one.residual);
    double albedo = median(residuals), weights = 0;
    for (int round = 0; round < 3; ++round) {
      double sum = 0;
      weights = 0;
      for (Accepted& one : accepted) {
        const double off = (one.residual - albedo) / scale;
        one.weight = 1 / (1 + off * off);
        sum += one.weight * one.residual;
        weights += one.weight;
      }
      albedo = sum / weights;
    }
    ++equations.points;
    auto sum = sums.col(batched);
    for (Accepted& one : accepted) {
      const auto at = static_cast<Eigen::Index>(4 * one.lamp);
      const double residual = one.residual - albedo;
      equations.cost += scale * scale * std::log1p(residual * residual / (scale * scale));
      equations.residuals.push_back(std::abs(residual));
      equations.matrix.block<4, 4>(at, at) += one.weight * one.derivative * one.derivative.transpose();
      equations.right.segment<4>(at) += one.weight * residual * one.derivative;
      sum.segment<4>(at) += one.weight / std::sqrt(weights) * one.derivative;
      ++equations.shadesOf[one.lamp];
    }
    if (++batched == kBatch) takeBatch();
  }
  takeBatch();
  return equations;
}

// Chunks of points are fixed, and added in order, so that the sum does not depend on the number of threads.
Equations equationsAt(const Observations& all, const Unknowns& unknowns, double scale, int withoutPart) {
  const auto size = static_cast<size_t>(unknowns.size());
  const size_t chunks = std::clamp(kChunkDoubles / (size * size), size_t{1}, kMostChunks);
  std::vector<Equations> parts(chunks);
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    parts[c] = equationsOf(all, c * all.points.size() / chunks, (c + 1) * all.points.size() / chunks,
                           unknowns, scale, withoutPart);
  });
  for (size_t c = 1; c < chunks; ++c) parts[0].add(parts[c]);
  return std::move(parts[0]);
}

// Step that moves no lamp by more than half of its distance from the surface: the place of a far lamp would
// pass through infinity to the other side.
Unknowns limited(const Observations& all, const Unknowns& unknowns, Unknowns step) {
  std::vector<bool> isDone(static_cast<size_t>(unknowns.size()) / 4);
  for (const LampPhotograph& photograph : all.surface.photographs) {
    if (isDone[photograph.lamp]) continue;
    isDone[photograph.lamp] = true;
    const auto at = static_cast<Eigen::Index>(4 * photograph.lamp);
    const Vec3<double> from = photograph.turn * unknowns.segment<3>(at) + photograph.shift - all.middle;
    const double length = step.segment<3>(at).norm(), most = from.norm() / 2;
    if (length > most) step.segment<4>(at) *= most / length;
  }
  return step;
}

// Levenberg's and Marquardt's iterations with a scale of residuals that follows their median.
struct Fitted {
  Unknowns unknowns;
  double scale = 0.5; // of the residuals
  Equations equations;
};
Fitted refined(const Observations& all, Unknowns unknowns, double scale, int iterations, int withoutPart,
               const Progress& progress) {
  double damping = 1e-4;
  Equations now = equationsAt(all, unknowns, scale, withoutPart);
  for (int i = 0; i < iterations; ++i) {
    progress.checkpoint();
    if (now.points < kFewestPoints)
      throw Error::mismatch("at least " + std::to_string(kFewestPoints) +
                                " points of the mesh, lit and in two photographs or more",
                            std::to_string(now.points));
    Eigen::MatrixXd matrix = now.matrix;
    const double ridge = kRidge * matrix.diagonal().mean();
    matrix.diagonal() += damping * matrix.diagonal() + Eigen::VectorXd::Constant(matrix.rows(), ridge);
    const Unknowns solved = matrix.ldlt().solve(now.right);
    if (!solved.allFinite()) break;
    const Unknowns step = limited(all, unknowns, solved);
    Equations next = equationsAt(all, unknowns + step, scale, withoutPart);
    // Costs are compared per shade, because the accepted ones change.
    const auto perShade = [](const Equations& e) {
      return e.cost / static_cast<double>(e.residuals.size() + e.unlit);
    };
    if (next.points < kFewestPoints || perShade(next) > perShade(now) * (1 + 1e-12)) {
      damping = std::max(1e-6, damping) * 8;
      if (damping > 1e8) break;
      continue;
    }
    const bool isDone = step.norm() < 1e-9 * (1 + unknowns.norm());
    unknowns += step;
    damping /= 4;
    const double wanted = std::max(1e-6, 3 * median(next.residuals)); // 3 medians are two standard deviations
    const bool changes = std::abs(wanted - scale) > 0.02 * scale;
    scale = std::min(scale, wanted);
    now = changes ? equationsAt(all, unknowns, scale, withoutPart) : std::move(next);
    if (isDone && !changes) break;
  }
  return {std::move(unknowns), scale, std::move(now)};
}

} // namespace

Vec3<double> ShadedSurface::middle() const {
  Vec3<double> middle = Vec3<double>::Zero();
  for (const Vec3<double>& p : points) middle += p / static_cast<double>(points.size());
  return middle;
}

std::vector<LampPlace> lampPlaces(const ShadedSurface& surface, std::span<const Vec3<double>> guesses,
                                  const Progress& progress) {
  const Observations all = observationsOf(surface, guesses.size());
  Unknowns start = Unknowns::Zero(static_cast<Eigen::Index>(4 * guesses.size()));
  for (size_t l = 0; l < guesses.size(); ++l) start.segment<3>(static_cast<Eigen::Index>(4 * l)) = guesses[l];
  // First guesses of the strengths: as bright as the lamps' photographs are.
  std::vector<double> sums(guesses.size()), counts(guesses.size());
  for (const ShadedPoint& shade : all.shades) {
    const size_t lamp = surface.photographs[shade.photograph].lamp;
    sums[lamp] += static_cast<double>(shade.luminance);
    ++counts[lamp];
  }
  for (size_t l = 0; l < guesses.size(); ++l)
    if (counts[l] > 0) start[static_cast<Eigen::Index>(4 * l + 3)] = std::log(sums[l] / counts[l]);
  progress("lamps", 0);
  const Fitted fit = refined(all, start, Fitted().scale, kIterations, -1, progress);
  const Unknowns& found = fit.unknowns;
  const double misfit = median(fit.equations.residuals);
  // Delete-a-group jackknife over parts of the surface, whose errors hang together.
  std::vector<Unknowns> without;
  for (int part = 0; part < kParts; ++part) {
    progress("lamps", (part + 1.0) / (kParts + 1));
    if (std::ranges::find(all.part, part) == all.part.end()) continue;
    try {
      without.push_back(refined(all, found, fit.scale, kIterationsWithoutPart, part, progress).unknowns);
    } catch (const Error&) { // most of the surface is in this part
    }
  }
  const Vec3<double> middle = surface.middle();
  double meanLogarithm = 0;
  for (size_t l = 0; l < guesses.size(); ++l)
    meanLogarithm += found[static_cast<Eigen::Index>(4 * l + 3)] / static_cast<double>(guesses.size());
  std::vector<LampPlace> places;
  const auto parts = static_cast<double>(without.size());
  for (size_t l = 0; l < guesses.size(); ++l) {
    const auto at = static_cast<Eigen::Index>(4 * l);
    LampPlace& lamp = places.emplace_back();
    lamp.place = found.segment<3>(at);
    lamp.strength = std::exp(found[at + 3] - meanLogarithm);
    lamp.shades = fit.equations.shadesOf[l];
    lamp.misfit = misfit;
    // From the middle of the object, in the first photograph of the lamp.
    const auto photograph = std::ranges::find(surface.photographs, l, &LampPhotograph::lamp);
    if (photograph == surface.photographs.end() || without.size() < 2) {
      lamp.standardErrors.setConstant(std::numeric_limits<double>::infinity());
      lamp.errorOfDistance = lamp.errorOfDirection = std::numeric_limits<double>::infinity();
      continue;
    }
    const auto fromMiddle = [&](const Unknowns& unknowns) -> Vec3<double> {
      return photograph->turn * unknowns.segment<3>(at) + photograph->shift - middle;
    };
    Vec3<double> mean = Vec3<double>::Zero(), meanDirection = Vec3<double>::Zero();
    double meanInverse = 0; // 1 / distance hardly changes for a lamp that is far away
    for (const Unknowns& one : without) {
      mean += one.segment<3>(at) / parts;
      meanDirection += fromMiddle(one).normalized() / parts;
      meanInverse += 1 / (fromMiddle(one).norm() * parts);
    }
    Vec3<double> squares = Vec3<double>::Zero();
    double squaresOfInverse = 0, squaresOfDirection = 0;
    for (const Unknowns& one : without) {
      squares += (one.segment<3>(at) - mean).cwiseAbs2();
      squaresOfDirection += (fromMiddle(one).normalized() - meanDirection).squaredNorm();
      squaresOfInverse += std::pow(1 / fromMiddle(one).norm() - meanInverse, 2);
    }
    const double factor = (parts - 1) / parts;
    lamp.standardErrors = (factor * squares).cwiseSqrt();
    lamp.errorOfDirection = std::sqrt(factor * squaresOfDirection);
    lamp.errorOfDistance = std::sqrt(factor * squaresOfInverse) * fromMiddle(found).norm();
  }
  return places;
}

std::vector<Vec3<double>> guessedPlaces(const ShadedSurface& surface, size_t lamps, double distance) {
  std::vector<double> sum(surface.points.size()), count(surface.points.size());
  const Vec3<double> middle = surface.middle();
  for (const ShadedPoint& shade : surface.shades) {
    sum[shade.point] += static_cast<double>(shade.luminance);
    ++count[shade.point];
  }
  std::vector<Vec3<double>> directions(lamps, Vec3<double>::Zero());
  for (int round = 0; round < 4; ++round) { // points that face away from a lamp do not count
    std::vector<Mat3<double>> moments(lamps, Mat3<double>::Zero());
    std::vector<Vec3<double>> right(lamps, Vec3<double>::Zero());
    for (const ShadedPoint& shade : surface.shades) {
      const size_t lamp = surface.photographs[shade.photograph].lamp;
      const Vec3<double> n = shade.normal.cast<double>();
      if (round > 0 && !(n.dot(directions[lamp]) > 0)) continue;
      const double shown = static_cast<double>(shade.luminance) * count[shade.point] / sum[shade.point];
      moments[lamp] += n * n.transpose();
      right[lamp] += shown * n;
    }
    for (size_t l = 0; l < lamps; ++l) {
      const Mat3<double> regular =
          moments[l] + 1e-3 * (1e-12 + moments[l].trace()) * Mat3<double>::Identity();
      const Vec3<double> towards = regular.ldlt().solve(right[l]);
      if (towards.norm() > 0) directions[l] = towards.normalized();
    }
  }
  std::vector<Vec3<double>> places;
  for (const Vec3<double>& direction : directions) places.push_back(middle + distance * direction);
  return places;
}

} // namespace surflect::calibration
