#include "render/surfels/ground_shadow.h"

#include "srf/weights/irradiance_ratio.h"
#include "surfel/math/bounds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <variant>

namespace surflect::surfels {

namespace {

// Spread of the merged lights of an environment: about 1047 for a constant map.
constexpr double kGroundSpread = 0.002;
// Share of an environment's strength above which the edge of a single light would show.
constexpr double kLargestShare = 1.0 / 512;
// A source of a smaller radius, in radians, that has kHardShare or more is a lamp. The sun's is 0.0047.
constexpr double kLampRadius = 0.005, kHardShare = 1.0 / 64;
constexpr int kGroundTile = 16; // pixels
constexpr int kWithin = 4;      // samples along each side of a pixel on an edge

// Merged lights of a map. One with more than kLargestShare is divided into equal lights over a disc with the
// spread of what was merged and of a texel: texels are areas. A square of solid angle w has the spread w / 6,
// a disc of radius r has r^2 / 2.
std::vector<weights::EnvironmentLight> groundLights(const weights::EnvironmentMap& map,
                                                    const Progress& progress) {
  const std::vector<weights::EnvironmentLight> merged =
      weights::clusteredLights(map.lights, kGroundSpread, progress);
  const double all = double{weights::brightness(weights::totalIrradiance(merged))};
  const double texel = 4 * std::numbers::pi / static_cast<double>(std::max<size_t>(1, map.lights.size()));
  constexpr double golden = std::numbers::pi * (3 - 2.23606797749979); // pi (3 - sqrt 5)
  std::vector<weights::EnvironmentLight> lights;
  for (const weights::EnvironmentLight& light : merged) {
    const double share = double{weights::brightness(light.irradiance)} / all;
    const double radius = std::sqrt(2 * (double{light.spread} + texel / 6));
    if (!(share > kLargestShare) || (share >= kHardShare && radius < kLampRadius)) {
      lights.push_back(light);
      continue;
    }
    const auto parts = static_cast<int>(std::ceil(share / kLargestShare));
    const Vec3<double> towards = light.towards.raw().cast<double>(), across = towards.unitOrthogonal(),
                       up = towards.cross(across);
    for (int i = 0; i < parts; ++i) { // a sunflower's seeds: equal areas, no direction preferred
      const double r = radius * std::sqrt((i + 0.5) / parts), angle = golden * i;
      const Vec3<double> part =
          (towards + r * (std::cos(angle) * across + std::sin(angle) * up)).normalized();
      lights.push_back(
          {assume<Direction3<EnvironmentSpace>>(part), 1 / static_cast<float>(parts) * light.irradiance, 0});
    }
  }
  return lights;
}

} // namespace

std::span<const weights::EnvironmentLight>
GroundEnvironments::lightsOf(const std::shared_ptr<const weights::EnvironmentMap>& map,
                             const Progress& progress) {
  for (const Entry& entry : entries_)
    if (entry.map.lock() == map) return entry.lights;
  std::erase_if(entries_, [](const Entry& entry) { return entry.map.expired(); });
  entries_.push_back({map, groundLights(*map, progress)});
  return entries_.back().lights;
}

GroundShadow::GroundShadow(const Occluders& occluders, const DeformedCloud& deformed,
                           const scene::Scene& scene, GroundEnvironments& environments,
                           const Progress& progress)
    : ground_(*scene.ground), camera_(scene.camera), objectFromCamera_(camera_.cameraFromWorld.inverse()),
      caster_(casterOf(occluders, deformed, progress)) {
  Eigen::AlignedBox3d box;
  double widest = 0;
  for (size_t i = 0; i < deformed.size(); ++i) {
    if (deformed.handedness[i] == Handedness::dead) continue;
    box.extend(deformed.p[i].raw().cast<double>());
    widest = std::max(widest, double{longerAxis(deformed.u[i].raw(), deformed.v[i].raw())} *
                                  double{kReachPerRadius * occluders.splats[i].radius});
  }
  if (!box.isEmpty()) {
    middle_ = box.center();
    radius_ = 1.001 * (box.diagonal().norm() / 2 + widest); // more than rounding
  }

  const Vec3<double>& n = ground_.normal.raw();
  std::vector<Light> soft;
  for (const scene::ShotLight& light : scene.lights) {
    if (const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light)) {
      lights_.push_back(
          {true, directional->towards.raw(), double{weights::brightness(directional->irradiance)}});
    } else if (const auto* point = std::get_if<scene::ShotPointLight>(&light)) {
      lights_.push_back({false, point->position.raw(), double{weights::brightness(point->intensity)}});
    } else {
      const auto& environment = std::get<scene::ShotEnvironment>(light);
      const auto parts = environments.lightsOf(environment.map, progress);
      const double all = double{weights::brightness(environment.strength * weights::totalIrradiance(parts))};
      for (const weights::EnvironmentLight& part : parts) {
        const auto towards = environment.objectFromEnvironment(part.towards.cast<double>());
        const double strength = double{weights::brightness(environment.strength * part.irradiance)};
        (strength >= kHardShare * all ? lights_ : soft).push_back({true, towards.raw(), strength});
      }
    }
  }
  const auto isUseless = [&](const Light& light) {
    const Vec3<double> way = light.isDistant ? light.place : Vec3<double>(light.place - ground_.point.raw());
    return !(light.strength > 0) || !(n.dot(way) > 0);
  };
  std::erase_if(lights_, isUseless);
  std::erase_if(soft, isUseless);
  hard_ = lights_.size();
  for (const Light& light : soft) softIrradiance_ += light.strength * n.dot(light.place);
  lights_.insert(lights_.end(), soft.begin(), soft.end());
}

// E cos(theta), or I cos(theta) / r^2.
double GroundShadow::irradianceOf(const Light& light, const Vec3<double>& p) const {
  const Vec3<double>& n = ground_.normal.raw();
  if (light.isDistant) return light.strength * n.dot(light.place);
  const Vec3<double> way = light.place - p;
  const double distance = way.norm();
  return light.strength * n.dot(way) / (distance * distance * distance);
}

// Rays start where they enter the sphere around the occluders, so that they are precise however far away the
// point is. The ground itself is no occluder, and rays need no offset from it.
double GroundShadow::blockedOf(const Light& light, const Vec3<double>& p) const {
  const Vec3<double> way = light.isDistant ? light.place : Vec3<double>(light.place - p);
  const double distance = light.isDistant ? std::numeric_limits<double>::infinity() : way.norm();
  const Vec3<double> towards = light.isDistant ? way : Vec3<double>(way / distance);
  const Vec3<double> toMiddle = middle_ - p;
  const double along = toMiddle.dot(towards);
  const double half = radius_ * radius_ - (toMiddle - along * towards).squaredNorm();
  if (!(half > 0)) return 0;
  const double begin = std::max(0.0, along - std::sqrt(half)), end = along + std::sqrt(half);
  if (!(end > 0 && begin < distance)) return 0;
  return caster_.blocked(assume<Point3<ObjectSpace, double>>(p + begin * towards),
                         assume<Direction3<ObjectSpace, double>>(towards), 0, distance - begin);
}

double GroundShadow::softDensity(const Point3<ObjectSpace, double>& p) const {
  double blocked = 0;
  for (size_t l = hard_; l < lights_.size(); ++l)
    blocked += blockedOf(lights_[l], p.raw()) * irradianceOf(lights_[l], p.raw());
  return softIrradiance_ > 0 ? blocked / softIrradiance_ : 0;
}

void GroundShadow::blockHard(const GroundPoint& p, std::span<double> blocked) const {
  for (size_t l = 0; l < hard_; ++l) blocked[l] = p ? blockedOf(lights_[l], p->raw()) : 0;
}

double GroundShadow::densityOf(const Point3<ObjectSpace, double>& p, std::span<const double> blocked,
                               double soft) const {
  double lost = softIrradiance_ * soft, all = softIrradiance_;
  for (size_t l = 0; l < hard_; ++l) {
    const double irradiance = irradianceOf(lights_[l], p.raw());
    all += irradiance;
    lost += blocked[l] * irradiance;
  }
  return all > 0 ? std::min(1.0, lost / all) : 0;
}

double GroundShadow::density(const Point3<ObjectSpace, double>& p) const {
  std::vector<double> blocked(hard_);
  blockHard(p, blocked);
  return densityOf(p, blocked, softDensity(p));
}

auto GroundShadow::pointAt(capture::Pixel pixel) const -> GroundPoint {
  const auto ray = capture::rayThrough(camera_.lens, pixel);
  if (!ray) return std::nullopt;
  const Vec3<double> origin = objectFromCamera_(ray->origin).raw(),
                     direction = objectFromCamera_(ray->direction).raw();
  const Vec3<double>& n = ground_.normal.raw();
  const double height = n.dot(origin - ground_.point.raw()), fall = -n.dot(direction);
  if (!(height > 0 && fall > 0)) return std::nullopt;
  const Vec3<double> p = origin + height / fall * direction;
  if (!p.allFinite()) return std::nullopt;
  return assume<Point3<ObjectSpace, double>>(p);
}

// Soft density at every kSoftStep-th corner of pixels; negative off the ground.
struct GroundShadow::SoftGrid {
  int width = 0, height = 0;
  std::vector<float> values;

  float at(int x, int y) const {
    return values[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  // Largest second difference at a corner, along x and y; 0 on the border.
  float bendAt(int x, int y) const {
    const float twice = 2 * at(x, y);
    const float along = x > 0 && x + 1 < width ? std::abs(at(x - 1, y) - twice + at(x + 1, y)) : 0;
    const float across = y > 0 && y + 1 < height ? std::abs(at(x, y - 1) - twice + at(x, y + 1)) : 0;
    return std::max(along, across);
  }
  // Bilinear value at the middle of a pixel. Empty where the grid is too coarse for it: a linear value errs
  // by an eighth of the second difference.
  std::optional<double> valueAt(int pixelX, int pixelY) const {
    const int x = pixelX / kSoftStep, y = pixelY / kSoftStep;
    const float v00 = at(x, y), v10 = at(x + 1, y), v01 = at(x, y + 1), v11 = at(x + 1, y + 1);
    if (std::min({v00, v10, v01, v11}) < 0) return std::nullopt;
    const float bend = std::max({bendAt(x, y), bendAt(x + 1, y), bendAt(x, y + 1), bendAt(x + 1, y + 1),
                                 std::abs(v00 - v10 - v01 + v11)});
    if (bend > kSoftBend) return std::nullopt;
    const double a = (pixelX % kSoftStep + 0.5) / kSoftStep, b = (pixelY % kSoftStep + 0.5) / kSoftStep;
    return (1 - b) * ((1 - a) * v00 + a * v10) + b * ((1 - a) * v01 + a * v11);
  }
};

auto GroundShadow::softGrid(const Progress& progress) const -> SoftGrid {
  if (hard_ == lights_.size()) return {};
  const int width = (camera_.lens.width + kSoftStep - 1) / kSoftStep + 1,
            height = (camera_.lens.height + kSoftStep - 1) / kSoftStep + 1;
  SoftGrid grid{width, height, std::vector<float>(static_cast<size_t>(width) * static_cast<size_t>(height))};
  tbb::parallel_for(0, height, [&](int y) {
    progress.checkpoint();
    for (int x = 0; x < width; ++x) {
      const auto p = pointAt({double{kSoftStep} * x, double{kSoftStep} * y});
      grid.values[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)] =
          p ? static_cast<float>(softDensity(*p)) : -1;
    }
  });
  return grid;
}

struct GroundShadow::Tile {
  int x0, y0, x1, y1;
};

void GroundShadow::draw(const Tile& tile, const SoftGrid& soft, image::Image& picture) const {
  const auto corners = static_cast<size_t>(tile.x1 - tile.x0 + 1);
  const size_t rows = static_cast<size_t>(tile.y1 - tile.y0 + 1);
  std::vector<uint8_t> isOnGround(corners * rows);
  std::vector<double> blocked(corners * rows * hard_), within(hard_);
  for (int y = tile.y0; y <= tile.y1; ++y)
    for (int x = tile.x0; x <= tile.x1; ++x) {
      const size_t corner = static_cast<size_t>(y - tile.y0) * corners + static_cast<size_t>(x - tile.x0);
      const GroundPoint p = pointAt({double(x), double(y)});
      isOnGround[corner] = p.has_value();
      blockHard(p, std::span(blocked).subspan(corner * hard_, hard_));
    }
  const auto softAt = [&](int x, int y, const GroundPoint& middle) -> double {
    if (soft.values.empty() || !middle) return 0;
    const std::optional<double> value = soft.valueAt(x, y);
    return value ? *value : softDensity(*middle);
  };
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x) {
      const size_t first = static_cast<size_t>(y - tile.y0) * corners + static_cast<size_t>(x - tile.x0);
      const std::array<size_t, 4> around{first, first + 1, first + corners, first + corners + 1};
      const auto blockedAt = [&](size_t corner) {
        return std::span<const double>(blocked).subspan(corner * hard_, hard_);
      };
      const auto onGround = std::ranges::count_if(around, [&](size_t corner) { return isOnGround[corner]; });
      if (onGround == 0) continue;
      const GroundPoint middle = pointAt({x + 0.5, y + 0.5});
      const double softHere = softAt(x, y, middle);
      const bool isEven = onGround == 4 && middle && std::ranges::all_of(around, [&](size_t corner) {
                            return std::ranges::equal(blockedAt(corner), blockedAt(first));
                          });
      double density = 0;
      if (isEven) {
        density = densityOf(*middle, blockedAt(first), softHere);
      } else {
        for (int i = 0; i < kWithin * kWithin; ++i) {
          const GroundPoint p =
              pointAt({x + (i % kWithin + 0.5) / kWithin, y + (i / kWithin + 0.5) / kWithin});
          if (!p) continue;
          blockHard(p, within);
          density += densityOf(*p, within, softHere) / (kWithin * kWithin);
        }
      }
      picture.at(x, y)[0] = static_cast<float>(density);
    }
}

image::Image GroundShadow::picture(const Progress& progress) const {
  const int width = camera_.lens.width, height = camera_.lens.height;
  image::Image picture(width, height, 1);
  if (lights_.empty() || radius_ == 0) return picture;
  const SoftGrid soft = softGrid(progress);
  const int across = (width + kGroundTile - 1) / kGroundTile, down = (height + kGroundTile - 1) / kGroundTile;
  tbb::parallel_for(0, across * down, [&](int tile) {
    progress.checkpoint();
    const int x = tile % across * kGroundTile, y = tile / across * kGroundTile;
    draw({x, y, std::min(x + kGroundTile, width), std::min(y + kGroundTile, height)}, soft, picture);
  });
  return picture;
}

image::Image shadowBehind(const image::Image& color, image::Image density, double strength) {
  assert(color.channels == 4 && density.channels == 1 && color.values.size() == 4 * density.values.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, density.values.size(), 1 << 14), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) {
      const float open = 1 - std::clamp(color.values[4 * i + 3], 0.f, 1.f);
      density.values[i] = open * static_cast<float>(strength * double{density.values[i]});
    }
  });
  return density;
}

} // namespace surflect::surfels
