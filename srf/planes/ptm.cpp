#include "srf/planes/ptm.h"

#include "srf/image/color.h"

#include <Eigen/QR>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace surflect::planes {

namespace {

constexpr size_t kTerms = 6;

// Row l: the terms of the polynomial under light l.
Eigen::MatrixXd termsOf(const Stack& stack) {
  Eigen::MatrixXd terms(static_cast<Eigen::Index>(stack.size()), static_cast<Eigen::Index>(kTerms));
  for (size_t l = 0; l < stack.size(); ++l) {
    const double u = stack.towardsLights[l].x(), v = stack.towardsLights[l].y();
    terms.row(static_cast<Eigen::Index>(l)) << u * u, v * v, u * v, u, v, 1;
  }
  return terms;
}

// Stored byte = value / scale + bias, from 0 to 255. [PTM 1.2]
struct TermRange {
  float scale = 1;
  int bias = 0;

  static TermRange of(const std::vector<float>& values) {
    const auto [least, most] = std::ranges::minmax(values);
    TermRange range;
    range.scale =
        std::max({most - std::min(least, 0.f), 1e-3f}) / 254; // a step is spare for rounding the bias
    range.bias = static_cast<int>(std::lround(std::clamp(-least / range.scale, 0.f, 255.f)));
    return range;
  }
  char operator()(float value) const {
    const long stored = std::lround(value / scale) + bias;
    return static_cast<char>(static_cast<uint8_t>(std::clamp(stored, 0L, 255L)));
  }
};

} // namespace

std::string lrgbPtm(const Stack& stack, float white, const Progress& progress) {
  const auto width = static_cast<size_t>(stack.width()), height = static_cast<size_t>(stack.height());
  const Eigen::MatrixXf fit =
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(termsOf(stack)).pseudoInverse().cast<float>();
  // Sums over lights: of each channel, and of the fit to the sum of channels.
  std::array<std::vector<float>, 3> sums;
  std::array<std::vector<float>, kTerms> terms;
  for (std::vector<float>& sum : sums) sum.resize(width * height);
  for (std::vector<float>& term : terms) term.resize(width * height);
  for (size_t l = 0; l < stack.size(); ++l) {
    progress("PTM", static_cast<double>(l) / static_cast<double>(stack.size()));
    const image::Image photograph = readPhotograph(stack, l);
    tbb::parallel_for(size_t{0}, height, [&](size_t y) {
      for (size_t i = y * width; i < (y + 1) * width; ++i) {
        float total = 0;
        for (size_t c = 0; c < 3; ++c) {
          const float value =
              255 * image::srgbFromLinear(std::clamp(photograph.values[3 * i + c] / white, 0.f, 1.f));
          sums[c][i] += value;
          total += value;
        }
        for (size_t t = 0; t < kTerms; ++t)
          terms[t][i] += fit(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(l)) * total;
      }
    });
  }
  // C_c is 1 in the brightest channel; L is then what the polynomial of the sum says, over the sum of C.
  std::vector<std::array<uint8_t, 3>> colors(width * height);
  for (size_t i = 0; i < colors.size(); ++i) {
    const float brightest = std::max({sums[0][i], sums[1][i], sums[2][i], 1e-6f});
    float total = 0;
    for (size_t c = 0; c < 3; ++c) {
      colors[i][c] = static_cast<uint8_t>(std::lround(255 * sums[c][i] / brightest));
      total += static_cast<float>(colors[i][c]) / 255;
    }
    for (std::vector<float>& term : terms) term[i] /= std::max(total, 1.f / 255);
  }
  std::array<TermRange, kTerms> ranges;
  std::string scales, biases;
  for (size_t t = 0; t < kTerms; ++t) {
    ranges[t] = TermRange::of(terms[t]);
    scales += fmt::format("{}{}", t > 0 ? " " : "", ranges[t].scale);
    biases += fmt::format("{}{}", t > 0 ? " " : "", ranges[t].bias);
  }
  std::string file = fmt::format("PTM_1.2\nPTM_FORMAT_LRGB\n{}\n{}\n{}\n{}\n", width, height, scales, biases);
  file.reserve(file.size() + 9 * colors.size());
  for (size_t y = height; y-- > 0;) // from the lowest row up
    for (size_t i = y * width; i < (y + 1) * width; ++i)
      for (size_t t = 0; t < kTerms; ++t) file += ranges[t](terms[t][i]);
  for (size_t y = height; y-- > 0;)
    for (size_t i = y * width; i < (y + 1) * width; ++i)
      for (const uint8_t channel : colors[i]) file += static_cast<char>(channel);
  return file;
}

} // namespace surflect::planes
