#include "render/surfels/pixel_frame.h"

#include "render/surfels/aovs.h"
#include "render/surfels/queries.h"
#include "srf/shading/plan.h"
#include "warp/deform.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <string_view>

namespace surflect::surfels {

namespace {

using codec::blockSize;

constexpr size_t kBlockRowsAtOnce = 16; // of the relit picture
constexpr int kBandRows = 16;           // of the frame

// A corner of the grid on the screen.
struct ScreenCorner {
  double x = 0, y = 0;   // pixels
  double depth = 0;      // along the viewing axis
  double inverse = 0;    // 1 / depth for a pinhole camera, else 1
  double projective = 0; // weight of the place in the photograph: depth in the view's camera times `inverse`
  bool isDrawn = false;
};

double axialDepth(const capture::Lens& lens, double z) {
  return lens.model == capture::Lens::Model::pinhole ? -z : 1;
}

std::vector<ScreenCorner> cornersOnScreen(const weights::ReflectanceField& field,
                                          const DeformedCloud& deformed,
                                          const capture::Camera<ObjectSpace>& camera, FrameStats& stats) {
  const capture::Camera<AcquisitionSpace>& own = field.rig.views[0].camera;
  std::vector<ScreenCorner> corners(deformed.size());
  tbb::parallel_for(size_t{0}, corners.size(), [&](size_t i) {
    if (deformed.handedness[i] == Handedness::dead) return;
    const auto p = camera.cameraFromWorld(deformed.p[i].cast<double>());
    const auto pixel = capture::project(camera.lens, p);
    if (!pixel || !std::isfinite(pixel->x) || !std::isfinite(pixel->y)) return;
    const double rest = axialDepth(own.lens, own.cameraFromWorld(field.cloud.p0[i].cast<double>()).z());
    const double inverse = 1 / axialDepth(camera.lens, p.z());
    if (!(rest > 0)) return;
    corners[i] = {pixel->x, pixel->y, -p.z(), inverse, rest * inverse, true};
  });
  for (const Handedness handedness : deformed.handedness) stats.splats.dead += handedness == Handedness::dead;
  return corners;
}

// A square of the grid: its corners are those at its column and row, and at the next ones.
struct Squares {
  const weights::PixelGrid& grid;
  int across() const { return grid.columns - 1; }
  int down() const { return grid.rows - 1; }
  size_t count() const { return static_cast<size_t>(across()) * static_cast<size_t>(down()); }
  uint32_t number(int column, int row) const { return static_cast<uint32_t>(row * across() + column); }
  int columnOf(uint32_t square) const { return static_cast<int>(square) % across(); }
  int rowOf(uint32_t square) const { return static_cast<int>(square) / across(); }
  // Upper left, upper right, lower right, lower left.
  std::array<size_t, 4> corners(uint32_t square) const {
    const size_t first = grid.corner(columnOf(square), rowOf(square)),
                 below = first + static_cast<size_t>(grid.columns);
    return {first, first + 1, below + 1, below};
  }
};

double twiceArea(const ScreenCorner& a, const ScreenCorner& b, const ScreenCorner& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Squares that may be seen, by bands of rows of the frame, each in the order of the grid.
struct Visible {
  std::vector<size_t> first; // per band, then the end
  std::vector<uint32_t> squares;
  std::vector<uint8_t> needsBlock; // per block of the view
  int finest = 0;                  // least halvings of the picture that a square is drawn from
};

// Halvings at which a pixel of the picture is as large as one of the frame.
float levelOf(double texels, double pixels) {
  constexpr double kAlike = 1.05; // in area: rounding
  return pixels * kAlike >= texels ? 0.f : static_cast<float>(0.5 * std::log2(texels / pixels));
}

constexpr int kMostHalvings = 3; // within a block

Visible visibleSquares(const weights::ReflectanceField& field, std::span<const ScreenCorner> corners,
                       const DeformedCloud& deformed, const capture::Lens& lens, FrameStats& stats,
                       const Progress& progress) {
  const Squares squares{*field.grid};
  const codec::ViewHeader& view = field.files[0].header();
  const double texels = 1.0 * field.grid->step * field.grid->step;
  const int bands = (lens.height + kBandRows - 1) / kBandRows;
  struct Extent {
    int begin = 0, end = 0; // bands
  };
  std::vector<Extent> extents(squares.count());
  std::vector<float> levels(static_cast<size_t>(squares.down()), std::numeric_limits<float>::infinity());
  std::vector<size_t> back(levels.size()), outside(levels.size());
  tbb::parallel_for(0, squares.down(), [&](int row) {
    progress.checkpoint();
    for (int column = 0; column < squares.across(); ++column) {
      const uint32_t square = squares.number(column, row);
      const auto [a, b, c, d] = squares.corners(square);
      const ScreenCorner &ca = corners[a], &cb = corners[b], &cc = corners[c], &cd = corners[d];
      if (!ca.isDrawn || !cb.isDrawn || !cc.isDrawn || !cd.isDrawn) continue;
      const double side = deformed.handedness[a] == Handedness::mirrored ? -1 : 1;
      const double first = side * twiceArea(ca, cb, cc), second = side * twiceArea(ca, cc, cd);
      if (!(first > 0) && !(second > 0)) {
        ++back[static_cast<size_t>(row)];
        continue;
      }
      const auto [left, right] = std::minmax({ca.x, cb.x, cc.x, cd.x});
      const auto [top, bottom] = std::minmax({ca.y, cb.y, cc.y, cd.y});
      if (!(right > 0.5 && left < lens.width - 0.5 && bottom > 0.5 && top < lens.height - 0.5)) {
        ++outside[static_cast<size_t>(row)];
        continue;
      }
      extents[square] = {std::max(0, static_cast<int>(std::floor(top - 1)) / kBandRows),
                         std::min(bands, static_cast<int>(bottom + 1) / kBandRows + 1)};
      float& least = levels[static_cast<size_t>(row)];
      least = std::min(least, levelOf(texels, (std::max(first, 0.0) + std::max(second, 0.0)) / 2));
    }
  });
  Visible visible;
  visible.needsBlock.resize(view.cells());
  visible.first.assign(static_cast<size_t>(bands) + 1, 0);
  const int perBlock = blockSize / field.grid->step;
  for (uint32_t square = 0; square < extents.size(); ++square) {
    const auto [begin, end] = extents[square];
    for (int band = begin; band < end; ++band) ++visible.first[static_cast<size_t>(band) + 1];
    if (begin == end) continue;
    ++stats.splats.drawn;
    // The neighbours of its block too, from which pixels at the border are interpolated.
    const int x = squares.columnOf(square) / perBlock, y = squares.rowOf(square) / perBlock;
    for (int j = std::max(0, y - 1); j <= std::min(view.blocksDown() - 1, y + 1); ++j)
      for (int i = std::max(0, x - 1); i <= std::min(view.blocksAcross() - 1, x + 1); ++i)
        visible.needsBlock[static_cast<size_t>(j) * static_cast<size_t>(view.blocksAcross()) +
                           static_cast<size_t>(i)] = 1;
  }
  for (size_t band = 0; band + 1 < visible.first.size(); ++band)
    visible.first[band + 1] += visible.first[band];
  visible.squares.resize(visible.first.back());
  std::vector<size_t> next(visible.first.begin(), visible.first.end() - 1);
  for (uint32_t square = 0; square < extents.size(); ++square)
    for (int band = extents[square].begin; band < extents[square].end; ++band)
      visible.squares[next[static_cast<size_t>(band)]++] = square;
  for (const size_t count : back) stats.splats.backFacing += count;
  for (const size_t count : outside) stats.splats.outside += count;
  const float least = *std::ranges::min_element(levels);
  visible.finest = std::isfinite(least) ? std::min(kMostHalvings, static_cast<int>(least)) : 0;
  return visible;
}

// Light rows at corners: what the planner answers for some rows of the grid.
class CornerRows {
public:
  CornerRows(const weights::ReflectanceField& field, const LitScene& lit, const DeformedCloud& tangents,
             const weights::ShadeOptions& options, const Progress& progress)
      : field_(field), lit_(lit), tangents_(tangents), progress_(progress),
        planOf_(field.cloud.size(), kNone), cameraBlend(options.showsBlends ? field.cloud.size() : 0),
        lightBlend(cameraBlend.size()) {
    write({});
    planner_.emplace(field, batch_, options);
  }

  // Asks for corners, ascending; earlier answers are forgotten.
  void ask(std::vector<uint32_t> corners, FrameStats& stats) {
    for (const uint32_t corner : asked_) planOf_[corner] = kNone;
    asked_ = std::move(corners);
    write(asked_);
    const size_t step = planner_->queriesPerPlan(), count = (asked_.size() + step - 1) / step;
    if (plans_.size() < count) plans_.resize(count);
    tbb::parallel_for(size_t{0}, count, [&](size_t i) {
      progress_.checkpoint();
      const size_t begin = i * step, end = std::min(asked_.size(), begin + step);
      Plan& made = plans_[i];
      planner_->plan(begin, end, made.plan);
      std::ranges::stable_sort(made.plan.ops, {}, &shading::ShadingOp::target);
      made.first.assign(end - begin + 1, 0);
      for (const shading::ShadingOp& op : made.plan.ops)
        ++made.first[op.target / made.plan.targetsPerPlace + 1];
      for (size_t place = 0; place < end - begin; ++place) {
        made.first[place + 1] += made.first[place];
        planOf_[asked_[begin + place]] = static_cast<uint32_t>(begin + place);
        if (cameraBlend.empty()) continue;
        cameraBlend[asked_[begin + place]] = made.plan.cameraBlend[place];
        lightBlend[asked_[begin + place]] = made.plan.lightBlend[place];
      }
    });
    stats.queries += asked_.size();
  }

  bool isKnown(size_t corner) const { return planOf_[corner] != kNone; }

  // Whether two corners have the same weights.
  bool isSame(size_t corner, size_t other) const {
    const auto [ops, rows] = rowsAt(corner);
    const auto [otherOps, otherRows] = rowsAt(other);
    if (ops.size() != otherOps.size()) return false;
    for (size_t i = 0; i < ops.size(); ++i)
      if (ops[i].weight != otherOps[i].weight ||
          !sameLights(*rows, ops[i].rowBegin, ops[i].rowEnd, *otherRows, otherOps[i].rowBegin,
                      otherOps[i].rowEnd))
        return false;
    return true;
  }

  // Coefficients of a block's terms under the corner's lights: red, green and blue, terms.stride of each.
  void coefficientsAt(size_t corner, const codec::BlockTerms& terms, float* to,
                      std::vector<float>& scratch) const {
    const auto stride = static_cast<size_t>(terms.stride);
    std::fill_n(to, 3 * stride, 0.f);
    scratch.resize(stride);
    const auto [ops, rows] = rowsAt(corner);
    for (const shading::ShadingOp& op : ops)
      for (uint32_t l = op.rowBegin; l < op.rowEnd; ++l) {
        const weights::BlendedLight& light = rows->lights[l];
        std::ranges::fill(scratch, 0.f);
        for (uint32_t w = light.begin; w < light.end; ++w) {
          const auto [column, weight] = rows->weights[w];
          const float* const of = terms.light(column);
          const float factor = op.weight * weight;
          for (size_t k = 0; k < stride; ++k) scratch[k] += factor * of[k];
        }
        for (size_t c = 0; c < 3; ++c) {
          const float color = c == 0 ? light.color.r : c == 1 ? light.color.g : light.color.b;
          for (size_t k = 0; k < stride; ++k) to[c * stride + k] += color * scratch[k];
        }
      }
  }

private:
  static constexpr uint32_t kNone = ~uint32_t{0};
  struct Plan {
    shading::ShadingPlan plan;
    std::vector<size_t> first; // operation of each place, then the end
  };
  struct Rows {
    std::span<const shading::ShadingOp> ops;
    const weights::LightRows* rows;
  };

  void write(std::span<const uint32_t> corners) {
    writeQueries(field_.cloud, tangents_, corners, lit_.scene.camera, lit_.scene.lights, lit_.environments,
                 progress_, batch_);
    batch_.reached.clear();
  }

  Rows rowsAt(size_t corner) const {
    const size_t number = planOf_[corner], step = planner_->queriesPerPlan();
    const Plan& made = plans_[number / step];
    const size_t place = number % step;
    return {std::span(made.plan.ops).subspan(made.first[place], made.first[place + 1] - made.first[place]),
            &made.plan.rows};
  }

  static bool sameLights(const weights::LightRows& a, uint32_t begin, uint32_t end,
                         const weights::LightRows& b, uint32_t otherBegin, uint32_t otherEnd) {
    if (end - begin != otherEnd - otherBegin) return false;
    for (uint32_t l = 0; l < end - begin; ++l) {
      const weights::BlendedLight &x = a.lights[begin + l], &y = b.lights[otherBegin + l];
      if (x.color.r != y.color.r || x.color.g != y.color.g || x.color.b != y.color.b ||
          x.end - x.begin != y.end - y.begin)
        return false;
      for (uint32_t w = 0; w < x.end - x.begin; ++w) {
        const weights::LightWeight &u = a.weights[x.begin + w], &v = b.weights[y.begin + w];
        if (u.light != v.light || u.weight != v.weight) return false;
      }
    }
    return true;
  }

  const weights::ReflectanceField& field_;
  const LitScene& lit_;
  const DeformedCloud& tangents_;
  const Progress& progress_;
  weights::QueryBatch batch_;
  std::optional<shading::ShadingPlanner> planner_;
  std::vector<uint32_t> asked_;
  std::vector<uint32_t> planOf_; // of each corner, its query
  std::vector<Plan> plans_;

public:
  std::vector<Rgb> cameraBlend, lightBlend; // of the corners asked so far, if the options show blends
};

// Working memory of a thread.
struct BlockScratch {
  std::vector<float> corners, blended, sums;
  std::array<float, size_t{4} * codec::blockTexels> texels;
};

// Colours of a block's texels, RGBA and premultiplied, under the weights at its corners. alpha: of its
// texels.
void relightBlock(const weights::PixelGrid& grid, const CornerRows& rows, codec::BlockPosition block,
                  const codec::BlockTerms& terms, std::span<const float> alpha, BlockScratch& scratch) {
  const int perBlock = blockSize / grid.step;
  const auto side = static_cast<size_t>(perBlock) + 1, stride = static_cast<size_t>(terms.stride);
  const auto cornerAt = [&](size_t i, size_t j) {
    return grid.corner(std::min(grid.columns - 1, block.x * perBlock + static_cast<int>(i)),
                       std::min(grid.rows - 1, block.y * perBlock + static_cast<int>(j)));
  };
  const size_t first = cornerAt(0, 0);
  bool areSame = rows.isKnown(first), areKnown = areSame;
  for (size_t j = 0; j < side; ++j)
    for (size_t i = 0; i < side; ++i) {
      const size_t corner = cornerAt(i, j);
      areKnown = areKnown && rows.isKnown(corner);
      areSame = areSame && areKnown && rows.isSame(first, corner);
    }
  const size_t sides = areSame ? 1 : side;
  scratch.corners.assign(sides * sides * 3 * stride, 0);
  for (size_t j = 0; j < sides; ++j)
    for (size_t i = 0; i < sides; ++i)
      if (const size_t corner = cornerAt(i, j); stride > 0 && rows.isKnown(corner))
        rows.coefficientsAt(corner, terms, &scratch.corners[(j * sides + i) * 3 * stride], scratch.sums);
  scratch.blended.resize(3 * stride);
  for (int y = 0; y < blockSize; ++y)
    for (int x = 0; x < blockSize; ++x) {
      const int texel = y * blockSize + x;
      float* const to = &scratch.texels[4 * static_cast<size_t>(texel)];
      const float a = alpha[static_cast<size_t>(texel)];
      if (a == 0) {
        std::fill_n(to, 4, 0.f);
        continue;
      }
      const float* coefficients = scratch.corners.data();
      if (!areSame) {
        const size_t i = static_cast<size_t>(x / grid.step), j = static_cast<size_t>(y / grid.step);
        const float u = (static_cast<float>(x % grid.step) + 0.5f) / static_cast<float>(grid.step),
                    v = (static_cast<float>(y % grid.step) + 0.5f) / static_cast<float>(grid.step);
        const float *const upper = &scratch.corners[(j * sides + i) * 3 * stride], *const lower =
                                                                                       upper +
                                                                                       sides * 3 * stride;
        for (size_t k = 0; k < 3 * stride; ++k)
          scratch.blended[k] = (1 - v) * ((1 - u) * upper[k] + u * upper[k + 3 * stride]) +
                               v * ((1 - u) * lower[k] + u * lower[k + 3 * stride]);
        coefficients = scratch.blended.data();
      }
      const int8_t* const levels = terms.texel(texel);
      for (size_t c = 0; c < 3; ++c) {
        std::array<float, 8> sum{};
        for (size_t k = 0; k < stride; k += 8)
          for (size_t lane = 0; lane < 8; ++lane)
            sum[lane] +=
                coefficients[c * stride + k + lane] * static_cast<float>(levels[c * stride + k + lane]);
        to[c] = a * ((sum[0] + sum[4]) + (sum[1] + sum[5]) + (sum[2] + sum[6]) + (sum[3] + sum[7]));
      }
      to[3] = a;
    }
}

// Texels that hold the object, in each stored block: from the blocks themselves, which are all read once.
std::vector<uint64_t> presentTexels(const codec::ViewFile& file, const Progress& progress) {
  std::vector<uint64_t> present(file.blockCount());
  constexpr size_t kAtOnce = 256;
  const size_t parts = (present.size() + kAtOnce - 1) / kAtOnce;
  tbb::parallel_for(size_t{0}, parts, [&](size_t part) {
    progress.checkpoint();
    std::vector<uint32_t> stretch;
    for (size_t b = part * kAtOnce; b < std::min(present.size(), (part + 1) * kAtOnce); ++b)
      stretch.push_back(static_cast<uint32_t>(b));
    file.read(stretch, [&](size_t i, const codec::Block& block) { present[stretch[i]] = block.present; });
  });
  return present;
}

// The view's picture under the lights of the scene: RGBA, premultiplied, halved `halvings` times.
image::Image relit(const weights::ReflectanceField& field, CornerRows& rows, const Visible& visible,
                   std::span<const ScreenCorner> corners, const FrameOptions& options,
                   FrameWorkspace& workspace, const Progress& progress) {
  const codec::ViewFile& file = field.files[0];
  const codec::ViewHeader& view = file.header();
  const weights::PixelGrid& grid = *field.grid;
  const int halvings = visible.finest, cell = 1 << halvings, perBlock = blockSize / grid.step;
  image::Image picture((view.width + cell - 1) / cell, (view.height + cell - 1) / cell, 4);
  const bool isTranslucent = options.shade.usesAlpha && !field.alpha.empty();
  tbb::enumerable_thread_specific<BlockScratch> scratches;
  const int down = view.blocksDown(), across = view.blocksAcross();
  for (int top = 0; top < down; top += static_cast<int>(kBlockRowsAtOnce)) {
    progress("relighting", static_cast<double>(top) / down);
    const int bottom = std::min(down, top + static_cast<int>(kBlockRowsAtOnce));
    std::vector<codec::BlockKey> keys;
    std::vector<codec::BlockPosition> places;
    std::vector<uint8_t> wanted(grid.corners() > 0 ? static_cast<size_t>((bottom - top) * perBlock + 1) *
                                                         static_cast<size_t>(grid.columns)
                                                   : 0);
    for (int y = top; y < bottom; ++y)
      for (int x = 0; x < across; ++x) {
        if (!visible
                 .needsBlock[static_cast<size_t>(y) * static_cast<size_t>(across) + static_cast<size_t>(x)])
          continue;
        const auto block = file.find({x, y});
        if (!block) continue;
        keys.push_back({0, *block});
        places.push_back({x, y});
        for (int j = 0; j <= perBlock; ++j)
          for (int i = 0; i <= perBlock; ++i)
            if (const int column = x * perBlock + i, row = y * perBlock + j;
                column < grid.columns && row < grid.rows)
              wanted[static_cast<size_t>(row - top * perBlock) * static_cast<size_t>(grid.columns) +
                     static_cast<size_t>(column)] = 1;
      }
    if (keys.empty()) continue;
    std::vector<uint32_t> asked;
    const size_t firstCorner = grid.corner(0, top * perBlock);
    for (size_t i = 0; i < wanted.size(); ++i)
      if (wanted[i] && corners[firstCorner + i].isDrawn)
        asked.push_back(static_cast<uint32_t>(firstCorner + i));
    rows.ask(std::move(asked), workspace.stats);
    workspace.cache.fetch(keys, progress);
    tbb::parallel_for(size_t{0}, keys.size(), [&](size_t k) {
      BlockScratch& scratch = scratches.local();
      const auto [bx, by] = places[k];
      const auto terms = workspace.cache.resident(0, keys[k].block);
      assert(terms);
      std::array<float, codec::blockTexels> alpha;
      const uint64_t present = workspace.present[keys[k].block];
      for (int t = 0; t < codec::blockTexels; ++t) {
        const int x = bx * blockSize + t % blockSize, y = by * blockSize + t / blockSize;
        float& a = alpha[static_cast<size_t>(t)];
        a = static_cast<float>(present >> t & 1);
        if (isTranslucent && x < view.width && y < view.height)
          a *= field.alpha[0].at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      }
      relightBlock(grid, rows, {bx, by}, *terms, alpha, scratch);
      const int side = blockSize / cell;
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          const int px = bx * side + x, py = by * side + y;
          if (px >= picture.width || py >= picture.height) continue;
          const auto to = picture.at(px, py);
          // The mean of those pixels that are in the picture.
          const int right = std::min(cell, view.width - px * cell),
                    lower = std::min(cell, view.height - py * cell);
          for (int j = 0; j < lower; ++j)
            for (int i = 0; i < right; ++i)
              for (size_t c = 0; c < 4; ++c)
                to[c] +=
                    scratch.texels[4 * static_cast<size_t>((y * cell + j) * blockSize + x * cell + i) + c];
          for (size_t c = 0; c < 4; ++c) to[c] /= static_cast<float>(right * lower);
        }
    });
    workspace.stats.shading.tasks += keys.size();
    workspace.cache.trim();
  }
  return picture;
}

// Mean of 2 x 2 pixels, or of as many as there are.
image::Image halved(const image::Image& picture) {
  image::Image half((picture.width + 1) / 2, (picture.height + 1) / 2, picture.channels);
  tbb::parallel_for(0, half.height, [&](int y) {
    for (int x = 0; x < half.width; ++x) {
      const int right = std::min(2, picture.width - 2 * x), lower = std::min(2, picture.height - 2 * y);
      const auto to = half.at(x, y);
      for (int j = 0; j < lower; ++j)
        for (int i = 0; i < right; ++i)
          for (size_t c = 0; c < to.size(); ++c) to[c] += picture.at(2 * x + i, 2 * y + j)[c];
      for (float& value : to) value /= static_cast<float>(right * lower);
    }
  });
  return half;
}

// A picture and its halvings, looked up between pixels and between levels.
class Pyramid {
public:
  // Levels below `finest` are not there; looks up levels up to `coarsest`.
  Pyramid(image::Image picture, int finest, float coarsest) : finest_(finest) {
    levels_.push_back(std::move(picture));
    while (static_cast<float>(finest_) + static_cast<float>(levels_.size()) - 1 < coarsest &&
           std::max(levels_.back().width, levels_.back().height) > 1)
      levels_.push_back(halved(levels_.back()));
  }

  // Colour at a place in pixels of the whole picture.
  std::array<float, 4> at(double x, double y, float level) const {
    const float own =
        std::clamp(level - static_cast<float>(finest_), 0.f, static_cast<float>(levels_.size() - 1));
    const auto first = static_cast<size_t>(own);
    const float rest = own - static_cast<float>(first);
    std::array<float, 4> color = bilinear(first, x, y);
    if (rest == 0) return color;
    const std::array<float, 4> coarser = bilinear(first + 1, x, y);
    for (size_t c = 0; c < 4; ++c) color[c] += rest * (coarser[c] - color[c]);
    return color;
  }

private:
  std::array<float, 4> bilinear(size_t level, double x, double y) const {
    const image::Image& picture = levels_[level];
    const double scale = std::ldexp(1.0, -finest_ - static_cast<int>(level));
    const auto along = [](double place, int size) {
      return std::clamp(place - 0.5, 0.0, static_cast<double>(size - 1));
    };
    const double u = along(scale * x, picture.width), v = along(scale * y, picture.height);
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const int right = std::min(i + 1, picture.width - 1), lower = std::min(j + 1, picture.height - 1);
    const auto s = static_cast<float>(u - i), t = static_cast<float>(v - j);
    const auto a = picture.at(i, j), b = picture.at(right, j), c = picture.at(i, lower),
               d = picture.at(right, lower);
    std::array<float, 4> color;
    for (size_t k = 0; k < 4; ++k)
      color[k] = (1 - t) * ((1 - s) * a[k] + s * b[k]) + t * ((1 - s) * c[k] + s * d[k]);
    return color;
  }

  int finest_;
  std::vector<image::Image> levels_;
};

// What a pixel of the frame shows.
struct Hit {
  float depth = std::numeric_limits<float>::infinity();
  uint32_t square = 0;
  float s = 0, t = 0; // place in the square, 0..1
};

// A value that is linear over a square, at a hit.
template <class Corner> Vec3<float> within(const Hit& hit, const Corner& corner) {
  return (1 - hit.t) * ((1 - hit.s) * corner(0) + hit.s * corner(1)) +
         hit.t * ((1 - hit.s) * corner(3) + hit.s * corner(2));
}

// An AOV: its channels, and its value at a corner.
struct CornerAov {
  int channels;
  std::function<Vec3<float>(size_t corner)> at;
};

std::map<std::string, CornerAov, std::less<>>
cornerAovs(const weights::ReflectanceField& field, const DeformedCloud& deformed, const CornerRows& rows) {
  const auto normal = [&](size_t corner) -> Vec3<float> {
    const auto tangents =
        polarFrame<double>(deformed.u[corner].raw().cast<double>(), deformed.v[corner].raw().cast<double>());
    if (!tangents) return Vec3<float>::Zero();
    return (static_cast<double>(deformed.handedness[corner]) * tangents->n).cast<float>();
  };
  const auto stretch = [&](size_t corner) -> Vec3<float> {
    const double ratio =
        stretchOf(deformed.u[corner].raw().cast<double>(), deformed.v[corner].raw().cast<double>());
    return {static_cast<float>(ratio), 0, 0};
  };
  const auto blend = [](const std::vector<Rgb>& of) {
    return [&of](size_t corner) -> Vec3<float> { return {of[corner].r, of[corner].g, of[corner].b}; };
  };
  return {{"normal", {3, normal}},
          {"position", {3, [&](size_t corner) -> Vec3<float> { return deformed.p[corner].raw(); }}},
          {"rest", {3, [&](size_t corner) -> Vec3<float> { return field.cloud.p0[corner].raw(); }}},
          {"stretch", {1, stretch}},
          {"camera_blend", {3, blend(rows.cameraBlend)}},
          {"light_blend", {3, blend(rows.lightBlend)}}};
}

// Draws squares, each as two triangles, into the rows of a band.
class BandPainter {
public:
  BandPainter(const weights::ReflectanceField& field, std::span<const ScreenCorner> corners,
              const DeformedCloud& deformed, const capture::Camera<ObjectSpace>& camera,
              const Pyramid& pyramid, image::Image& color)
      : field_(field), corners_(corners), deformed_(deformed),
        isPinhole_(camera.lens.model == capture::Lens::Model::pinhole), pyramid_(pyramid), color_(color) {}

  // Draws the rows [top, bottom).
  void paint(std::span<const uint32_t> squares, int top, int bottom) {
    top_ = top, bottom_ = bottom;
    hits_.assign(static_cast<size_t>(bottom - top) * static_cast<size_t>(color_.width), {});
    for (const uint32_t square : squares) draw(square);
  }
  const Hit& hitAt(int x, int y) const {
    return hits_[static_cast<size_t>(y - top_) * static_cast<size_t>(color_.width) + static_cast<size_t>(x)];
  }

private:
  struct Vertex {
    const ScreenCorner* corner;
    double s, t;
  };

  void draw(uint32_t square) {
    const auto [a, b, c, d] = Squares{*field_.grid}.corners(square);
    const std::array vertices{Vertex{&corners_[a], 0, 0}, Vertex{&corners_[b], 1, 0},
                              Vertex{&corners_[c], 1, 1}, Vertex{&corners_[d], 0, 1}};
    const double side = deformed_.handedness[a] == Handedness::mirrored ? -1 : 1;
    draw(square, {vertices[0], vertices[1], vertices[2]}, side);
    draw(square, {vertices[0], vertices[2], vertices[3]}, side);
  }

  void draw(uint32_t square, const std::array<Vertex, 3>& vertices, double side) {
    const ScreenCorner &a = *vertices[0].corner, &b = *vertices[1].corner, &c = *vertices[2].corner;
    const double area = twiceArea(a, b, c);
    if (!(side * area > 0)) return;
    constexpr double kEdge = -1e-9; // of the area: no gaps between triangles
    const int step = field_.grid->step;
    const float level = levelOf(1.0 * step * step, std::abs(area));
    const double column = Squares{*field_.grid}.columnOf(square), row = Squares{*field_.grid}.rowOf(square);
    const codec::ViewHeader& view = field_.files[0].header();
    const int left = std::max(0, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}) - 0.5 - 1e-6))),
              right = std::min(color_.width - 1,
                               static_cast<int>(std::floor(std::max({a.x, b.x, c.x}) - 0.5 + 1e-6))),
              upper = std::max(top_, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}) - 0.5 - 1e-6))),
              lower =
                  std::min(bottom_ - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}) - 0.5 + 1e-6)));
    for (int y = upper; y <= lower; ++y)
      for (int x = left; x <= right; ++x) {
        const ScreenCorner p{x + 0.5, y + 0.5};
        const double wa = twiceArea(p, b, c) / area, wb = twiceArea(a, p, c) / area, wc = 1 - wa - wb;
        if (wa < kEdge || wb < kEdge || wc < kEdge) continue;
        const double depth = isPinhole_ ? 1 / (wa * a.inverse + wb * b.inverse + wc * c.inverse)
                                        : wa * a.depth + wb * b.depth + wc * c.depth;
        Hit& hit =
            hits_[static_cast<size_t>(y - top_) * static_cast<size_t>(color_.width) + static_cast<size_t>(x)];
        if (!(depth < static_cast<double>(hit.depth))) continue;
        const double qa = wa * a.projective, qb = wb * b.projective, qc = wc * c.projective, q = qa + qb + qc;
        const double s = (qa * vertices[0].s + qb * vertices[1].s + qc * vertices[2].s) / q,
                     t = (qa * vertices[0].t + qb * vertices[1].t + qc * vertices[2].t) / q;
        const double px = step * (column + s), py = step * (row + t);
        if (px >= view.width || py >= view.height) continue; // beside the picture
        const std::array<float, 4> color = pyramid_.at(px, py, level);
        if (!(color[3] > 0)) continue;
        hit = {static_cast<float>(depth), square, static_cast<float>(s), static_cast<float>(t)};
        std::ranges::copy(color, color_.at(x, y).begin());
      }
  }

  const weights::ReflectanceField& field_;
  std::span<const ScreenCorner> corners_;
  const DeformedCloud& deformed_;
  const bool isPinhole_;
  const Pyramid& pyramid_;
  image::Image& color_;
  int top_ = 0, bottom_ = 0;
  std::vector<Hit> hits_;
};

} // namespace

FrameLayers renderPixels(const weights::ReflectanceField& field, const LitScene& lit,
                         const FrameOptions& options, FrameWorkspace& workspace, StageClock& clock,
                         const Progress& progress) {
  assert(field.grid && field.files.size() == 1);
  const scene::Scene& scene = lit.scene;
  FrameStats& stats = workspace.stats;
  DeformedCloud& deformed = workspace.deformed;
  deformed = warp::deform(field.cloud, scene.warp, progress, std::move(deformed));
  stats.surfels = field.cloud.size();
  if (workspace.present.empty()) workspace.present = presentTexels(field.files[0], progress);
  clock.finish("warp");

  const std::vector<ScreenCorner> corners = cornersOnScreen(field, deformed, scene.camera, stats);
  const Visible visible = visibleSquares(field, corners, deformed, scene.camera.lens, stats, progress);
  clock.finish("splat");

  const DeformedCloud turned = withTangents(options.tangents, deformed, field, {}, progress);
  weights::ShadeOptions shade = options.shade;
  shade.usesAlpha = false; // alpha is that of pixels, not of corners
  shade.showsBlends = std::ranges::any_of(
      options.aovs, [](const std::string& aov) { return aov == "camera_blend" || aov == "light_blend"; });
  CornerRows rows(field, lit, options.tangents == Tangents::polar ? deformed : turned, shade, progress);
  image::Image picture = relit(field, rows, visible, corners, options, workspace, progress);
  stats.visible = stats.queries;
  clock.finish("look-up");

  FrameLayers layers = std::move(workspace.layers);
  const capture::Lens& lens = scene.camera.lens;
  layers.color = image::Image(lens.width, lens.height, 4);
  std::erase_if(layers.aovs,
                [&](const auto& aov) { return std::ranges::count(options.aovs, aov.first) == 0; });
  const auto aovs = cornerAovs(field, deformed, rows);
  for (const std::string& name : options.aovs) {
    const bool isDepth = name == "depth";
    layers.aovs[name] = image::Image(lens.width, lens.height, isDepth ? 1 : aovs.at(name).channels);
    if (isDepth) std::ranges::fill(layers.aovs[name].values, std::numeric_limits<float>::infinity());
  }
  constexpr float kCoarsest = 16;
  const Pyramid pyramid(std::move(picture), visible.finest, kCoarsest);
  const Squares squares{*field.grid};
  tbb::enumerable_thread_specific<BandPainter> painters(
      [&] { return BandPainter(field, corners, deformed, scene.camera, pyramid, layers.color); });
  tbb::parallel_for(size_t{0}, visible.first.size() - 1, [&](size_t band) {
    progress.checkpoint();
    const int top = static_cast<int>(band) * kBandRows, bottom = std::min(lens.height, top + kBandRows);
    BandPainter& painter = painters.local();
    painter.paint(std::span(visible.squares)
                      .subspan(visible.first[band], visible.first[band + 1] - visible.first[band]),
                  top, bottom);
    for (const std::string& name : options.aovs) {
      image::Image& image = layers.aovs[name];
      const auto aov = aovs.find(name);
      for (int y = top; y < bottom; ++y)
        for (int x = 0; x < lens.width; ++x) {
          const Hit& hit = painter.hitAt(x, y);
          if (!std::isfinite(hit.depth)) continue;
          if (aov == aovs.end()) {
            image.at(x, y)[0] = hit.depth;
            continue;
          }
          const auto of = squares.corners(hit.square);
          const Vec3<float> value =
              within(hit, [&](size_t corner) -> Vec3<float> { return aov->second.at(of[corner]); });
          for (int c = 0; c < image.channels; ++c)
            image.at(x, y)[static_cast<size_t>(c)] = layers.color.at(x, y)[3] * value[c];
        }
    }
  });
  clock.finish("develop");
  return layers;
}

} // namespace surflect::surfels
