#include "render/evaluation/diagnostics.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

#include <vector>

namespace surflect::evaluation {

namespace {

// Fraction of the finite points outside the reach of the warp's rest mesh; 0 if it has none.
double shareUnreached(const warp::WarpMotion& motion, const std::vector<Vec3<double>>& points) {
  const auto* mesh = std::get_if<warp::MeshMotion>(&motion);
  const auto* skeleton = std::get_if<warp::SkeletonMotion>(&motion);
  if (!mesh && !skeleton) return 0;
  size_t finite = 0, beyond = 0;
  for (const Vec3<double>& x : points) {
    if (!x.allFinite()) continue;
    ++finite;
    beyond += !(mesh ? mesh->sequence->reaches(x) : skeleton->rig->reaches(x));
  }
  return finite == 0 ? 0 : static_cast<double>(beyond) / static_cast<double>(finite);
}

} // namespace

std::optional<std::string> beyondRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                          std::span<const Point3<AcquisitionSpace>> object) {
  constexpr size_t most = 4000;
  constexpr double tolerated = 0.1;
  std::vector<Vec3<double>> points;
  for (size_t i = 0; i < object.size(); i += object.size() / most + 1)
    points.push_back(object[i].raw().cast<double>());

  // Each warp acts on the output of those before it; warps after the last mesh do not matter.
  const auto hasMesh = [](const warp::WarpMotion& motion) {
    return std::holds_alternative<warp::MeshMotion>(motion) ||
           std::holds_alternative<warp::SkeletonMotion>(motion);
  };
  size_t end = script.warps.size();
  while (end > 0 && !hasMesh(script.warps[end - 1])) --end;
  for (size_t i = 0; i < end; ++i) {
    if (const double share = shareUnreached(script.warps[i], points); share > tolerated)
      return fmt::format(
          "{}: warp[{}]: {:.0f} % of the surfels are further from its rest mesh than twice the "
          "length of its edges: are its units and axes those of the model?",
          script.path.string(), i, 100 * share);
    if (i + 1 == end) break;
    try {
      const warp::WarpPointer warp = warp::evaluateAt(script.warps[i], time);
      for (Vec3<double>& x : points) x = warp->position(x);
    } catch (Error& error) {
      throw std::move(error).at(fmt::format("warp[{}]", i)).in(script.path);
    }
  }
  return std::nullopt;
}

} // namespace surflect::evaluation
