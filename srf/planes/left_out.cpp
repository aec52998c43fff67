#include "srf/planes/left_out.h"

#include "srf/image/color.h"
#include "srf/planes/light_choice.h"
#include "srf/planes/light_interpolation.h"

#include <algorithm>
#include <cmath>

namespace surflect::planes {

namespace {

double decibels(double meanSquare) { return -10 * std::log10(std::max(meanSquare, 1e-12)); }

// Rows of all photographs but one.
Eigen::VectorXi rowsWithout(size_t photographs, size_t leftOut) {
  Eigen::VectorXi rows(static_cast<Eigen::Index>(3 * (photographs - 1)));
  Eigen::Index next = 0;
  for (size_t row = 0; row < 3 * photographs; ++row)
    if (row / 3 != leftOut) rows[next++] = static_cast<int>(row);
  return rows;
}

} // namespace

double Errors::linearDb() const { return decibels(linear); }
double Errors::srgbDb() const { return decibels(srgb); }

std::vector<LeftOutLight> leaveLightsOut(const Stack& stack, const Samples& samples, float white,
                                         Eigen::Index planes, size_t most, const Progress& progress) {
  const Eigen::MatrixXf values = encodedSamples(samples, white);
  const Moments moments = momentsOf(values);
  std::vector<LeftOutLight> results;
  const std::vector<size_t> chosen = withoutPeriod(stack.size(), most);
  for (const size_t leftOut : chosen) {
    progress("left-out lights", static_cast<double>(results.size()) / static_cast<double>(chosen.size()));
    const Eigen::VectorXi rows = rowsWithout(stack.size(), leftOut);
    const Moments others{moments.mean(rows), moments.covariance(rows, rows)};
    const Basis basis = principalBasis(others, planes);
    std::vector<Vec3<double>> lights = stack.towardsLights;
    lights.erase(lights.begin() + static_cast<std::ptrdiff_t>(leftOut));
    const Eigen::VectorXf weights =
        LightInterpolation(lights).weights(stack.towardsLights[leftOut]).cast<float>();
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    Eigen::MatrixXf vectors = Eigen::MatrixXf::Zero(3, basis.planes());
    for (Eigen::Index l = 0; l < weights.size(); ++l) {
      mean += weights[l] * basis.mean.segment<3>(3 * l);
      vectors += weights[l] * basis.vectors.middleRows<3>(3 * l);
    }
    // All samples at once: 3 x (3 #others) is small.
    const Eigen::MatrixXf toLight = vectors * basis.vectors.transpose();
    LeftOutLight& result = results.emplace_back(LeftOutLight{leftOut, {}});
    size_t count = 0;
    Eigen::VectorXf input(rows.size());
    for (Eigen::Index i = 0; i < values.cols(); ++i) {
      if (samples.inside[static_cast<size_t>(i)] == 0) continue;
      for (Eigen::Index r = 0; r < rows.size(); ++r) input[r] = values(rows[r], i) - basis.mean[r];
      const Eigen::Vector3f predicted = mean + toLight * input;
      for (Eigen::Index c = 0; c < 3; ++c) {
        const float got = std::min(decoded(predicted[c]), 1.f);
        const float wanted =
            std::clamp(samples.linear(static_cast<Eigen::Index>(3 * leftOut) + c, i) / white, 0.f, 1.f);
        const auto linear = static_cast<double>(got - wanted);
        const auto srgb = static_cast<double>(image::srgbFromLinear(got) - image::srgbFromLinear(wanted));
        result.errors.linear += linear * linear;
        result.errors.srgb += srgb * srgb;
        ++count;
      }
    }
    const auto total = static_cast<double>(std::max<size_t>(count, 1));
    result.errors.linear /= total;
    result.errors.srgb /= total;
  }
  return results;
}

Errors meanOf(const std::vector<LeftOutLight>& lights) {
  Errors mean;
  for (const LeftOutLight& light : lights) {
    mean.linear += light.errors.linear / static_cast<double>(lights.size());
    mean.srgb += light.errors.srgb / static_cast<double>(lights.size());
  }
  return mean;
}

} // namespace surflect::planes
