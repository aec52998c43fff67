#include "srf/planes/normals.h"

#include "srf/planes/light_choice.h"
#include "srf/proxy/relief/photometric.h"

#include <Eigen/SVD>
#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>
#include <numbers>

namespace surflect::planes {

namespace {

constexpr size_t kLightsForNormals = 12;

} // namespace

bool tellNormals(std::span<const Vec3<double>> towardsLights) {
  Eigen::MatrixXd directions(3, static_cast<Eigen::Index>(towardsLights.size()));
  for (size_t l = 0; l < towardsLights.size(); ++l)
    directions.col(static_cast<Eigen::Index>(l)) = towardsLights[l];
  const Eigen::VectorXd values = Eigen::JacobiSVD<Eigen::MatrixXd>(directions).singularValues();
  return values.size() == 3 && values[2] > 0.02 * values[0];
}

Planes normalsOf(const Planes& planes, const Basis& basis, std::span<const Vec3<double>> towardsLights,
                 const Progress& progress) {
  const std::vector<size_t> chosen = farApart(towardsLights, kLightsForNormals);
  const auto count = static_cast<Eigen::Index>(chosen.size()), used = basis.planes();
  std::vector<Vec3<double>> lights;
  Eigen::MatrixXf vectors(3 * count, used);
  Eigen::VectorXf mean(3 * count);
  for (Eigen::Index l = 0; l < count; ++l) {
    const auto from = static_cast<Eigen::Index>(3 * chosen[static_cast<size_t>(l)]);
    lights.push_back(towardsLights[chosen[static_cast<size_t>(l)]]);
    vectors.middleRows<3>(3 * l) = basis.vectors.middleRows<3>(from);
    mean.segment<3>(3 * l) = basis.mean.segment<3>(from);
  }
  Planes normals{planes.width, planes.height, {}};
  normals.values.assign(2, std::vector<float>(planes.pixels()));
  std::atomic<size_t> done = 0;
  std::mutex reporting;
  tbb::parallel_for(size_t{0}, static_cast<size_t>(planes.height), [&](size_t y) {
    const auto width = static_cast<size_t>(planes.width);
    Eigen::VectorXf coefficients(used), shown(3 * count);
    std::vector<Rgb> shares(chosen.size());
    for (size_t i = y * width; i < (y + 1) * width; ++i) {
      for (Eigen::Index k = 0; k < used; ++k) coefficients[k] = planes.values[static_cast<size_t>(k)][i];
      shown = mean;
      shown.noalias() += vectors * coefficients;
      for (size_t l = 0; l < chosen.size(); ++l) {
        const auto part = shown.segment<3>(static_cast<Eigen::Index>(3 * l));
        constexpr auto pi = std::numbers::pi_v<float>;
        shares[l] = {pi * decoded(part[0]), pi * decoded(part[1]), pi * decoded(part[2])};
      }
      const Vec3<double> normal = relief::fitLambert(lights, shares).normal;
      if (!(normal.z() > 0)) continue;
      normals.values[0][i] = static_cast<float>(normal.x());
      normals.values[1][i] = static_cast<float>(normal.y());
    }
    const size_t finished = ++done;
    const std::lock_guard lock(reporting);
    progress("normals", static_cast<double>(finished) / planes.height);
  });
  return normals;
}

} // namespace surflect::planes
