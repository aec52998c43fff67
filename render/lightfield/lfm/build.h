// Builds light field maps from views under fixed light.  [Chen 2002, §2, §5]
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/factors.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/vertex_matrix.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace surflect::lfm {

struct BuildOptions {
  Factorization method = Factorization::pca;
  size_t terms = 3;     // of each vertex, at most
  double tolerance = 0; // RMS error, as in relativeErrors(), at which a vertex takes no more terms; 0: all
  int samples = 24;     // along a triangle's edge
  int viewSize = 32;
  Visible visible = Visible::sample;
};

struct BuildReport {
  // Errors of square roots of radiance after 0, 1, ... terms, over all vertices and before quantisation
  std::vector<FactorError> errors;
  size_t photographs = 0, vertices = 0, unseenVertices = 0;
  double white = 1;                // radiance that 99.5 % of the object's pixels do not exceed
  double meanTerms = 0;            // of a vertex
  size_t unseenRows = 0, rows = 0; // of all matrices
  uint64_t resampledBytes = 0, normalizedBytes = 0; // vertex_matrix.h
  std::map<std::string, double> seconds;            // by step; of matrices and factors, summed over threads
};

// RMS errors after 0, 1, ... terms, relative to the square root of white.
std::vector<double> relativeErrors(const BuildReport& report);

// Sizes of matrices and maps.
MapSizes sizesOf(const lightfield::Views& views, const BuildOptions& options);

// Maps of the views' mesh; matrices are made and factorised vertex by vertex. Only training views are read.
// Equal for any number of threads. Throws Error, also for options out of range, and Cancelled.
LightFieldMaps build(const lightfield::Views& views, const BuildOptions& options, BuildReport& report,
                     const Progress& progress = {});

} // namespace surflect::lfm
