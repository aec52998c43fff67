// Factorisation as the appendix has it, plainly, in double precision.
//
// [Chen et al. 2002, Appendix]; symbols as there: F is M x N, U is M x K, V is N x K.
#pragma once

#include <Eigen/Core>

#include <cstdint>

namespace surflect::lfm {

struct ReferenceFactors {
  Eigen::MatrixXd u, v; // F ~ U V'
};

// "PCA Algorithm": power iteration for one term after another, until v changes by less than `convergence`.
// Terms of a residual that is 0 are 0. Maps are not quantised.
ReferenceFactors referencePca(const Eigen::MatrixXd& f, int terms, double convergence = 1e-12);

// "NMF algorithm": `iterations` updates of both factors from both old ones, then of the sums of the columns
// of U. Quotients 0 / 0 are 0.
ReferenceFactors referenceNmf(const Eigen::MatrixXd& f, int terms, int iterations, uint64_t seed = 1);

} // namespace surflect::lfm
