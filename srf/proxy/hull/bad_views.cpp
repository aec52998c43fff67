#include "srf/proxy/hull/bad_views.h"

#include "srf/proxy/hull/bounds.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace surflect::hull {

namespace {

constexpr int kCells = 64; // across the box
constexpr double kShareOfSilhouette = 0.005;
constexpr size_t kWitnesses = 2;

using Bits = std::vector<uint64_t>; // one bit per view; sets may be concatenated
size_t wordsFor(size_t views) { return (views + 63) / 64; }
bool has(std::span<const uint64_t> set, size_t view) { return set[view / 64] >> (view % 64) & 1; }
void insert(std::span<uint64_t> set, size_t view) { set[view / 64] |= uint64_t{1} << (view % 64); }

size_t commonCount(std::span<const uint64_t> a, std::span<const uint64_t> b) {
  size_t count = 0;
  for (size_t w = 0; w < a.size(); ++w) count += static_cast<size_t>(std::popcount(a[w] & b[w]));
  return count;
}

// Cells that may belong to the object, with the views that vote against each.
struct Ballot {
  double radius = 0; // of the ball around a cell
  size_t words = 0;
  std::vector<Point3<AcquisitionSpace, double>> centers;
  Bits against;

  size_t size() const { return centers.size(); }
  std::span<const uint64_t> opponents(size_t i) const { return {against.data() + i * words, words}; }
};

Ballot voteOnCells(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                   const Eigen::AlignedBox3d& box, const Progress& progress) {
  const auto cubes = possibleCubes(silhouetteViews, quorum, box, kCells, true, progress);
  Ballot all;
  all.words = wordsFor(silhouetteViews.size());
  all.against.resize(cubes.size() * all.words);
  for (const Cube& cube : cubes) {
    all.radius = cube.ball().radius; // equal for all cells
    all.centers.push_back(cube.ball().center);
  }
  tbb::parallel_for(size_t{0}, cubes.size(), [&](size_t i) {
    const std::span<uint64_t> against(all.against.data() + i * all.words, all.words);
    for (size_t view = 0; view < silhouetteViews.size(); ++view)
      if (voteOn(silhouetteViews[view], cubes[i].ball()).outside) insert(against, view);
  });
  return all;
}

// Picture of one view, in cells as large as those in space.
class Witness {
public:
  Witness(const SilhouetteView& silhouetteView, const Ballot& ballot)
      : sight_(silhouetteView), words_(ballot.words) {
    std::vector<double> footprints;
    for (const auto& center : ballot.centers)
      if (const double here = pixelFootprint(silhouetteView.camera, center); here > 0)
        footprints.push_back(here);
    if (!footprints.empty()) {
      const auto middle = footprints.begin() + static_cast<std::ptrdiff_t>(footprints.size() / 2);
      std::ranges::nth_element(footprints, middle);
      cell_ = std::max(1.0, ballot.radius / std::sqrt(0.75) / *middle);
    }
    width_ = static_cast<int>(std::ceil(silhouetteView.outline.width() / cell_));
    height_ = static_cast<int>(std::ceil(silhouetteView.outline.height() / cell_));
  }

  // For every view, the share of this silhouette that it is blamed for, among the remaining views.
  std::vector<double> blame(size_t self, const Ballot& ballot, std::span<const uint64_t> taking) const {
    const size_t cells = static_cast<size_t>(width_) * static_cast<size_t>(height_);
    std::vector<uint32_t> fewest(cells, std::numeric_limits<uint32_t>::max());
    Bits opponents(cells * words_);
    for (size_t i = 0; i < ballot.size(); ++i) {
      const auto against = ballot.opponents(i);
      if (has(against, self)) continue;
      const auto votes = static_cast<uint32_t>(commonCount(against, taking));
      forCellsOf({ballot.centers[i], ballot.radius}, [&](size_t cell) {
        const std::span<uint64_t> known(opponents.data() + cell * words_, words_);
        if (votes > fewest[cell]) return;
        if (votes < fewest[cell]) std::ranges::fill(known, 0);
        fewest[cell] = votes;
        for (size_t w = 0; w < words_; ++w) known[w] |= against[w] & taking[w];
      });
    }
    std::vector<double> shares(words_ * 64, 0);
    double silhouette = 0;
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const capture::Pixel center{(x + 0.5) * cell_, (y + 0.5) * cell_};
        if (!capture::contains(sight_.camera.lens, center)) continue;
        if (!(sight_.outline.signedDistance(center) > 0.75 * cell_)) continue; // the whole cell is inside
        ++silhouette;
        const size_t cell = static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
        if (fewest[cell] == 0 || fewest[cell] == std::numeric_limits<uint32_t>::max()) continue;
        const std::span<const uint64_t> blamed(opponents.data() + cell * words_, words_);
        for (size_t view = 0; view < shares.size(); ++view)
          if (has(blamed, view)) shares[view] += 1.0 / fewest[cell];
      }
    for (double& share : shares) share /= std::max(silhouette, 1.0);
    return shares;
  }

private:
  // Calls use() for the cells whose centre may show a point of the ball.
  template <class Use> void forCellsOf(const Ball& ball, const Use& use) const {
    const auto pixel = sight_.camera.project(ball.center);
    const double reach = projectedRadius(sight_.camera, ball) / cell_;
    if (!pixel || !std::isfinite(reach)) return;
    const double x = pixel->x / cell_ - 0.5, y = pixel->y / cell_ - 0.5;
    const auto index = [](double value, int size) {
      return static_cast<int>(std::clamp(value, -1.0, static_cast<double>(size)));
    };
    const int x1 = std::min(index(std::floor(x + reach), width_), width_ - 1),
              y1 = std::min(index(std::floor(y + reach), height_), height_ - 1);
    for (int row = std::max(index(std::ceil(y - reach), height_), 0); row <= y1; ++row)
      for (int column = std::max(index(std::ceil(x - reach), width_), 0); column <= x1; ++column)
        if (std::hypot(column - x, row - y) <= reach)
          use(static_cast<size_t>(row) * static_cast<size_t>(width_) + static_cast<size_t>(column));
  }

  const SilhouetteView& sight_;
  size_t words_;
  double cell_ = 1; // pixels
  int width_ = 0, height_ = 0;
};

// The most blamed view, if it is bad.
std::optional<size_t> worstView(std::span<const Witness> witnesses, const Ballot& ballot,
                                std::span<const uint64_t> taking) {
  const size_t views = witnesses.size();
  std::vector<std::vector<double>> shares(views);
  tbb::parallel_for(size_t{0}, views, [&](size_t view) {
    if (has(taking, view)) shares[view] = witnesses[view].blame(view, ballot, taking);
  });
  std::optional<size_t> worst;
  double most = 0;
  for (size_t view = 0; view < views; ++view) {
    size_t blaming = 0;
    double sum = 0;
    for (const auto& share : shares) {
      if (share.empty()) continue;
      blaming += share[view] >= kShareOfSilhouette;
      sum += share[view];
    }
    if (blaming < kWitnesses || sum <= most) continue;
    most = sum;
    worst = view;
  }
  return worst;
}

} // namespace

std::vector<size_t> badViews(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                             const Eigen::AlignedBox3d& box, const Progress& progress) {
  const Ballot ballot = voteOnCells(silhouetteViews, quorum, box, progress);
  std::vector<Witness> witnesses;
  Bits taking(ballot.words);
  for (size_t view = 0; view < silhouetteViews.size(); ++view) {
    witnesses.emplace_back(silhouetteViews[view], ballot);
    insert(taking, view);
  }
  std::vector<size_t> bad;
  while (bad.size() < allowedDissent(silhouetteViews.size())) {
    progress.checkpoint();
    const auto worst = worstView(witnesses, ballot, taking);
    if (!worst) break;
    bad.push_back(*worst);
    taking[*worst / 64] &= ~(uint64_t{1} << (*worst % 64));
  }
  std::ranges::sort(bad);
  return bad;
}

} // namespace surflect::hull
