// Measured isotropic materials: files of the MERL BRDF database.
//
// [Matusik 2003] A data-driven reflectance model, SIGGRAPH. A file is three little-endian int32, 90, 90, 180,
// and three planes (red, green, blue) of 90 x 90 x 180 doubles, over theta_h (slowest; finer towards 0),
// theta_d and phi_d (0..180 degrees; the rest by reciprocity), to be scaled by 1/1500, 1.15/1500
// and 1.66/1500. [Rusinkiewicz 1998] A new change of variables for efficient BRDF representation: h half
// vector, d the direction of light in its frame.
#pragma once

#include "render/stage/material/bsdf.h"

#include <filesystem>
#include <vector>

namespace surflect::material {

class MerlTable {
public:
  static constexpr size_t kThetaH = 90, kThetaD = 90, kPhiD = 180;

  // Reads a table of 17 MB. Throws Error naming the file, also for a value that is not finite. Values that
  // were not measured, negative in the files, are black.
  explicit MerlTable(const std::filesystem::path& file);

  // Value f, interpolated between the centres of bins; wi and wo above.
  Rgb at(const ShadingDirection& wi, const ShadingDirection& wo) const;

  // Samples half vectors in proportion to the mean brightness there; density per steradian.
  ShadingDirection halfDirection(double u, double v) const;
  double halfDensity(const ShadingDirection& h) const;

private:
  void makeHalfDensities();

  std::vector<Rgb> values_;           // phi_d runs fastest
  std::vector<double> halfCumulated_; // cumulative distribution over theta_h
};

// Measured material. Files have no energy bound: the tracer may meet weights above 1.
struct Measured {
  using Bsdf = struct MeasuredBsdf;

  const MerlTable* table = nullptr;
};

struct MeasuredBsdf {
  MeasuredBsdf(const Measured& measured, const ShadingDirection& towards)
      : table(measured.table), wo(towards) {}

  const MerlTable* table;
  ShadingDirection wo;
};

Rgb evaluate(const MeasuredBsdf& bsdf, const ShadingDirection& wi);
double pdf(const MeasuredBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const MeasuredBsdf& bsdf, const Uniforms& u);

} // namespace surflect::material
