#include "srf/proxy/mesh/mesh_mending.h"

#include "surfel/base/error.h"
#include "surfel/base/text.h"
#include "surfel/geometry/mesh_topology.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace surflect::proxy {

namespace {

using World = AcquisitionSpace;

constexpr size_t kTriangles = 16384, kOfPart = 4, kSideViews = 32;
constexpr double kGrazing = 0.1; // cosine

// How many cameras see a triangle, from the front and from the back.
struct Seen {
  int front = 0, back = 0;
};

Seen seen(const TriangleMesh& mesh, uint32_t triangle, std::span<const capture::Camera<World>> cameras,
          const RayCaster<World>& rays) {
  Vec3<double> middle = Vec3<double>::Zero();
  for (const uint32_t v : mesh.triangles[triangle]) middle += mesh.positions[v].cast<double>().raw() / 3;
  const auto p = assume<Point3<World, double>>(middle);
  const Vec3<double> normal = areaVector(mesh, triangle).stableNormalized();
  Seen seen;
  for (const capture::Camera<World>& camera : cameras) {
    const capture::Viewpoint<World> viewpoint(camera);
    const auto direction = viewpoint.towards(p);
    const double cosine = normal.dot(direction.raw());
    if (!(std::abs(cosine) > kGrazing)) continue;
    const auto pixel = camera.project(p);
    if (!pixel || !capture::contains(camera.lens, *pixel)) continue;
    if (rays.occluded(p, direction, 4 * rays.selfHitOffset(), viewpoint.distance(p))) continue;
    ++(cosine > 0 ? seen.front : seen.back);
  }
  return seen;
}

} // namespace

std::vector<SeenSides> seenSides(const TriangleMesh& mesh, const MeshParts& parts,
                                 const std::vector<bool>& asksAll,
                                 std::span<const capture::Camera<World>> cameras, const Progress& progress) {
  const RayCaster<World> rays(mesh, progress);
  std::vector<capture::Camera<World>> some;
  for (const size_t i : evenlySpaced(cameras.size(), kSideViews)) some.push_back(cameras[i]);
  std::vector<uint32_t> triangles;
  std::vector<std::span<const capture::Camera<World>>> asked; // #triangles
  std::vector<size_t> end;                                    // of each part's
  for (size_t part = 0; part < parts.parts.size(); ++part) {
    const std::vector<uint32_t>& all = parts.parts[part].triangles;
    for (const size_t i :
         evenlySpaced(all.size(), std::max(kOfPart, all.size() * kTriangles / mesh.triangles.size())))
      triangles.push_back(all[i]);
    end.push_back(triangles.size());
    asked.resize(triangles.size(), asksAll[part] ? cameras : some);
  }
  std::vector<Seen> ofTriangle(triangles.size());
  tbb::parallel_for(size_t{0}, triangles.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    ofTriangle[i] = seen(mesh, triangles[i], asked[i], rays);
  });

  std::vector<SeenSides> sides(parts.parts.size());
  for (size_t part = 0, i = 0; part < sides.size(); ++part)
    for (; i < end[part]; ++i) {
      const double area = areaVector(mesh, triangles[i]).norm() / 2, front = area * ofTriangle[i].front,
                   back = area * ofTriangle[i].back;
      const bool isAgainst = parts.isAgainst[triangles[i]] != 0;
      sides[part].front += front;
      sides[part].back += back;
      sides[part].frontAlike += isAgainst ? back : front;
      sides[part].backAlike += isAgainst ? front : back;
    }
  return sides;
}

namespace {

using World = AcquisitionSpace;
using Box = Eigen::AlignedBox3d;

constexpr double kTrimmed = 0.01;  // of the vertices, at either end of an axis
constexpr double kFarSpike = 10;   // diagonals
constexpr double kFarSpeck = 1;    // diagonals
constexpr double kBodyArea = 0.99; // of all
constexpr double kSeenShare = 0.1;
constexpr size_t kStrayViews = 16;
constexpr int kSide = 64; // rays along each side of a picture

// Box of the vertices without the outermost along each axis, one at least at each end.
Box boxOfMost(const std::vector<Point3<World>>& positions) {
  const size_t count = positions.size(),
               trimmed = std::min(static_cast<size_t>(std::ceil(kTrimmed * static_cast<double>(count))),
                                  (count - 1) / 2);
  Vec3<double> low, high;
  std::vector<double> values(count);
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < count; ++i) values[i] = positions[i].raw()[axis];
    const auto nth = [&](size_t n) {
      std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(n));
      return values[n];
    };
    low[axis] = nth(trimmed);
    high[axis] = nth(count - 1 - trimmed);
  }
  return {low, high};
}

TriangleMesh subMesh(const TriangleMesh& mesh, const std::vector<uint8_t>& isChosen, bool chosen) {
  TriangleMesh sub{mesh.positions, {}};
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if ((isChosen[t] != 0) == chosen) sub.triangles.push_back(mesh.triangles[t]);
  return withoutUnused(std::move(sub));
}

// Fraction of the pixels covered by either mesh in which `some` is in front.
double seenShare(const TriangleMesh& some, const TriangleMesh& others,
                 std::span<const capture::Camera<World>> cameras, const Progress& progress) {
  const RayCaster<World> ofSome(some, progress), ofOthers(others, progress); // each at its own precision
  size_t seen = 0, all = 0;
  for (const size_t i : evenlySpaced(cameras.size(), kStrayViews)) {
    progress.checkpoint();
    const capture::Camera<World>& camera = cameras[i];
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const auto ray = capture::rayThrough(
            camera.lens, {(x + 0.5) / kSide * camera.lens.width, (y + 0.5) / kSide * camera.lens.height});
        if (!ray) continue;
        const auto origin = worldFromCamera(ray->origin);
        const auto direction = worldFromCamera(ray->direction);
        const auto a = ofSome.firstHit(origin, direction), b = ofOthers.firstHit(origin, direction);
        all += a || b;
        seen += a && (!b || a->distance < b->distance);
      }
  }
  return all > 0 ? static_cast<double>(seen) / static_cast<double>(all) : 0;
}

} // namespace

Spikes spikesIn(const TriangleMesh& mesh, std::span<const capture::Camera<World>> cameras,
                const Progress& progress) {
  const Box most = boxOfMost(mesh.positions);
  const double reach = kFarSpike * most.diagonal().norm();
  Spikes spikes;
  if (!(reach > 0)) return spikes;
  std::vector<uint8_t> isSpike(mesh.triangles.size(), 0);
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    progress.checkNowAndThen(t);
    for (const uint32_t corner : mesh.triangles[t]) {
      const Vec3<double> p = mesh.positions[corner].cast<double>().raw();
      if (most.exteriorDistance(p) <= reach) continue;
      isSpike[t] = 1;
      if (spikes.triangles.empty() ||
          most.squaredExteriorDistance(p) > most.squaredExteriorDistance(spikes.farthest))
        spikes.farthest = p;
    }
    if (isSpike[t]) spikes.triangles.push_back(t);
  }
  if (spikes.triangles.empty()) return spikes;
  spikes.areSeen =
      spikes.triangles.size() == mesh.triangles.size() ||
      seenShare(subMesh(mesh, isSpike, true), subMesh(mesh, isSpike, false), cameras, progress) > kSeenShare;
  return spikes;
}

std::vector<size_t> specksAmong(const std::vector<MeshParts::Part>& parts,
                                std::span<const capture::Camera<World>> cameras) {
  std::vector<size_t> order(parts.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater(), [&](size_t i) { return parts[i].area; });
  double total = 0, sum = 0;
  for (const auto& part : parts) total += part.area;
  Box body;
  size_t bodyParts = 0;
  for (; bodyParts < order.size() && sum < kBodyArea * total; ++bodyParts) {
    sum += parts[order[bodyParts]].area;
    body.extend(parts[order[bodyParts]].box);
  }
  std::vector<size_t> specks;
  for (const size_t i : std::span(order).subspan(bodyParts)) {
    if (body.exteriorDistance(parts[i].box) <= kFarSpeck * body.diagonal().norm()) continue;
    const auto middle = assume<Point3<World, double>>(parts[i].box.center());
    const auto shows = std::ranges::count_if(cameras, [&](const capture::Camera<World>& camera) {
      const auto pixel = camera.project(middle);
      return pixel && capture::contains(camera.lens, *pixel);
    });
    if (2 * static_cast<size_t>(shows) < cameras.size()) specks.push_back(i);
  }
  std::ranges::sort(specks);
  return specks;
}

namespace {

using World = AcquisitionSpace;

constexpr double kClearlyBack = 2; // backs seen for each front
constexpr double kLeak = 1e-4;     // of what is seen of a part: less comes through cracks
constexpr double kRounding = 1e-7; // of what is seen of a part: slivers whose normals are rounded
constexpr double kManyBacks = 0.1; // of what is seen of a part

std::string placeText(const Vec3<double>& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", p[0], p[1], p[2]);
}

// Fate of each triangle of a mesh.
class Triangles {
public:
  explicit Triangles(const TriangleMesh& mesh) : mesh_(mesh), fate_(mesh.triangles.size(), Fate::stays) {}

  void drop(uint32_t triangle) { fate_[triangle] = Fate::goes; }
  void turn(uint32_t triangle) { fate_[triangle] = Fate::turns; }
  bool isDropped(uint32_t triangle) const { return fate_[triangle] == Fate::goes; }

  // The triangles that stay and fulfil the condition, with their numbers in the whole mesh.
  struct Chosen {
    TriangleMesh mesh;
    std::vector<uint32_t> numbers;
  };
  template <class Condition> Chosen chosen(const Condition& condition) const {
    Chosen chosen{{mesh_.positions, {}}, {}};
    for (uint32_t t = 0; t < fate_.size(); ++t) {
      if (fate_[t] == Fate::goes || !condition(t)) continue;
      chosen.numbers.push_back(t);
      chosen.mesh.triangles.push_back(mesh_.triangles[t]);
    }
    chosen.mesh = withoutUnused(std::move(chosen.mesh));
    return chosen;
  }

  TriangleMesh result() const {
    TriangleMesh result = chosen([](uint32_t) { return true; }).mesh;
    size_t i = 0;
    for (const Fate fate : fate_) {
      if (fate == Fate::goes) continue;
      if (fate == Fate::turns) std::swap(result.triangles[i][1], result.triangles[i][2]);
      ++i;
    }
    return result;
  }

private:
  enum class Fate : uint8_t { stays, turns, goes };

  const TriangleMesh& mesh_;
  std::vector<Fate> fate_;
};

// Vertices that no triangle uses; named where they lie beside the rest, of which they would set the scale.
TriangleMesh dropUnused(TriangleMesh mesh, std::vector<std::string>& notes) {
  const std::vector<Point3<World>> all = mesh.positions;
  mesh = withoutUnused(std::move(mesh));
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  const auto distance = [&](const Point3<World>& p) {
    return box.squaredExteriorDistance(p.cast<double>().raw());
  };
  const Point3<World>& farthest = *std::ranges::max_element(all, {}, distance);
  if (distance(farthest) > 0)
    notes.push_back(fmt::format(
        "{} of {} vertices belong to no triangle: left out, the farthest of them at {}",
        all.size() - mesh.positions.size(), all.size(), placeText(farthest.cast<double>().raw())));
  return mesh;
}

void dropSpikes(Triangles& triangles, std::span<const capture::Camera<World>> cameras,
                const Progress& progress, std::vector<std::string>& notes) {
  const auto all = triangles.chosen([](uint32_t) { return true; });
  const Spikes spikes = spikesIn(all.mesh, cameras, progress);
  if (spikes.triangles.empty()) return;
  if (!spikes.areSeen)
    for (const uint32_t t : spikes.triangles) triangles.drop(all.numbers[t]);
  notes.push_back(
      fmt::format("{} of {} triangles reach far beyond the rest, to {}: {}", spikes.triangles.size(),
                  all.numbers.size(), placeText(spikes.farthest),
                  spikes.areSeen ? "kept, for they fill more than a tenth of what cameras see" : "left out"));
}

// A mesh in parts, with the numbers of its triangles in the whole mesh.
struct Fronts {
  Triangles::Chosen chosen;
  MeshParts parts;
};

// Without copies and backs.
Fronts frontsOf(const Triangles& triangles, const Repeats& repeats, const Progress& progress) {
  Fronts fronts{triangles.chosen([&](uint32_t t) { return repeats.first[t] == t; }), {}};
  fronts.parts = partsOf(fronts.chosen.mesh, progress);
  return fronts;
}

// Returns whether there were any.
bool dropSpecks(const Fronts& fronts, std::span<const capture::Camera<World>> cameras, Triangles& triangles,
                std::vector<std::string>& notes) {
  const auto& parts = fronts.parts.parts;
  const std::vector<size_t> specks = specksAmong(parts, cameras);
  if (specks.empty()) return false;
  size_t count = 0;
  for (const size_t speck : specks) {
    count += parts[speck].triangles.size();
    for (const uint32_t t : parts[speck].triangles) triangles.drop(fronts.chosen.numbers[t]);
  }
  notes.push_back(fmt::format("{} of {} triangles are specks far from the rest: left out, the first at {}",
                              count, fronts.chosen.numbers.size(), placeText(parts[specks[0]].box.center())));
  return true;
}

// How a part is to be wound.
struct Winding {
  bool alike = false;    // all triangles as most of them are
  bool reversed = false; // after that, all of them turned
};

// The winding of which cameras see fewest backs. Sheets that are seen from both sides stay as they are.
Winding windingOf(bool isMixed, const SeenSides& seen) {
  if (!isMixed) return {false, seen.back > kClearlyBack * seen.front};
  if (std::min(seen.frontAlike, seen.backAlike) > seen.back) return {};
  return {true, seen.backAlike > seen.frontAlike};
}

struct Counts {
  size_t away = 0, against = 0, left = 0, copies = 0, backs = 0, twoSided = 0, oneSided = 0;
  double seenBacks = 0; // the largest share of dropped backs in what is seen of a part
};

constexpr uint32_t kNone = ~0u;

// For each triangle, the one behind it.
std::vector<uint32_t> backsIn(const Repeats& repeats) {
  std::vector<uint32_t> backOf(repeats.first.size(), kNone);
  for (uint32_t t = 0; t < backOf.size(); ++t)
    if (repeats.isBack[t]) backOf[repeats.first[t]] = t;
  return backOf;
}

// For each part.
std::vector<bool> hasBacks(const Fronts& fronts, std::span<const uint32_t> backOf) {
  std::vector<bool> has;
  for (const MeshParts::Part& part : fronts.parts.parts)
    has.push_back(std::ranges::any_of(part.triangles,
                                      [&](uint32_t t) { return backOf[fronts.chosen.numbers[t]] != kNone; }));
  return has;
}

// Turns triangles and drops backs.
Counts settleSides(const Fronts& fronts, std::span<const SeenSides> seen, std::span<const uint32_t> backOf,
                   Triangles& triangles) {
  Counts counts;
  for (size_t i = 0; i < seen.size(); ++i) {
    const MeshParts::Part& part = fronts.parts.parts[i];
    const auto isAgainst = [&](uint32_t t) { return fronts.parts.isAgainst[t] != 0; };
    const auto against = static_cast<size_t>(std::ranges::count_if(part.triangles, isAgainst));
    const Winding winding = windingOf(against > 0, seen[i]);
    const double sum = seen[i].front + seen[i].back,
                 back = winding.alike ? (winding.reversed ? seen[i].frontAlike : seen[i].backAlike)
                                      : (winding.reversed ? seen[i].front : seen[i].back);
    const bool needsBacks = !(sum > 0) || back > kLeak * sum; // who knows, if no camera sees it
    size_t turned = 0, backs = 0;
    for (const uint32_t t : part.triangles) {
      const uint32_t number = fronts.chosen.numbers[t], behind = backOf[number];
      const bool turns = (winding.alike && isAgainst(t)) != winding.reversed;
      turned += turns;
      backs += behind != kNone;
      if (turns) triangles.turn(number);
      if (behind == kNone) continue;
      if (!needsBacks) {
        triangles.drop(behind);
        ++counts.backs;
        counts.seenBacks = std::max(counts.seenBacks, back / sum);
      } else if (turns) {
        triangles.turn(behind);
      }
    }
    (winding.reversed ? counts.away : counts.against) += turned;
    if (!winding.alike) counts.left += against;
    if (backs == 0 && back > kManyBacks * sum) counts.twoSided += part.triangles.size();
    if (!part.isOrientable) counts.oneSided += part.triangles.size();
  }
  return counts;
}

void say(const Counts& counts, size_t all, std::vector<std::string>& notes) {
  if (counts.copies > 0)
    notes.push_back(fmt::format("{} of {} triangles repeat others: left out", counts.copies, all));
  if (counts.backs > 0)
    notes.push_back(fmt::format("{} of {} triangles are backs of others that {}: left out", counts.backs, all,
                                counts.seenBacks > kRounding
                                    ? fmt::format("hardly any camera sees ({:.1g} %)", 100 * counts.seenBacks)
                                    : "no camera sees"));
  if (counts.away > 0)
    notes.push_back(
        fmt::format("{} of {} triangles look away from the cameras that see them: turned", counts.away, all));
  if (counts.against > 0)
    notes.push_back(
        fmt::format("{} of {} triangles are wound against their neighbours: turned", counts.against, all));
  if (counts.left > 0)
    notes.push_back(fmt::format("{} of {} triangles are wound against their neighbours, but cameras see the "
                                "fronts of both: left as they are",
                                counts.left, all));
  if (counts.twoSided > 0)
    notes.push_back(
        fmt::format("cameras see both sides of sheets with {} of {} triangles, which have a front only: "
                    "their backs show nothing; give them triangles on both sides",
                    counts.twoSided, all));
  if (counts.oneSided > 0)
    notes.push_back(fmt::format("{} of {} triangles cannot be wound alike (they have one side, as a Moebius "
                                "strip has): left as they are",
                                counts.oneSided, all));
}

} // namespace

MendedMesh mended(TriangleMesh mesh, std::span<const capture::Camera<World>> cameras,
                  const Progress& progress) {
  MendedMesh result;
  mesh = dropUnused(withoutFlat(std::move(mesh), progress), result.notes);
  Triangles triangles(mesh);
  dropSpikes(triangles, cameras, progress, result.notes);
  const Repeats repeats = repeatsIn(mesh, progress);
  Fronts fronts = frontsOf(triangles, repeats, progress);
  if (dropSpecks(fronts, cameras, triangles, result.notes)) fronts = frontsOf(triangles, repeats, progress);

  const std::vector<uint32_t> backOf = backsIn(repeats);
  const std::vector<SeenSides> seen =
      seenSides(fronts.chosen.mesh, fronts.parts, hasBacks(fronts, backOf), cameras, progress);
  Counts counts = settleSides(fronts, seen, backOf, triangles);
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (triangles.isDropped(repeats.first[t])) triangles.drop(t); // with the speck that it repeats
    if (!repeats.isCopy(t)) continue;
    triangles.drop(t);
    ++counts.copies;
  }
  say(counts, mesh.triangles.size(), result.notes);
  result.mesh = triangles.result();
  return result;
}

MendedMesh readMended(const std::filesystem::path& path, const capture::Capture& training,
                      const Progress& progress) {
  std::vector<capture::Camera<World>> cameras;
  for (const capture::View& view : training.views) cameras.push_back(view.camera);
  try {
    return mended(readMeshAsStored(path, {.origin = training.origin}, progress), cameras, progress);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace surflect::proxy
