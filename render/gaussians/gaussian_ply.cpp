#include "render/gaussians/gaussian_ply.h"

#include "surfel/base/file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

namespace surflect::gaussians {

namespace {

std::string plyHeader(size_t gaussians, int degree, std::string_view comment) {
  std::string header = fmt::format("ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n",
                                   comment, gaussians);
  for (const std::string& field : plyFields(degree)) header += "property float " + field + "\n";
  return header + "end_header\n";
}

// Inverse of the logistic function, finite also for 0 and 1.
double logit(double opacity) {
  const double inside = std::clamp(opacity, 1e-6, 1 - 1e-6);
  return std::log(inside / (1 - inside));
}

} // namespace

std::vector<std::string> plyFields(int degree) {
  std::vector<std::string> fields{"x", "y", "z", "nx", "ny", "nz"};
  const auto add = [&](const char* name, size_t count) {
    for (size_t i = 0; i < count; ++i) fields.push_back(fmt::format("{}_{}", name, i));
  };
  add("f_dc", 3);
  add("f_rest", 3 * (coefficientsOf(degree) - 1));
  fields.push_back("opacity");
  add("scale", 3);
  add("rot", 4);
  return fields;
}

std::vector<float> plyValues(const Shape& shape, const Look& look, int degree) {
  std::vector<float> values;
  for (const Vec3<float>& vector : {shape.center, shape.normal})
    values.insert(values.end(), vector.begin(), vector.end());
  for (const double constant : look.color[0])
    values.push_back(static_cast<float>(constant - 0.5 / kConstantHarmonic));
  for (size_t channel = 0; channel < 3; ++channel)
    for (size_t j = 1; j < coefficientsOf(degree); ++j)
      values.push_back(static_cast<float>(look.color[j][channel]));
  values.push_back(static_cast<float>(logit(look.opacity)));
  for (const float scale : shape.scale)
    values.push_back(std::log(std::max(scale, std::numeric_limits<float>::min())));
  values.insert(values.end(), shape.rotation.begin(), shape.rotation.end());
  return values;
}

uint64_t plyBytes(size_t gaussians, int degree, std::string_view comment) {
  return plyHeader(gaussians, degree, comment).size() + sizeof(float) * gaussians * plyFields(degree).size();
}

void writeGaussianPly(const std::filesystem::path& path, const Gaussians& gaussians, int degree,
                      std::string_view comment, const Progress& progress) {
  static_assert(std::endian::native == std::endian::little);
  AtomicFile file(path);
  file.write(plyHeader(gaussians.size(), degree, comment));
  std::vector<float> rows;
  const size_t parts = (gaussians.size() + kAtOnce - 1) / kAtOnce;
  for (size_t part = 0; part < parts; ++part) {
    const size_t begin = part * kAtOnce, end = std::min(gaussians.size(), begin + kAtOnce);
    const std::vector<Look> looks =
        gaussians.looks(begin, end, degree, stepOf(progress, kStage, part, parts));
    rows.clear();
    for (size_t i = begin; i < end; ++i) {
      const std::vector<float> row = plyValues(gaussians.shape(i), looks[i - begin], degree);
      rows.insert(rows.end(), row.begin(), row.end());
    }
    file.write(std::as_bytes(std::span(rows)));
  }
  file.commit();
}

} // namespace surflect::gaussians
