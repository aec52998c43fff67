#include "render/lightfield/slf/unseen_texels.h"

#include "render/lightfield/common/pull_push.h"
#include "render/lightfield/slf/resample.h"
#include "srf/image/half_float.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

namespace surflect::slf {

namespace {

// Texels around a place, with their bilinear weights.
struct TexelShare {
  size_t texel = 0;
  float weight = 0;
};

std::array<TexelShare, 4> texelsAround(const Chart& chart, const Vec2<double>& place) {
  const double x = std::clamp(place[0] - 0.5, 0.0, chart.width - 1.0),
               y = std::clamp(place[1] - 0.5, 0.0, chart.height - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, chart.width - 1), y1 = std::min(y0 + 1, chart.height - 1);
  const double a = x - x0, b = y - y0;
  const auto share = [&](int i, int j, double weight) {
    return TexelShare{static_cast<size_t>(j) * static_cast<size_t>(chart.width) + static_cast<size_t>(i),
                      static_cast<float>(weight)};
  };
  return {share(x0, y0, (1 - a) * (1 - b)), share(x1, y0, a * (1 - b)), share(x0, y1, (1 - a) * b),
          share(x1, y1, a * b)};
}

Vec3<float> radianceOf(const Texel& texel) {
  return {image::floatOfHalf(texel[0]), image::floatOfHalf(texel[1]), image::floatOfHalf(texel[2])};
}

// Weights of radiance that no photograph shows, beside 1 of observed radiance: it counts only where there is
// no better one.
constexpr float kExtrapolated = 1e-3f; // of a texel that is seen from other directions, or filled
constexpr float kStandIn = 1e-6f;      // of the nearest direction that has a texture

using WeightedRadiance = Eigen::Vector4f; // radiance, and its weight

// Weighted mean of the radiance of several regions, by base direction.
struct PointRadiance {
  std::vector<WeightedRadiance> sum; // of weight times radiance, and of weights

  void add(std::span<const WeightedRadiance> radiance) {
    if (sum.empty()) sum.assign(radiance.size(), WeightedRadiance::Zero());
    for (size_t i = 0; i < sum.size(); ++i) {
      sum[i].head<3>() += radiance[i][3] * radiance[i].head<3>();
      sum[i][3] += radiance[i][3];
    }
  }
  bool isKnown() const { return !sum.empty(); }
  Vec3<float> mean(size_t direction) const { return sum[direction].head<3>() / sum[direction][3]; }
};

// Directions of a region that have a texture, and how those of the base follow from them: by hat functions;
// by the nearest direction where those have no texture.
struct RegionDirections {
  std::vector<size_t> used;                                    // of the region
  std::vector<size_t> baseOf;                                  // of each used one
  std::vector<std::array<std::pair<size_t, float>, 3>> shares; // by base direction, of used ones
  std::vector<float> weights;                                  // by base direction: of used ones, or kStandIn

  RegionDirections(const DirectionMesh& own, std::span<const uint8_t> isUsed, const DirectionMesh& base) {
    std::vector<size_t> place(isUsed.size(), 0);
    const auto& all = base.directions();
    auto found = all.begin();
    for (size_t i = 0; i < isUsed.size(); ++i) {
      if (!isUsed[i]) continue;
      place[i] = used.size();
      used.push_back(i);
      found = std::find(found, all.end(), own.directions()[i]);
      assert(found != all.end());
      baseOf.push_back(static_cast<size_t>(found - all.begin()));
    }
    if (used.empty()) return;
    for (const Direction& r : base.directions()) {
      const HatWeights hats = own.weightsAt(r);
      auto& share = shares.emplace_back();
      float sum = 0;
      for (size_t c = 0; c < 3; ++c)
        if (isUsed[hats.directions[c]]) {
          share[c] = {place[hats.directions[c]], static_cast<float>(hats.weights[c])};
          sum += share[c].second;
        }
      if (sum > 1e-3f) {
        for (auto& [direction, weight] : share) weight /= sum;
        weights.push_back(sum);
      } else {
        const auto nearest = std::ranges::max_element(
            used, {}, [&](size_t direction) { return dot(own.directions()[direction], r); });
        share = {};
        share[0] = {static_cast<size_t>(nearest - used.begin()), 1.f};
        weights.push_back(kStandIn);
      }
    }
  }

  std::vector<WeightedRadiance> inBase(std::span<const WeightedRadiance> ofUsed) const {
    std::vector<WeightedRadiance> result;
    for (size_t i = 0; i < shares.size(); ++i) {
      WeightedRadiance& sum = result.emplace_back(WeightedRadiance::Zero());
      for (const auto& [direction, share] : shares[i]) sum += share * ofUsed[direction];
      sum[3] *= weights[i];
    }
    return result;
  }
};

class BorderFill {
public:
  BorderFill(const Field& field, std::span<const SeenRegion> seen, const DirectionMesh& base,
             const BorderPoints& borders, const TextureStore& store, const Progress& progress)
      : field_(field), seen_(seen), base_(base), borders_(borders), store_(store), progress_(progress),
        isAsked_(borders.count, 0), points_(borders.count) {
    for (size_t region = 0; region < seen.size(); ++region)
      for (const BorderPoint& point : borders.ofChart[region])
        if (seenShare(region, point) < 1) isAsked_[point.point] = 1;
  }

  std::vector<uint8_t> run() {
    const size_t regions = seen_.size();
    std::vector<uint8_t> isOpen(regions, 0), isBlack(regions, 0); // open: unseen, and not yet filled
    for (size_t region = 0; region < regions; ++region)
      if (seen_[region].isUnseen())
        isOpen[region] = 1;
      else if (hasPoint(region, [&](const BorderPoint& point) { return seenShare(region, point) > 0; }))
        collect(region, texturesOf(region), [&](size_t texel) { return seen_[region].isSeen[texel]; });
    publish();
    // Regions that were seen in part, then the others step by step outwards.
    spread([&](size_t region) { return !isOpen[region]; });
    for (bool isChanged = true; isChanged;) {
      std::vector<size_t> next;
      for (size_t region = 0; region < regions; ++region)
        if (isOpen[region] && hasKnown(region)) next.push_back(region);
      spread([&](size_t region) { return std::ranges::binary_search(next, region); });
      for (const size_t region : next) isOpen[region] = 0;
      isChanged = !next.empty();
    }
    for (size_t region = 0; region < regions; ++region) {
      progress_("unseen texels", static_cast<double>(region) / static_cast<double>(regions));
      if (isOpen[region]) {
        isBlack[region] = 1;
        continue;
      }
      if (!hasPoint(region, [&](const BorderPoint& point) { return seenShare(region, point) < 1; })) continue;
      const std::vector<std::vector<Texel>> textures = filled(region);
      const RegionDirections directions = directionsOf(region);
      for (size_t i = 0; i < textures.size(); ++i) store_.write(region, directions.used[i], textures[i]);
    }
    return isBlack;
  }

private:
  RegionDirections directionsOf(size_t region) const {
    return {field_.directionsOf(region), seen_[region].isUsed, base_};
  }

  // Bilinear share of seen texels at a point.
  float seenShare(size_t region, const BorderPoint& point) const {
    float share = 0, all = 0;
    for (const auto& [texel, weight] : texelsAround(field_.regions[region].chart, point.place)) {
      all += weight;
      if (seen_[region].isSeen[texel]) share += weight;
    }
    return share == all ? 1 : share / all;
  }

  template <class Test> bool hasPoint(size_t region, const Test& test) const {
    return std::ranges::any_of(borders_.ofChart[region], [&](const BorderPoint& point) {
      return isAsked_[point.point] && test(point);
    });
  }
  bool hasKnown(size_t region) const {
    return std::ranges::any_of(borders_.ofChart[region],
                               [&](const BorderPoint& point) { return points_[point.point].isKnown(); });
  }

  // Textures of the used directions; black ones of an unseen region.
  std::vector<std::vector<Texel>> texturesOf(size_t region) const {
    progress_.checkpoint();
    std::vector<std::vector<Texel>> textures;
    for (const size_t direction : directionsOf(region).used)
      textures.push_back(seen_[region].isUnseen()
                             ? std::vector<Texel>(field_.regions[region].chart.texels(), Texel{})
                             : store_.read(region, direction));
    return textures;
  }

  // Adds a region's radiance to its points beside unseen texels, unless they are known. `counts` selects
  // texels.
  template <class Counts>
  void collect(size_t region, const std::vector<std::vector<Texel>>& textures, const Counts& counts) {
    const RegionDirections directions = directionsOf(region);
    if (directions.used.empty()) return;
    for (const BorderPoint& point : borders_.ofChart[region]) {
      if (!isAsked_[point.point] || points_[point.point].isKnown()) continue;
      const auto around = texelsAround(field_.regions[region].chart, point.place);
      std::vector<WeightedRadiance> radiance;
      float all = 0; // a region counts by its share of the place
      for (const auto& [texel, weight] : around) all += counts(texel) ? weight : 0;
      if (!(all > 0)) continue;
      for (const std::vector<Texel>& texture : textures) {
        WeightedRadiance& sum = radiance.emplace_back(WeightedRadiance::Zero());
        for (const auto& [texel, weight] : around) {
          if (!counts(texel)) continue;
          sum.head<3>() += weight / all * radianceOf(texture[texel]);
          sum[3] += weight * (texture[texel][3] != 0 ? 1 : kExtrapolated);
        }
      }
      collected_[point.point].add(directions.inBase(radiance));
    }
  }
  // Gives points the radiance that was collected for them.
  void publish() {
    for (auto& [point, radiance] : collected_) points_[point] = std::move(radiance);
    collected_.clear();
  }

  // Fills the regions that take part, and gives their unknown points radiance from them.
  template <class TakesPart> void spread(const TakesPart& takesPart) {
    for (size_t region = 0; region < seen_.size(); ++region)
      if (takesPart(region) &&
          hasPoint(region, [&](const BorderPoint& point) { return !points_[point.point].isKnown(); }))
        collect(region, filled(region), [](size_t) { return true; });
    publish();
  }

  // Textures of a region, filled from its seen texels and the known points.
  std::vector<std::vector<Texel>> filled(size_t region) const {
    const Chart& chart = field_.regions[region].chart;
    const std::vector<bool>& isSeen = seen_[region].isSeen;
    const RegionDirections directions = directionsOf(region);
    std::vector<std::vector<Texel>> textures = texturesOf(region);
    tbb::parallel_for(size_t{0}, textures.size(), [&](size_t i) {
      std::vector<Texel>& texture = textures[i];
      std::vector<Eigen::Vector4f> values(texture.size(), Eigen::Vector4f::Zero());
      for (const BorderPoint& point : borders_.ofChart[region]) {
        if (!points_[point.point].isKnown()) continue;
        const Vec3<float> mean = points_[point.point].mean(directions.baseOf[i]);
        for (const auto& [texel, weight] : texelsAround(chart, point.place))
          if (!isSeen[texel]) values[texel] += weight * Eigen::Vector4f(mean[0], mean[1], mean[2], 1);
      }
      for (size_t texel = 0; texel < texture.size(); ++texel)
        if (isSeen[texel])
          values[texel] << radianceOf(texture[texel]), 1.f;
        else if (const float weight = values[texel][3]; weight > 0)
          values[texel] /= weight;
      lightfield::pullPush(values, chart.width, chart.height);
      for (size_t texel = 0; texel < texture.size(); ++texel)
        if (!isSeen[texel]) texture[texel] = texelOf(values[texel].head<3>(), false);
    });
    return textures;
  }

  const Field& field_;
  std::span<const SeenRegion> seen_;
  const DirectionMesh& base_;
  const BorderPoints& borders_;
  const TextureStore& store_;
  const Progress& progress_;
  std::vector<uint8_t> isAsked_; // by point: whether a region has unseen texels there
  std::vector<PointRadiance> points_;
  std::map<uint32_t, PointRadiance> collected_; // points that become known together
};

} // namespace

BorderPoints borderPoints(const TriangleMesh& mesh, std::span<const Chart> charts, double spacing) {
  constexpr double kMostOfEdge = 1 << 15; // as many texels as two sides have
  BorderPoints points{std::vector<std::vector<BorderPoint>>(charts.size()), 0};
  std::map<std::array<uint32_t, 3>, uint32_t> numbers; // vertices of an edge, and a point's number along it
  for (size_t c = 0; c < charts.size(); ++c) {
    const Chart& chart = charts[c];
    std::map<std::array<uint32_t, 2>, int> edges; // of vertices of the chart, with their triangles
    for (const auto& corners : chart.triangles)
      for (size_t k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax(corners[k], corners[(k + 1) % 3]);
        ++edges[{a, b}];
      }
    std::map<uint32_t, Vec2<double>> places; // by point
    for (const auto& [edge, triangles] : edges) {
      if (triangles > 1) continue;
      auto [a, b] = edge;
      if (chart.vertices[a] > chart.vertices[b]) std::swap(a, b); // alike from both sides
      const std::array<uint32_t, 2> ends{chart.vertices[a], chart.vertices[b]};
      const double length = (mesh.positions[ends[1]] - mesh.positions[ends[0]]).cast<double>().raw().norm();
      const auto parts = static_cast<uint32_t>(std::clamp(std::ceil(length / spacing), 1.0, kMostOfEdge));
      for (uint32_t k = 0; k <= parts; ++k) {
        std::array<uint32_t, 3> key{ends[0], ends[1], k};
        if (k == 0 || k == parts) key = {ends[k == 0 ? 0 : 1], ends[k == 0 ? 0 : 1], 0};
        const uint32_t number = numbers.try_emplace(key, static_cast<uint32_t>(numbers.size())).first->second;
        const double share = static_cast<double>(k) / parts;
        const Vec2<double> along =
            (1 - share) * chart.coordinates[a].cast<double>() + share * chart.coordinates[b].cast<double>();
        places[number] = along.cwiseProduct(Vec2<double>(chart.width, chart.height));
      }
    }
    for (const auto& [number, place] : places) points.ofChart[c].push_back({number, place});
  }
  points.count = numbers.size();
  return points;
}

bool SeenRegion::isUnseen() const { return std::ranges::find(isSeen, true) == isSeen.end(); }

std::vector<uint8_t> fillUnseenTexels(const Field& field, std::span<const SeenRegion> seen,
                                      const DirectionMesh& base, const BorderPoints& borders,
                                      const TextureStore& store, const Progress& progress) {
  assert(seen.size() == field.regions.size() && borders.ofChart.size() == seen.size());
  return BorderFill(field, seen, base, borders, store, progress).run();
}

} // namespace surflect::slf
