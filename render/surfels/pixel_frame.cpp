#include "render/surfels/pixel_frame.h"

#include "render/surfels/aovs.h"
#include "render/surfels/queries.h"
#include "srf/shading/plan.h"
#include "surfel/base/error.h"
#include "warp/deform.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

namespace surflect::surfels {

namespace {

using codec::blockSize;

constexpr size_t kBlockRowsAtOnce = 16; // of the relit picture
constexpr int kBandRows = 16;           // of the frame

// A corner of the grid, or of a clipped square, on the screen.
struct ScreenCorner {
  double x = 0, y = 0;   // pixels
  double depth = 0;      // along the viewing axis
  double inverse = 0;    // 1 / depth for a pinhole camera, else 1
  double projective = 0; // weight of the place in the photograph: depth in the view's camera times `inverse`
  bool isAlive = false;  // has a place; `depth` is known
  bool isDrawn = false;  // and is seen by the lens: all else is known too
};

double axialDepth(const capture::Lens& lens, double z) {
  return lens.model == capture::Lens::Model::pinhole ? -z : 1;
}

// A place on the screen. rest: its axial depth in the view's camera at rest.
ScreenCorner onScreen(const capture::Lens& lens, const Point3<CameraSpace, double>& p, double rest) {
  ScreenCorner corner{.depth = -p.z(), .isAlive = p.raw().allFinite()};
  const auto pixel = capture::project(lens, p);
  if (!corner.isAlive || !pixel || !std::isfinite(pixel->x) || !std::isfinite(pixel->y) || !(rest > 0))
    return corner;
  corner.x = pixel->x, corner.y = pixel->y;
  corner.inverse = 1 / axialDepth(lens, p.z());
  corner.projective = rest * corner.inverse;
  corner.isDrawn = true;
  return corner;
}

// Axial depth of a corner at rest, in the view's camera.
double restDepth(const weights::ReflectanceField& field, size_t corner) {
  const capture::Camera<AcquisitionSpace>& own = field.rig.views[0].camera;
  return axialDepth(own.lens, own.cameraFromWorld(field.cloud.p0[corner].cast<double>()).z());
}

std::vector<ScreenCorner> cornersOnScreen(const weights::ReflectanceField& field,
                                          const DeformedCloud& deformed,
                                          const capture::Camera<ObjectSpace>& camera, FrameStats& stats) {
  std::vector<ScreenCorner> corners(deformed.size());
  tbb::parallel_for(size_t{0}, corners.size(), [&](size_t i) {
    if (deformed.handedness[i] == Handedness::dead) return;
    corners[i] =
        onScreen(camera.lens, camera.cameraFromWorld(deformed.p[i].cast<double>()), restDepth(field, i));
  });
  for (size_t i = 0; i < corners.size(); ++i)
    if (deformed.handedness[i] == Handedness::dead)
      ++stats.splats.dead;
    else
      stats.splats.notFinite += !corners[i].isAlive;
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

// A corner of a triangle, and its place in the square, 0..1.
struct Vertex {
  ScreenCorner corner;
  double s = 0, t = 0;
};
using Triangle = std::array<Vertex, 3>;

double twiceArea(const Triangle& triangle) {
  return twiceArea(triangle[0].corner, triangle[1].corner, triangle[2].corner);
}

// The deformed squares as triangles on the screen. Its arguments must outlive it.
class Surface {
public:
  Surface(const weights::ReflectanceField& field, const DeformedCloud& deformed,
          const capture::Camera<ObjectSpace>& camera, std::span<const ScreenCorner> corners)
      : field_(field), deformed_(deformed), camera_(camera), corners_(corners), squares_{*field.grid} {}

  enum class Fate { shown, dead, tooNear, unseen };

  // Calls use(triangle) for the triangles of a square that are in front of the camera: two, or what the
  // near plane leaves of them.
  template <class Use> Fate triangles(uint32_t square, const Use& use) const {
    constexpr std::array<std::array<double, 2>, 4> kPlaces{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    const std::array<size_t, 4> of = squares_.corners(square);
    std::array<Vertex, 4> vertices;
    bool areDrawn = true;
    double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
    for (size_t i = 0; i < 4; ++i) {
      const ScreenCorner& corner = corners_[of[i]];
      if (!corner.isAlive) return Fate::dead;
      vertices[i] = {corner, kPlaces[i][0], kPlaces[i][1]};
      areDrawn = areDrawn && corner.isDrawn;
      nearest = std::min(nearest, corner.depth), farthest = std::max(farthest, corner.depth);
    }
    const double near = kNearest * farthest;
    if (camera_.lens.model != capture::Lens::Model::pinhole || nearest >= near) {
      if (!areDrawn) return nearest > 0 ? Fate::unseen : Fate::tooNear;
      use(Triangle{vertices[0], vertices[1], vertices[2]});
      use(Triangle{vertices[0], vertices[2], vertices[3]});
      return Fate::shown;
    }
    if (!(farthest > 0)) return Fate::tooNear;
    bool isShown = clip({of[0], of[1], of[2]}, {vertices[0], vertices[1], vertices[2]}, near, use);
    isShown = clip({of[0], of[2], of[3]}, {vertices[0], vertices[2], vertices[3]}, near, use) || isShown;
    return isShown ? Fate::shown : Fate::tooNear;
  }

private:
  // Nearest depth of a square that is drawn, over that of its farthest corner: places on the screen are then
  // never far beyond it.
  static constexpr double kNearest = 1e-3;

  // The part of a triangle beyond a depth. Places in the photograph are projective: s and t times the depth
  // at rest are linear on the surface.
  template <class Use>
  bool clip(const std::array<size_t, 3>& of, const Triangle& triangle, double near, const Use& use) const {
    struct Corner {
      Vec3<double> p;
      double rest, s, t; // s and t times rest
    };
    std::array<Corner, 3> corners;
    for (size_t i = 0; i < 3; ++i) {
      const double rest = restDepth(field_, of[i]);
      corners[i] = {camera_.cameraFromWorld(deformed_.p[of[i]].cast<double>()).raw(), rest,
                    rest * triangle[i].s, rest * triangle[i].t};
    }
    std::array<Vertex, 4> kept;
    size_t count = 0;
    const auto keep = [&](const Corner& corner) {
      const auto place = assume<Point3<CameraSpace, double>>(corner.p);
      kept[count++] = {onScreen(camera_.lens, place, corner.rest), corner.s / corner.rest,
                       corner.t / corner.rest};
    };
    for (size_t i = 0; i < 3; ++i) {
      const Corner &from = corners[i], &to = corners[(i + 1) % 3];
      const double ahead = -from.p.z() - near, next = -to.p.z() - near;
      if (ahead >= 0) keep(from);
      if ((ahead >= 0) == (next >= 0)) continue;
      const double along = ahead / (ahead - next);
      Corner cut{from.p + along * (to.p - from.p), from.rest + along * (to.rest - from.rest),
                 from.s + along * (to.s - from.s), from.t + along * (to.t - from.t)};
      cut.p.z() = -near;
      keep(cut);
    }
    for (size_t i = 0; i < count; ++i)
      if (!kept[i].corner.isDrawn) return false;
    for (size_t i = 2; i < count; ++i) use(Triangle{kept[0], kept[i - 1], kept[i]});
    return count > 2;
  }

  const weights::ReflectanceField& field_;
  const DeformedCloud& deformed_;
  const capture::Camera<ObjectSpace>& camera_;
  std::span<const ScreenCorner> corners_;
  Squares squares_;
};

// Squares that face the camera within the picture.
struct Visible {
  std::vector<size_t> first; // of each band of rows of the frame, its first entry in `squares`; then the end
  std::vector<uint32_t> squares;   // of each band, in the order of the grid
  std::vector<uint8_t> needsBlock; // per block of the view
  int finest = 0;                  // least halvings of the picture that a square is drawn from
};

// Halvings at which a pixel of the picture is as large as one of the frame.
float levelOf(double texels, double pixels) {
  constexpr double kAlike = 1.05; // in area: rounding
  return pixels * kAlike >= texels ? 0.f : static_cast<float>(0.5 * std::log2(texels / pixels));
}

// Pixels of the picture on a triangle.
double texelsOf(const Triangle& triangle, int step) {
  const auto& [a, b, c] = triangle;
  return 0.5 * std::abs((b.s - a.s) * (c.t - a.t) - (b.t - a.t) * (c.s - a.s)) * step * step;
}

constexpr int kMostHalvings = 3; // within a block

constexpr float kCoarsest = 16; // halvings

// Pixels beside a place that a look-up between halvings may read: two pixels of the coarser picture.
double reachOf(float level) {
  return std::ldexp(2.0, static_cast<int>(std::ceil(std::min(level, kCoarsest))));
}

Visible visibleSquares(const weights::ReflectanceField& field, const Surface& surface,
                       const DeformedCloud& deformed, const capture::Lens& lens, FrameStats& stats,
                       const Progress& progress) {
  const Squares squares{*field.grid};
  const codec::ViewHeader& view = field.files[0].header();
  const int bands = (lens.height + kBandRows - 1) / kBandRows;
  const auto bandAt = [&](double y) {
    return static_cast<int>(std::clamp(std::floor(y / kBandRows), 0.0, static_cast<double>(bands)));
  };
  struct Extent {
    int begin = 0, end = 0; // bands
    float level = 0;        // coarsest
  };
  struct Counts {
    size_t back = 0, outside = 0, tooNear = 0;
    float finest = std::numeric_limits<float>::infinity();
  };
  std::vector<Extent> extents(squares.count());
  std::vector<Counts> counts(static_cast<size_t>(squares.down()));
  tbb::parallel_for(0, squares.down(), [&](int row) {
    progress.checkpoint();
    Counts& count = counts[static_cast<size_t>(row)];
    for (int column = 0; column < squares.across(); ++column) {
      const uint32_t square = squares.number(column, row);
      const double side = deformed.handedness[squares.corners(square)[0]] == Handedness::mirrored ? -1 : 1;
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      double left = kInfinity, right = -kInfinity, top = kInfinity, bottom = -kInfinity, area = 0;
      float finest = std::numeric_limits<float>::infinity(), coarsest = 0;
      const Surface::Fate fate = surface.triangles(square, [&](const Triangle& triangle) {
        const double twice = side * twiceArea(triangle);
        if (!(twice > 0)) return;
        area += twice / 2;
        const float level = levelOf(texelsOf(triangle, field.grid->step), twice / 2);
        finest = std::min(finest, level), coarsest = std::max(coarsest, level);
        for (const Vertex& vertex : triangle) {
          left = std::min(left, vertex.corner.x), right = std::max(right, vertex.corner.x);
          top = std::min(top, vertex.corner.y), bottom = std::max(bottom, vertex.corner.y);
        }
      });
      if (fate == Surface::Fate::dead) continue;
      if (fate == Surface::Fate::tooNear) {
        ++count.tooNear;
      } else if (fate == Surface::Fate::shown && !(area > 0)) {
        ++count.back;
      } else if (!(right > 0.5 && left < lens.width - 0.5 && bottom > 0.5 && top < lens.height - 0.5)) {
        ++count.outside;
      } else {
        extents[square] = {bandAt(top - 1), std::min(bands, bandAt(bottom + 1) + 1), coarsest};
        count.finest = std::min(count.finest, finest);
      }
    }
  });
  Visible visible;
  visible.first.assign(static_cast<size_t>(bands) + 1, 0);
  const int perBlock = blockSize / field.grid->step, across = view.blocksAcross(), down = view.blocksDown();
  std::vector<float> coarsest(view.cells(), -1); // of each block's squares
  for (uint32_t square = 0; square < extents.size(); ++square) {
    const auto [begin, end, level] = extents[square];
    for (int band = begin; band < end; ++band) ++visible.first[static_cast<size_t>(band) + 1];
    if (begin == end) continue;
    ++stats.splats.drawn;
    float& ofBlock =
        coarsest[static_cast<size_t>(squares.rowOf(square) / perBlock) * static_cast<size_t>(across) +
                 static_cast<size_t>(squares.columnOf(square) / perBlock)];
    ofBlock = std::max(ofBlock, level);
  }
  // Blocks within reach of look-ups: a rectangle around each block, added up from its corners.
  std::vector<int> added(static_cast<size_t>(across + 1) * static_cast<size_t>(down + 1));
  const auto at = [&](int x, int y) -> int& {
    return added[static_cast<size_t>(y) * static_cast<size_t>(across + 1) + static_cast<size_t>(x)];
  };
  for (int y = 0; y < down; ++y)
    for (int x = 0; x < across; ++x) {
      const float level =
          coarsest[static_cast<size_t>(y) * static_cast<size_t>(across) + static_cast<size_t>(x)];
      if (level < 0) continue;
      const int reach = static_cast<int>(std::ceil(reachOf(level) / blockSize));
      const int left = std::max(0, x - reach), right = std::min(across, x + reach + 1),
                top = std::max(0, y - reach), bottom = std::min(down, y + reach + 1);
      ++at(left, top), --at(right, top), --at(left, bottom), ++at(right, bottom);
    }
  visible.needsBlock.resize(view.cells());
  for (int y = 0; y < down; ++y)
    for (int x = 0; x < across; ++x) {
      if (x > 0) at(x, y) += at(x - 1, y);
      if (y > 0) at(x, y) += at(x, y - 1);
      if (x > 0 && y > 0) at(x, y) -= at(x - 1, y - 1);
      visible.needsBlock[static_cast<size_t>(y) * static_cast<size_t>(across) + static_cast<size_t>(x)] =
          at(x, y) > 0;
    }
  for (size_t band = 0; band + 1 < visible.first.size(); ++band)
    visible.first[band + 1] += visible.first[band];
  visible.squares.resize(visible.first.back());
  std::vector<size_t> next(visible.first.begin(), visible.first.end() - 1);
  for (uint32_t square = 0; square < extents.size(); ++square)
    for (int band = extents[square].begin; band < extents[square].end; ++band)
      visible.squares[next[static_cast<size_t>(band)]++] = square;
  float least = std::numeric_limits<float>::infinity();
  for (const Counts& count : counts) {
    stats.splats.backFacing += count.back;
    stats.splats.outside += count.outside;
    stats.splats.tooNear += count.tooNear;
    least = std::min(least, count.finest);
  }
  visible.finest = std::isfinite(least) ? std::min(kMostHalvings, static_cast<int>(least)) : 0;
  return visible;
}

// Weights of captured lights at corners of the grid, for some rows of it at a time.
class CornerRows {
public:
  CornerRows(const weights::ReflectanceField& field, const LitScene& lit, const DeformedCloud& tangents,
             const weights::ShadeOptions& options, const Progress& progress)
      : cameraBlend(options.showsBlends ? field.cloud.size() : 0), lightBlend(cameraBlend.size()),
        field_(field), lit_(lit), tangents_(tangents), progress_(progress),
        planOf_(field.cloud.size(), kNone) {
    write({});
    planner_.emplace(field, batch_, options);
  }

  std::vector<Rgb> cameraBlend, lightBlend; // of the corners asked so far, if the options show blends

  // Asks for corners, ascending; earlier answers are forgotten.
  void ask(std::vector<uint32_t> corners, FrameStats& stats) {
    for (const uint32_t corner : corners) stats.visible += planOf_[corner] == kNone;
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
};

// Working memory of a thread.
struct BlockScratch {
  std::vector<float> corners, blended, sums;
  std::array<float, size_t{4} * codec::blockTexels> texels;
};

// Colours of a block's texels, RGBA and premultiplied, under the weights at its corners. A corner without
// weights takes those of the nearest one; a block without any is transparent. alpha: of its texels.
void relightBlock(const weights::PixelGrid& grid, const CornerRows& rows, codec::BlockPosition block,
                  const codec::BlockTerms& terms, std::span<const float> alpha, BlockScratch& scratch) {
  const int perBlock = blockSize / grid.step;
  const auto side = static_cast<size_t>(perBlock) + 1, stride = static_cast<size_t>(terms.stride);
  const auto cornerAt = [&](size_t i, size_t j) {
    return grid.corner(std::min(grid.columns - 1, block.x * perBlock + static_cast<int>(i)),
                       std::min(grid.rows - 1, block.y * perBlock + static_cast<int>(j)));
  };
  // The known corner that stands for each corner of the block.
  constexpr size_t kNowhere = ~size_t{0};
  std::array<size_t, size_t{9} * 9> standIns; // step 1 has 9 corners along a side
  size_t first = kNowhere;
  bool areSame = true;
  for (size_t j = 0; j < side; ++j)
    for (size_t i = 0; i < side; ++i) {
      const size_t corner = cornerAt(i, j);
      const bool isKnown = rows.isKnown(corner);
      standIns[j * side + i] = isKnown ? corner : kNowhere;
      if (!isKnown) continue;
      if (first == kNowhere) first = corner;
      areSame = areSame && rows.isSame(first, corner);
    }
  if (first == kNowhere) {
    scratch.texels.fill(0);
    return;
  }
  const size_t sides = areSame ? 1 : side;
  if (areSame) standIns[0] = first;
  scratch.corners.assign(sides * sides * 3 * stride, 0);
  for (size_t j = 0; j < sides && stride > 0; ++j)
    for (size_t i = 0; i < sides; ++i) {
      size_t corner = standIns[j * side + i];
      if (corner == kNowhere) {
        size_t least = kNowhere;
        for (size_t y = 0; y < side; ++y)
          for (size_t x = 0; x < side; ++x) {
            if (standIns[y * side + x] == kNowhere) continue;
            const size_t dx = x > i ? x - i : i - x, dy = y > j ? y - j : j - y;
            if (dx * dx + dy * dy < least) least = dx * dx + dy * dy, corner = standIns[y * side + x];
          }
      }
      rows.coefficientsAt(corner, terms, &scratch.corners[(j * sides + i) * 3 * stride], scratch.sums);
    }
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

// Finds out which texels of blocks hold the object, where that is not yet known: 0. A stored block has some.
void findPresent(const codec::ViewFile& file, std::span<const codec::BlockKey> blocks,
                 std::vector<uint64_t>& present, const Progress& progress) {
  present.resize(file.blockCount());
  std::vector<uint32_t> missing;
  for (const codec::BlockKey& key : blocks)
    if (present[key.block] == 0) missing.push_back(key.block);
  constexpr size_t kAtOnce = 256;
  tbb::parallel_for(size_t{0}, (missing.size() + kAtOnce - 1) / kAtOnce, [&](size_t part) {
    progress.checkpoint();
    for (size_t begin = part * kAtOnce, end = std::min(missing.size(), begin + kAtOnce); begin < end;) {
      const auto rest = std::span(missing).subspan(begin, end - begin);
      const auto stretch = rest.first(file.readRunLength(rest));
      file.read(stretch, [&](size_t i, const codec::Block& block) { present[stretch[i]] = block.present; });
      begin += stretch.size();
    }
  });
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
    std::vector<uint8_t> wanted(static_cast<size_t>((bottom - top) * perBlock + 1) *
                                static_cast<size_t>(grid.columns));
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
      if (wanted[i] && corners[firstCorner + i].isAlive && field.cloud.coverage[firstCorner + i] > 0)
        asked.push_back(static_cast<uint32_t>(firstCorner + i));
    rows.ask(std::move(asked), workspace.stats);
    workspace.cache.fetch(keys, progress);
    findPresent(file, keys, workspace.present, progress);
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

// A place on a square that a pixel of the frame shows.
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

std::map<std::string, CornerAov, std::less<>> cornerAovs(const weights::ReflectanceField& field,
                                                         const DeformedCloud& deformed,
                                                         const CornerRows& rows,
                                                         std::span<const std::string> asked) {
  const auto normalAt = [&](size_t corner) -> Vec3<float> {
    if (deformed.handedness[corner] == Handedness::dead) return Vec3<float>::Zero();
    const auto tangents =
        polarFrame<double>(deformed.u[corner].raw().cast<double>(), deformed.v[corner].raw().cast<double>());
    if (!tangents) return Vec3<float>::Zero();
    return (static_cast<double>(deformed.handedness[corner]) * tangents->n).cast<float>();
  };
  const auto stretchAt = [&](size_t corner) -> Vec3<float> {
    if (deformed.handedness[corner] == Handedness::dead) return Vec3<float>::Zero();
    const double ratio =
        stretchOf(deformed.u[corner].raw().cast<double>(), deformed.v[corner].raw().cast<double>());
    return {static_cast<float>(ratio), 0, 0};
  };
  // Values that need work are computed once for each corner, as many pixels may share it.
  const auto atEach = [&](const char* name, const auto& at) {
    std::vector<Vec3<float>> values(std::ranges::count(asked, name) > 0 ? deformed.size() : 0);
    tbb::parallel_for(size_t{0}, values.size(), [&](size_t corner) { values[corner] = at(corner); });
    return [values = std::move(values)](size_t corner) -> Vec3<float> { return values[corner]; };
  };
  const auto blend = [](const std::vector<Rgb>& of) {
    return [&of](size_t corner) -> Vec3<float> { return {of[corner].r, of[corner].g, of[corner].b}; };
  };
  return {{"normal", {3, atEach("normal", normalAt)}},
          {"position", {3, [&](size_t corner) -> Vec3<float> { return deformed.p[corner].raw(); }}},
          {"rest", {3, [&](size_t corner) -> Vec3<float> { return field.cloud.p0[corner].raw(); }}},
          {"stretch", {1, atEach("stretch", stretchAt)}},
          {"camera_blend", {3, blend(rows.cameraBlend)}},
          {"light_blend", {3, blend(rows.lightBlend)}}};
}

// Draws squares into the rows of a band, and composites them from front to back.
class BandPainter {
public:
  BandPainter(const weights::ReflectanceField& field, const Surface& surface, const DeformedCloud& deformed,
              const capture::Camera<ObjectSpace>& camera, const Pyramid& pyramid, image::Image& color)
      : field_(field), surface_(surface), deformed_(deformed),
        isPinhole_(camera.lens.model == capture::Lens::Model::pinhole), pyramid_(pyramid), color_(color) {}

  // Draws the rows [top, bottom).
  void paint(std::span<const uint32_t> squares, int top, int bottom) {
    top_ = top, bottom_ = bottom;
    hits_.assign(static_cast<size_t>(bottom - top) * static_cast<size_t>(color_.width), {});
    fragments_.clear();
    const Squares grid{*field_.grid};
    for (const uint32_t square : squares) {
      const double side = deformed_.handedness[grid.corners(square)[0]] == Handedness::mirrored ? -1 : 1;
      surface_.triangles(square, [&](const Triangle& triangle) { draw(square, triangle, side); });
    }
    composite();
  }
  // The place that gives most of a pixel's colour.
  const Hit& hitAt(int x, int y) const {
    return hits_[static_cast<size_t>(y - top_) * static_cast<size_t>(color_.width) + static_cast<size_t>(x)];
  }

private:
  // From this alpha on, nothing behind shows: the rest is rounding of look-ups.
  static constexpr float kOpaque = 1 - 1e-4f;

  struct Fragment {
    size_t pixel;
    Hit hit;
    std::array<float, 4> color;
  };

  // Cross product of the sides from a pixel to two vertices. It changes sign, and nothing else, if they are
  // exchanged.
  static double edge(double x, double y, const ScreenCorner& a, const ScreenCorner& b) {
    const double ahead = (a.x - x) * (b.y - y), behind = (a.y - y) * (b.x - x);
    return ahead - behind;
  }

  // Whether an edge of a triangle keeps a pixel: on the edge, one of the two triangles that share it does.
  static bool isInside(double cross, double side, const ScreenCorner& a, const ScreenCorner& b) {
    if (cross != 0) return side * cross > 0;
    const double dy = side * (b.y - a.y), dx = side * (b.x - a.x);
    return dy > 0 || (dy == 0 && dx < 0);
  }

  void draw(uint32_t square, const Triangle& vertices, double side) {
    const ScreenCorner &a = vertices[0].corner, &b = vertices[1].corner, &c = vertices[2].corner;
    const double area = twiceArea(a, b, c);
    if (!(side * area > 0) || !std::isfinite(area)) return;
    const int step = field_.grid->step;
    const float level = levelOf(texelsOf(vertices, step), std::abs(area) / 2);
    const double column = Squares{*field_.grid}.columnOf(square), row = Squares{*field_.grid}.rowOf(square);
    const codec::ViewHeader& view = field_.files[0].header();
    // The first pixel of [low, high) whose middle is not before a place; and the first beyond it.
    const auto from = [](double place, int low, int high) {
      return static_cast<int>(std::clamp(std::ceil(place - 0.5 - 1e-6), 1.0 * low, 1.0 * high));
    };
    const auto beyond = [](double place, int low, int high) {
      return static_cast<int>(std::clamp(std::floor(place + 0.5 + 1e-6), 1.0 * low, 1.0 * high));
    };
    const int left = from(std::min({a.x, b.x, c.x}), 0, color_.width),
              right = beyond(std::max({a.x, b.x, c.x}), 0, color_.width),
              upper = from(std::min({a.y, b.y, c.y}), top_, bottom_),
              lower = beyond(std::max({a.y, b.y, c.y}), top_, bottom_);
    for (int y = upper; y < lower; ++y)
      for (int x = left; x < right; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double ea = edge(px, py, b, c), eb = edge(px, py, c, a), ec = edge(px, py, a, b);
        if (!isInside(ea, side, b, c) || !isInside(eb, side, c, a) || !isInside(ec, side, a, b)) continue;
        const double wa = ea / area, wb = eb / area, wc = 1 - wa - wb;
        const double depth = isPinhole_ ? 1 / (wa * a.inverse + wb * b.inverse + wc * c.inverse)
                                        : wa * a.depth + wb * b.depth + wc * c.depth;
        const size_t pixel =
            static_cast<size_t>(y - top_) * static_cast<size_t>(color_.width) + static_cast<size_t>(x);
        Hit& opaque = hits_[pixel];
        if (!(depth < static_cast<double>(opaque.depth))) continue;
        const double qa = wa * a.projective, qb = wb * b.projective, qc = wc * c.projective, q = qa + qb + qc;
        const double s = (qa * vertices[0].s + qb * vertices[1].s + qc * vertices[2].s) / q,
                     t = (qa * vertices[0].t + qb * vertices[1].t + qc * vertices[2].t) / q;
        const double u = step * (column + s), v = step * (row + t);
        if (!(u < view.width && v < view.height)) continue; // beside the picture
        const std::array<float, 4> color = pyramid_.at(u, v, level);
        if (!(color[3] > 0)) continue;
        const Hit hit{static_cast<float>(depth), square, static_cast<float>(s), static_cast<float>(t)};
        if (color[3] < kOpaque) {
          fragments_.push_back({pixel, hit, color});
          continue;
        }
        opaque = hit;
        std::ranges::copy(color, color_.at(x, y).begin());
      }
  }

  // Puts fragments before the opaque places of their pixels.
  void composite() {
    std::ranges::stable_sort(fragments_, {}, [](const Fragment& fragment) {
      return std::pair(fragment.pixel, fragment.hit.depth);
    });
    for (size_t i = 0; i < fragments_.size();) {
      const size_t pixel = fragments_[i].pixel;
      Hit& opaque = hits_[pixel];
      Hit heaviest = opaque;
      std::array<float, 4> sum{};
      float most = 0, left = 1; // of the light that passes
      for (; i < fragments_.size() && fragments_[i].pixel == pixel; ++i) {
        const auto& [_, hit, color] = fragments_[i];
        if (!(hit.depth < opaque.depth)) continue;
        if (const float share = left * color[3]; share > most) most = share, heaviest = hit;
        for (size_t c = 0; c < 4; ++c) sum[c] += left * color[c];
        left *= 1 - color[3];
      }
      const auto own = color_.at(static_cast<int>(pixel % static_cast<size_t>(color_.width)),
                                 top_ + static_cast<int>(pixel / static_cast<size_t>(color_.width)));
      for (size_t c = 0; c < 4; ++c) own[c] = sum[c] + left * own[c];
      if (!std::isfinite(opaque.depth) || most > left) opaque = heaviest;
    }
  }

  const weights::ReflectanceField& field_;
  const Surface& surface_;
  const DeformedCloud& deformed_;
  const bool isPinhole_;
  const Pyramid& pyramid_;
  image::Image& color_;
  int top_ = 0, bottom_ = 0;
  std::vector<Hit> hits_;           // the nearest opaque ones
  std::vector<Fragment> fragments_; // translucent
};

} // namespace

FrameLayers renderPixels(const weights::ReflectanceField& field, const LitScene& lit,
                         const FrameOptions& options, FrameWorkspace& workspace, StageClock& clock,
                         const Progress& progress) {
  assert(field.grid && field.files.size() == 1);
  for (const std::string& aov : options.aovs)
    if (aov == "predicted_error") throw Error::mismatch("another AOV of a model with a pixel grid", aov);
  const scene::Scene& scene = lit.scene;
  FrameStats& stats = workspace.stats;
  DeformedCloud& deformed = workspace.deformed;
  deformed = warp::deform(field.cloud, scene.warp, progress, std::move(deformed));
  stats.surfels = field.cloud.size();
  clock.finish("warp");

  const std::vector<ScreenCorner> corners = cornersOnScreen(field, deformed, scene.camera, stats);
  const Surface surface(field, deformed, scene.camera, corners);
  const Visible visible = visibleSquares(field, surface, deformed, scene.camera.lens, stats, progress);
  clock.finish("splat");

  const DeformedCloud turned = withTangents(options.tangents, deformed, field, {}, progress);
  weights::ShadeOptions shade = options.shade;
  shade.usesAlpha = false; // alpha is that of pixels, not of corners
  shade.showsBlends = std::ranges::any_of(
      options.aovs, [](const std::string& aov) { return aov == "camera_blend" || aov == "light_blend"; });
  CornerRows rows(field, lit, options.tangents == Tangents::polar ? deformed : turned, shade, progress);
  image::Image picture = relit(field, rows, visible, corners, options, workspace, progress);
  clock.finish("look-up");

  FrameLayers layers = std::move(workspace.layers);
  const capture::Lens& lens = scene.camera.lens;
  layers.color = image::Image(lens.width, lens.height, 4);
  std::erase_if(layers.aovs,
                [&](const auto& aov) { return std::ranges::count(options.aovs, aov.first) == 0; });
  const auto aovs = cornerAovs(field, deformed, rows, options.aovs);
  for (const std::string& name : options.aovs) {
    const bool isDepth = name == "depth";
    layers.aovs[name] = image::Image(lens.width, lens.height, isDepth ? 1 : aovs.at(name).channels);
    if (isDepth) std::ranges::fill(layers.aovs[name].values, std::numeric_limits<float>::infinity());
  }
  const Pyramid pyramid(std::move(picture), visible.finest, kCoarsest);
  const Squares squares{*field.grid};
  tbb::enumerable_thread_specific<BandPainter> painters(
      [&] { return BandPainter(field, surface, deformed, scene.camera, pyramid, layers.color); });
  tbb::parallel_for(size_t{0}, visible.first.size() - 1, [&](size_t band) {
    progress.checkpoint();
    const int top = static_cast<int>(band) * kBandRows, bottom = std::min(lens.height, top + kBandRows);
    BandPainter& painter = painters.local();
    painter.paint(std::span(visible.squares)
                      .subspan(visible.first[band], visible.first[band + 1] - visible.first[band]),
                  top, bottom);
    for (const std::string& name : options.aovs) {
      image::Image& image = layers.aovs.at(name);
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
