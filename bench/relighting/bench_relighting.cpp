// Photographs of lights that were left out, by principal planes, PTM and HSH, all coded as the same kind of
// JPEG.
//
//   bench_relighting CAPTURE [--planes N ...] [--quality Q] [--most N]
//
// [Malzbender 2001] T. Malzbender, D. Gelb, H. Wolters: Polynomial Texture Maps, SIGGRAPH.
// [Gautron 2004] P. Gautron, J. Krivanek, S. Pattanaik, K. Bouatouch: A Novel Hemispherical Basis for
// Accurate and Efficient Rendering, EGSR.

#include "srf/capture/capture.h"
#include "srf/image/color.h"
#include "srf/planes/basis.h"
#include "srf/planes/left_out.h"
#include "srf/planes/light_interpolation.h"
#include "srf/planes/plane_coder.h"
#include "srf/planes/stack.h"
#include "surfel/base/text.h"

#include <CLI/CLI.hpp>
#include <Eigen/QR>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace surflect;
using namespace surflect::planes;
using Matrix = Eigen::MatrixXf;

// Values of a basis of functions of the light's direction.
using LightBasis = std::function<Eigen::VectorXd(const Vec3<double>&)>;

// (lu^2, lv^2, lu lv, lu, lv, 1)  [Malzbender 2001, Eq. 2]
Eigen::VectorXd ptm(const Vec3<double>& l) {
  Eigen::VectorXd p(6);
  p << l.x() * l.x(), l.y() * l.y(), l.x() * l.y(), l.x(), l.y(), 1;
  return p;
}

// Associated Legendre polynomial P_l^m without the Condon-Shortley phase.
double legendre(int l, int m, double x) {
  double pmm = 1;
  for (int i = 1; i <= m; ++i) pmm *= (2 * i - 1) * std::sqrt(std::max(0.0, 1 - x * x));
  if (l == m) return pmm;
  double next = x * (2 * m + 1) * pmm;
  for (int i = m + 2; i <= l; ++i) {
    const double after = (x * (2 * i - 1) * next - (i + m - 1) * pmm) / (i - m);
    pmm = next;
    next = after;
  }
  return next;
}

// H_l^m for l <= order: spherical harmonics of 2 cos(theta) - 1.  [Gautron 2004, Eq. 5]
Eigen::VectorXd hsh(const Vec3<double>& towards, int order) {
  Eigen::VectorXd h((order + 1) * (order + 1));
  const double x = 2 * towards.z() - 1, phi = std::atan2(towards.y(), towards.x());
  Eigen::Index at = 0;
  for (int l = 0; l <= order; ++l)
    for (int m = -l; m <= l; ++m) {
      const int n = std::abs(m);
      const double factorials = std::tgamma(l - n + 1) / std::tgamma(l + n + 1);
      const double k = std::sqrt((2 * l + 1) * factorials / (2 * std::numbers::pi));
      const double turn = m == 0 ? 1 : std::numbers::sqrt2 * (m > 0 ? std::cos(n * phi) : std::sin(n * phi));
      h[at++] = k * turn * legendre(l, n, x);
    }
  return h;
}

// A picture's planes after coding and decoding, and their bytes.
struct Coded {
  Matrix values; // #planes x #pixels
  size_t bytes = 0;
};

Coded coded(const Matrix& planes, int width, int height, int quality, bool sharesSteps) {
  Coded result{Matrix(planes.rows(), planes.cols()), 0};
  std::vector<PlaneRange> ranges;
  for (Eigen::Index k = 0; k < planes.rows(); ++k) {
    const Eigen::VectorXf plane = planes.row(k);
    ranges.push_back(rangeOf({plane.data(), static_cast<size_t>(plane.size())}));
    ranges.back().quality = quality;
  }
  if (sharesSteps) shareSteps(ranges, quality);
  std::vector<uint8_t> grey(static_cast<size_t>(planes.cols()));
  for (Eigen::Index k = 0; k < planes.rows(); ++k) {
    const PlaneRange& range = ranges[static_cast<size_t>(k)];
    for (Eigen::Index i = 0; i < planes.cols(); ++i)
      grey[static_cast<size_t>(i)] = byteOf(range, planes(k, i));
    const std::string jpeg = greyJpeg(grey, width, height, range.quality);
    result.bytes += jpeg.size();
    const std::vector<uint8_t> back = greyOf(jpeg, width, height);
    for (Eigen::Index i = 0; i < planes.cols(); ++i)
      result.values(k, i) = valueOf(range, back[static_cast<size_t>(i)]);
  }
  return result;
}

// Mean squares of a predicted picture, 3 x #pixels in linear light.
Errors errorsOf(const Matrix& predicted, const Samples& samples, size_t photograph, float white) {
  Errors errors;
  size_t count = 0;
  for (Eigen::Index i = 0; i < predicted.cols(); ++i)
    if (samples.inside[static_cast<size_t>(i)] != 0)
      for (Eigen::Index c = 0; c < 3; ++c, ++count) {
        const float got = std::clamp(predicted(c, i), 0.f, 1.f);
        const float wanted =
            std::clamp(samples.linear(static_cast<Eigen::Index>(3 * photograph) + c, i) / white, 0.f, 1.f);
        const auto linear = static_cast<double>(got - wanted);
        const auto srgb = static_cast<double>(image::srgbFromLinear(got) - image::srgbFromLinear(wanted));
        errors.linear += linear * linear;
        errors.srgb += srgb * srgb;
      }
  errors.linear /= static_cast<double>(count);
  errors.srgb /= static_cast<double>(count);
  return errors;
}

struct Scene {
  const Stack& stack;
  const Samples& samples; // all pixels
  Matrix encoded;         // 3 #photographs x #pixels
  Moments moments;
  float white;
  int quality;
  size_t most; // lights left out
};

struct Result {
  Errors errors;
  double bytes = 0;
};

struct Prediction {
  Matrix linear; // 3 x #pixels
  size_t bytes = 0;
};

std::vector<size_t> without(size_t count, size_t leftOut) {
  std::vector<size_t> kept;
  for (size_t l = 0; l < count; ++l)
    if (l != leftOut) kept.push_back(l);
  return kept;
}

Eigen::VectorXi rowsOf(const std::vector<size_t>& photographs) {
  Eigen::VectorXi rows(static_cast<Eigen::Index>(3 * photographs.size()));
  for (size_t i = 0; i < photographs.size(); ++i)
    for (size_t c = 0; c < 3; ++c)
      rows[static_cast<Eigen::Index>(3 * i + c)] = static_cast<int>(3 * photographs[i] + c);
  return rows;
}

std::vector<Vec3<double>> directionsOf(const Stack& stack, const std::vector<size_t>& photographs) {
  std::vector<Vec3<double>> directions;
  for (const size_t p : photographs) directions.push_back(stack.towardsLights[p]);
  return directions;
}

Prediction byPlanes(const Scene& scene, size_t leftOut, Eigen::Index count) {
  const std::vector<size_t> kept = without(scene.stack.size(), leftOut);
  const Eigen::VectorXi rows = rowsOf(kept);
  const Basis basis = principalBasis({scene.moments.mean(rows), scene.moments.covariance(rows, rows)}, count);
  const Matrix planes = basis.vectors.transpose() * (scene.encoded(rows, Eigen::all).colwise() - basis.mean);
  const Coded stored = coded(planes, scene.stack.width(), scene.stack.height(), scene.quality, true);
  const Eigen::VectorXf weights = LightInterpolation(directionsOf(scene.stack, kept))
                                      .weights(scene.stack.towardsLights[leftOut])
                                      .cast<float>();
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  Matrix vectors = Matrix::Zero(3, basis.planes());
  for (Eigen::Index l = 0; l < weights.size(); ++l) {
    mean += weights[l] * basis.mean.segment<3>(3 * l);
    vectors += weights[l] * basis.vectors.middleRows<3>(3 * l);
  }
  const Matrix predicted = (vectors * stored.values).colwise() + mean;
  return {predicted.unaryExpr([](float v) { return decoded(v); }), stored.bytes};
}

// Ridge regression of each pixel and channel over a basis, of linear or of encoded values. `ridge` is
// relative to the number of lights; it keeps bases of more functions than lights from swinging between them.
Prediction byFit(const Scene& scene, size_t leftOut, const LightBasis& functions, bool isEncoded,
                 double ridge) {
  const std::vector<size_t> kept = without(scene.stack.size(), leftOut);
  const std::vector<Vec3<double>> directions = directionsOf(scene.stack, kept);
  const Eigen::VectorXd now = functions(scene.stack.towardsLights[leftOut]);
  Eigen::MatrixXd design(static_cast<Eigen::Index>(kept.size()), now.size());
  for (size_t l = 0; l < kept.size(); ++l)
    design.row(static_cast<Eigen::Index>(l)) = functions(directions[l]).transpose();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(now.size(), now.size());
  const Eigen::MatrixXd normal =
      design.transpose() * design + ridge * static_cast<double>(kept.size()) * identity;
  const Matrix fit = normal.ldlt().solve(design.transpose()).cast<float>();
  Prediction prediction{Matrix(3, scene.encoded.cols()), 0};
  for (size_t c = 0; c < 3; ++c) {
    Matrix values(static_cast<Eigen::Index>(kept.size()), scene.encoded.cols());
    for (size_t l = 0; l < kept.size(); ++l) {
      const auto row = static_cast<Eigen::Index>(3 * kept[l] + c);
      if (isEncoded)
        values.row(static_cast<Eigen::Index>(l)) = scene.encoded.row(row);
      else
        values.row(static_cast<Eigen::Index>(l)) =
            (scene.samples.linear.row(row) / scene.white).cwiseMin(1.f);
    }
    const Coded stored = coded(fit * values, scene.stack.width(), scene.stack.height(), scene.quality, false);
    prediction.bytes += stored.bytes;
    const Eigen::RowVectorXf found = now.cast<float>().transpose() * stored.values;
    prediction.linear.row(static_cast<Eigen::Index>(c)) =
        isEncoded ? Eigen::RowVectorXf(found.unaryExpr([](float v) { return decoded(v); })) : found;
  }
  return prediction;
}

// LRGB PTM: one polynomial of luma, times a colour that no light changes.  [Malzbender 2001, §3.1]
Prediction byLrgbPtm(const Scene& scene, size_t leftOut) {
  const std::vector<size_t> kept = without(scene.stack.size(), leftOut);
  const std::vector<Vec3<double>> directions = directionsOf(scene.stack, kept);
  const auto lights = static_cast<Eigen::Index>(kept.size());
  Eigen::MatrixXd design(lights, 6);
  Matrix luma(lights, scene.encoded.cols()), color = Matrix::Zero(3, scene.encoded.cols());
  for (Eigen::Index l = 0; l < lights; ++l) {
    design.row(l) = ptm(directions[static_cast<size_t>(l)]).transpose();
    const Matrix rgb =
        (scene.samples.linear.middleRows<3>(static_cast<Eigen::Index>(3 * kept[static_cast<size_t>(l)])) /
         scene.white)
            .cwiseMin(1.f);
    luma.row(l) = 0.2126f * rgb.row(0) + 0.7152f * rgb.row(1) + 0.0722f * rgb.row(2);
    color += rgb;
  }
  const Eigen::RowVectorXf sum = luma.colwise().sum().cwiseMax(1e-6f);
  for (Eigen::Index c = 0; c < 3; ++c) color.row(c) = color.row(c).cwiseQuotient(sum);
  const Matrix fit =
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(design).pseudoInverse().cast<float>();
  const Coded polynomial = coded(fit * luma, scene.stack.width(), scene.stack.height(), scene.quality, false);
  const Coded colors = coded(color, scene.stack.width(), scene.stack.height(), scene.quality, false);
  const Eigen::RowVectorXf found =
      ptm(scene.stack.towardsLights[leftOut]).cast<float>().transpose() * polynomial.values;
  return {colors.values.cwiseProduct(found.replicate(3, 1)), polynomial.bytes + colors.bytes};
}

Result measured(const Scene& scene, const std::function<Prediction(size_t)>& predict) {
  Result result;
  const std::vector<size_t> chosen = evenlySpaced(scene.stack.size(), scene.most);
  const auto count = static_cast<double>(chosen.size());
  for (const size_t leftOut : chosen) {
    const Prediction prediction = predict(leftOut);
    const Errors errors = errorsOf(prediction.linear, scene.samples, leftOut, scene.white);
    result.errors.linear += errors.linear / count;
    result.errors.srgb += errors.srgb / count;
    result.bytes += static_cast<double>(prediction.bytes) / count;
  }
  return result;
}

} // namespace

int main(int argc, char** argv) {
  CLI::App app("Photographs of lights that were left out, by principal planes, PTM and HSH.");
  std::string path;
  std::vector<int> planes{4, 6, 9, 12};
  int quality = 90;
  size_t most = 12;
  app.add_option("capture", path)->required();
  app.add_option("--planes", planes);
  app.add_option("--quality", quality);
  app.add_option("--most", most, "lights left out, one after another, at most");
  CLI11_PARSE(app, argc, argv);
  try {
    const Stack stack = stackOf(capture::readCapture(path));
    const Samples samples = sample(stack, stack.pixels(), {});
    const float white = whiteOf(samples, 0.995);
    const Matrix values = encodedSamples(samples, white);
    const Scene scene{stack, samples, values, momentsOf(values), white, quality, most};
    nlohmann::ordered_json report = {
        {"lights", stack.size()}, {"width", stack.width()}, {"height", stack.height()}};
    const auto add = [&](const std::string& name, const std::function<Prediction(size_t)>& predict) {
      const Result result = measured(scene, predict);
      report["methods"][name] = {{"bytes", result.bytes},
                                 {"psnr_linear_db", result.errors.linearDb()},
                                 {"psnr_srgb_db", result.errors.srgbDb()}};
      fmt::print(stderr, "{:24} {:9.0f} bytes  {:6.2f} dB linear  {:6.2f} dB sRGB\n", name, result.bytes,
                 result.errors.linearDb(), result.errors.srgbDb());
    };
    for (const int count : planes)
      add(fmt::format("{} planes", count), [&](size_t leftOut) { return byPlanes(scene, leftOut, count); });
    add("PTM, LRGB", [&](size_t leftOut) { return byLrgbPtm(scene, leftOut); });
    for (const bool isEncoded : {false, true}) {
      const std::string space = isEncoded ? ", encoded" : "";
      add("PTM, RGB" + space, [&](size_t leftOut) { return byFit(scene, leftOut, ptm, isEncoded, 1e-6); });
      for (const int order : {2, 3})
        for (const double ridge : {1e-3, 1e-2})
          add(fmt::format("HSH {}{}, ridge {}", order, space, ridge), [&](size_t leftOut) {
            return byFit(
                scene, leftOut, [&](const Vec3<double>& l) { return hsh(l, order); }, isEncoded, ridge);
          });
    }
    fmt::print("{}\n", report.dump(2));
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
