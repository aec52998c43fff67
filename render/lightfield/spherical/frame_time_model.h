// Time of a frame from its work, fitted while frames are drawn.
//
// [Domingo 2007, §4.2]   t = t_main N_main + t_gpu N_gpu + t_disk N_disk + t_setup(level)
// Symbols: N_gpu triangles drawn, N_main images brought to the GPU, N_disk images read that the frame waited
// for. In the paper N counts triangles by the place of their images; nearly each has an image of its own.
//
// t_setup has a value for each level, one for each pair of levels that are blended, and all of these again
// for each mip level by which images are coarser. A setup that has never been measured is predicted as those
// beside it. Times are fitted by least squares of relative errors. Older frames count less; a weak pull
// towards the start values keeps times that no frame determines.
#pragma once

#include "render/lightfield/spherical/player.h"

#include <Eigen/Core>

#include <cstddef>

namespace surflect::spherical {

// Seconds: for a triangle, an image from main memory to the GPU, an image from disk, and any frame.
struct FrameTimes {
  double gpu = 1e-5, main = 1e-3, disk = 1e-2, setup = 5e-3;
};

// Level of detail that is chosen by its time.
struct Detail {
  double level = 0; // directional: as Look::detail
  int coarser = 0;  // positional: as Look::coarser, 0..kMostCoarser
  friend auto operator<=>(const Detail&, const Detail&) = default;
};
inline constexpr int kMostCoarser = 2;

class FrameTimeModel {
public:
  // All start values are positive.
  FrameTimeModel(size_t levels, const FrameTimes& start);

  // Predicted seconds of a frame.
  double predict(const FrameCounts& counts, const Detail& detail) const;
  // Adds a measured frame; its seconds are positive.
  void add(const FrameCounts& counts, const Detail& detail, double seconds);

  // Fitted times; the setup is that of the given level of detail.
  FrameTimes times(const Detail& detail) const;

private:
  Eigen::Index setupOf(const Detail& detail) const;
  Eigen::VectorXd rowOf(const FrameCounts& counts, const Detail& detail) const;
  void fit();

  Eigen::Index setups_; // without coarser mip levels
  // Unknowns are gpu, main, disk and the setups, relative to their start values.
  Eigen::VectorXd start_, fitted_;
  Eigen::MatrixXd squares_;  // sum of row row^T
  Eigen::VectorXd products_; // sum of row times target
};

} // namespace surflect::spherical
