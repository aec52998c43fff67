#include "render/lightfield/slf/texel_radiance.h"

#include "srf/weights/ulr.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

namespace surflect::slf {

namespace {

using Texture = Vec2<double>; // position in texels: the centre of texel (i, j) is (i, j)

// A chart's triangle with an area.
struct Piece {
  uint32_t meshTriangle;
  std::array<uint32_t, 3> vertices; // of the mesh
  std::array<Texture, 3> corners;
  std::array<Vec3<double>, 3> places;
};

double cross(const Texture& a, const Texture& b) { return a[0] * b[1] - a[1] * b[0]; }

std::vector<Piece> piecesOf(const TriangleMesh& mesh, const Chart& chart) {
  std::vector<Piece> pieces;
  for (size_t t = 0; t < chart.triangles.size(); ++t) {
    Piece piece{chart.meshTriangles[t], {}, {}, {}};
    for (size_t corner = 0; corner < 3; ++corner) {
      const uint32_t v = chart.triangles[t][corner];
      piece.vertices[corner] = chart.vertices[v];
      piece.corners[corner] = {static_cast<double>(chart.coordinates[v][0]) * chart.width - 0.5,
                               static_cast<double>(chart.coordinates[v][1]) * chart.height - 0.5};
      piece.places[corner] = mesh.positions[chart.vertices[v]].raw().cast<double>();
    }
    const auto& [a, b, c] = piece.corners;
    const auto& [p, q, r] = piece.places;
    if (cross(b - a, c - a) != 0 && (q - p).cross(r - p).squaredNorm() > 0) pieces.push_back(piece);
  }
  return pieces;
}

// Barycentrics of a position in the texture.
Vec3<double> barycentrics(const Piece& piece, const Texture& at) {
  const auto& [a, b, c] = piece.corners;
  const double area = cross(b - a, c - a);
  const double second = cross(at - a, c - a) / area, third = cross(b - a, at - a) / area;
  return {1 - second - third, second, third};
}

Point3<AcquisitionSpace, double> placeAt(const Piece& piece, const Vec3<double>& weights) {
  return assume<Point3<AcquisitionSpace, double>>(
      weights[0] * piece.places[0] + weights[1] * piece.places[1] + weights[2] * piece.places[2]);
}

void coverTexels(const Piece& piece, const Chart& chart, std::vector<TexelPoint>& texels) {
  constexpr double kRounding = 1e-4; // of coordinates in single precision
  const auto range = [&](Eigen::Index axis, int size) {
    const auto [low, high] =
        std::minmax({piece.corners[0][axis], piece.corners[1][axis], piece.corners[2][axis]});
    return std::pair(static_cast<int>(std::clamp(std::ceil(low - kRounding), 0.0, size - 1.0)),
                     static_cast<int>(std::clamp(std::floor(high + kRounding), 0.0, size - 1.0)));
  };
  const auto [left, right] = range(0, chart.width);
  const auto [top, bottom] = range(1, chart.height);
  for (int j = top; j <= bottom; ++j)
    for (int i = left; i <= right; ++i) {
      TexelPoint& texel =
          texels[static_cast<size_t>(j) * static_cast<size_t>(chart.width) + static_cast<size_t>(i)];
      if (texel.isInside) continue;
      const Vec3<double> weights = barycentrics(piece, Texture(i, j));
      if (weights.minCoeff() < -kRounding) continue;
      const Vec3<double> clamped = weights.cwiseMax(0);
      texel = {piece.meshTriangle, placeAt(piece, clamped / clamped.sum()), true};
    }
}

// An edge of one piece only.
struct Border {
  size_t piece, corner; // the edge from this corner to the next
};

std::vector<Border> bordersOf(const std::vector<Piece>& pieces) {
  std::map<std::pair<uint32_t, uint32_t>, std::vector<Border>> users;
  for (size_t p = 0; p < pieces.size(); ++p)
    for (size_t corner = 0; corner < 3; ++corner) {
      const auto [a, b] = std::minmax(pieces[p].vertices[corner], pieces[p].vertices[(corner + 1) % 3]);
      users[{a, b}].push_back({p, corner});
    }
  std::vector<Border> borders;
  for (const auto& [edge, those] : users)
    if (those.size() == 1) borders.push_back(those[0]);
  return borders;
}

TexelPoint nearestOnBorder(const std::vector<Piece>& pieces, const std::vector<Border>& borders,
                           const Texture& at) {
  TexelPoint nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [p, corner] : borders) {
    const Piece& piece = pieces[p];
    const size_t next = (corner + 1) % 3;
    const Texture edge = piece.corners[next] - piece.corners[corner];
    const double along =
        edge.squaredNorm() > 0
            ? std::clamp((at - piece.corners[corner]).dot(edge) / edge.squaredNorm(), 0.0, 1.0)
            : 0;
    const double distance = (piece.corners[corner] + along * edge - at).squaredNorm();
    if (!(distance < least)) continue;
    least = distance;
    Vec3<double> weights = Vec3<double>::Zero();
    weights[static_cast<Eigen::Index>(corner)] = 1 - along;
    weights[static_cast<Eigen::Index>(next)] = along;
    nearest = {piece.meshTriangle, placeAt(piece, weights), false};
  }
  return nearest;
}

} // namespace

std::vector<TexelPoint> texelPoints(const TriangleMesh& mesh, const Chart& chart) {
  const std::vector<Piece> pieces = piecesOf(mesh, chart);
  std::vector<TexelPoint> texels(chart.texels());
  for (const Piece& piece : pieces) coverTexels(piece, chart, texels);
  const std::vector<Border> borders = bordersOf(pieces);
  for (size_t texel = 0; texel < texels.size(); ++texel)
    if (!texels[texel].isInside)
      texels[texel] = nearestOnBorder(pieces, borders,
                                      Texture(static_cast<double>(texel % static_cast<size_t>(chart.width)),
                                              static_cast<double>(texel / static_cast<size_t>(chart.width))));
  return texels;
}

namespace {

// Radiance with non-negative channels, as photographs' noise may be below 0.
Vec3<float> notBelowZero(const Vec3<float>& radiance) { return radiance.cwiseMax(0.f); }

// Hat functions at the directions of observations, and the sample directions with any of them.
struct Hats {
  std::vector<HatWeights> at;      // #observations
  std::vector<uint32_t> unknowns;  // sample directions
  std::vector<Eigen::Index> place; // #directions: index into unknowns, or -1
};

Hats hatsAt(std::span<const Observation> observations, const DirectionMesh& directions) {
  Hats hats{{}, {}, std::vector<Eigen::Index>(directions.directions().size(), -1)};
  uint32_t triangle = 0;
  for (const Observation& observation : observations) {
    const HatWeights& weights =
        hats.at.emplace_back(directions.weightsAt(observation.towards.cast<double>(), triangle));
    triangle = weights.triangle;
    for (const uint32_t direction : weights.directions) {
      if (hats.place[direction] >= 0) continue;
      hats.place[direction] = static_cast<Eigen::Index>(hats.unknowns.size());
      hats.unknowns.push_back(direction);
    }
  }
  return hats;
}

} // namespace

std::vector<Vec3<float>> nearestRadiance(std::span<const Observation> observations,
                                         const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  assert(!observations.empty());
  std::vector<Vec3<float>> radiance(isUsed.size(), Vec3<float>::Zero());
  for (size_t i = 0; i < radiance.size(); ++i) {
    if (!isUsed[i]) continue;
    const auto r = directions.directions()[i].cast<float>();
    float least = std::numeric_limits<float>::infinity();
    for (const Observation& observation : observations) {
      const float penalty = weights::anglePenalty(observation.towards, r);
      if (penalty < least) least = penalty, radiance[i] = observation.radiance;
    }
    radiance[i] = notBelowZero(radiance[i]);
  }
  return radiance;
}

std::vector<Vec3<float>> blendedRadiance(std::span<const Observation> observations,
                                         const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  assert(!observations.empty());
  std::vector<Vec3<float>> radiance(isUsed.size(), Vec3<float>::Zero());
  for (size_t i = 0; i < radiance.size(); ++i) {
    if (!isUsed[i]) continue;
    const auto r = directions.directions()[i].cast<float>();
    weights::NearestCandidates nearest(kBlended);
    for (uint32_t v = 0; v < observations.size(); ++v)
      nearest.offer({v, weights::anglePenalty(observations[v].towards, r) / observations[v].fade});
    for (const auto& [v, weight] : weights::ulrWeights(nearest))
      radiance[i] += weight * observations[v].radiance;
    radiance[i] = notBelowZero(radiance[i]);
  }
  return radiance;
}

std::vector<Vec3<float>> fittedRadiance(std::span<const Observation> observations,
                                        const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  std::vector<Vec3<float>> radiance = blendedRadiance(observations, directions, isUsed);
  const Hats hats = hatsAt(observations, directions);
  // Normal equations of the differences F_i - U_i.
  const auto unknowns = static_cast<Eigen::Index>(hats.unknowns.size());
  Eigen::MatrixXd normal = kPrior * Eigen::MatrixXd::Identity(unknowns, unknowns);
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(unknowns, 3);
  for (size_t v = 0; v < observations.size(); ++v) {
    const HatWeights& hat = hats.at[v];
    const double f = static_cast<double>(observations[v].fade);
    Vec3<double> residual = observations[v].radiance.cast<double>();
    for (size_t c = 0; c < 3; ++c) residual -= hat.weights[c] * radiance[hat.directions[c]].cast<double>();
    for (size_t c = 0; c < 3; ++c) {
      const Eigen::Index row = hats.place[hat.directions[c]];
      right.row(row) += f * hat.weights[c] * residual.transpose();
      for (size_t d = 0; d < 3; ++d)
        normal(row, hats.place[hat.directions[d]]) += f * hat.weights[c] * hat.weights[d];
    }
  }
  const Eigen::MatrixX3d difference = normal.llt().solve(right);
  for (Eigen::Index i = 0; i < unknowns; ++i) {
    const uint32_t direction = hats.unknowns[static_cast<size_t>(i)];
    if (isUsed[direction])
      radiance[direction] = notBelowZero(radiance[direction] + difference.row(i).transpose().cast<float>());
  }
  return radiance;
}

std::vector<Vec3<float>> texelRadiance(Blend blend, std::span<const Observation> observations,
                                       const DirectionMesh& directions, std::span<const uint8_t> isUsed) {
  switch (blend) {
  case Blend::nearest:
    return nearestRadiance(observations, directions, isUsed);
  case Blend::ulr:
    return blendedRadiance(observations, directions, isUsed);
  case Blend::fitted:
    break;
  }
  return fittedRadiance(observations, directions, isUsed);
}

} // namespace surflect::slf
