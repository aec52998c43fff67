#include "render/lightfield/olf/triangle_blends.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

namespace surflect::olf {

TriangleBlend combined(const std::array<ClosestViews, 3>& corners) {
  TriangleBlend blend;
  for (size_t corner = 0; corner < 3; ++corner)
    for (const auto& [view, weight] : corners[corner]) {
      if (weight == 0) continue;
      const auto end = blend.views.begin() + blend.count;
      const auto at = static_cast<size_t>(std::find(blend.views.begin(), end, view) - blend.views.begin());
      if (at == blend.count) blend.views[blend.count++] = view;
      blend.weights[corner][at] = static_cast<float>(weight);
    }
  return blend;
}

ViewBlender::ViewBlender(const OpacityField& field, const Progress& progress)
    : field_(field), rings_(field.mesh, progress), directions_(field.visible.views.size()) {
  for (const auto& camera : field.cameras) centers_.push_back(camera.center().raw());
  const size_t vertices = field.mesh.positions.size();
  const bool isTriangulated = field.method == Method::vdtm;
  std::vector<std::optional<ViewTriangulation>> triangulations(isTriangulated ? vertices : 0);
  progress("view directions", 0);
  tbb::parallel_for(size_t{0}, vertices, [&](size_t vertex) {
    const size_t first = field.visible.first[vertex], end = field.visible.first[vertex + 1];
    const Vec3<double> p = field.mesh.positions[vertex].cast<double>().raw();
    for (size_t i = first; i < end; ++i) directions_[i] = (centers_[field.visible.views[i]] - p).normalized();
    if (isTriangulated)
      triangulations[vertex].emplace(std::span(directions_).subspan(first, end - first),
                                     rings_.frame(static_cast<uint32_t>(vertex)), field.domain);
  });
  progress.checkpoint();
  for (auto& triangulation : triangulations) triangulations_.push_back(std::move(*triangulation));
}

ClosestViews ViewBlender::closest(uint32_t vertex, const Vec3<double>& viewer) const {
  const size_t first = field_.visible.first[vertex];
  const std::span<const uint32_t> views = field_.visible.of(vertex);
  const Vec3<double> d = (viewer - field_.mesh.positions[vertex].cast<double>().raw()).normalized();
  ClosestViews closest;
  if (field_.method == Method::vdtm) {
    closest = triangulations_[vertex].at(d);
  } else {
    thread_local std::vector<double> penalties;
    penalties.clear();
    for (size_t i = 0; i < views.size(); ++i)
      penalties.push_back((directions_[first + i] - d).squaredNorm() / 2); // Eq. 2, precise for small angles
    closest = ulrViews(penalties);
  }
  for (WeightedView& view : closest) view.view = views[view.view];
  return closest;
}

std::vector<TriangleBlend> ViewBlender::blends(const Vec3<double>& viewer) const {
  std::vector<ClosestViews> ofVertex(field_.mesh.positions.size());
  const auto vertices = rings_.vertices();
  tbb::parallel_for(size_t{0}, vertices.size(),
                    [&](size_t i) { ofVertex[vertices[i]] = closest(vertices[i], viewer); });
  std::vector<TriangleBlend> blends(field_.mesh.triangles.size());
  tbb::parallel_for(size_t{0}, blends.size(), [&](size_t t) {
    const auto& [a, b, c] = rings_.corners()[t];
    blends[t] = combined({ofVertex[a], ofVertex[b], ofVertex[c]});
  });
  return blends;
}

size_t ViewBlender::bytes() const {
  size_t sum = directions_.size() * sizeof(Vec3<double>);
  for (const ViewTriangulation& triangulation : triangulations_) sum += triangulation.bytes();
  return sum;
}

} // namespace surflect::olf
