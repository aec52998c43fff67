#include "render/lightfield/olf/triangle_blends.h"

#include "render/lightfield/lfm/rings.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
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

void requireTriangulable(const VisibleViews& visible, size_t mostBytes) {
  const size_t vertices = visible.first.size() - 1;
  size_t most = 0;
  for (size_t vertex = 0; vertex < vertices; ++vertex)
    most = std::max<size_t>(most, visible.first[vertex + 1] - visible.first[vertex]);
  if (most > ViewTriangulation::kMostViews)
    throw Error::mismatch(fmt::format("{} at most", ViewTriangulation::kMostViews), std::to_string(most))
        .at("views of a vertex");
  const size_t bytes = visible.views.size() * ViewTriangulation::kBytesOfView;
  if (bytes > mostBytes)
    throw Error(
        fmt::format("triangulations of the views of {} vertices take {} MiB, expected {} at most: take "
                    "fewer triangles",
                    vertices, bytes >> 20, mostBytes >> 20))
        .at("mesh");
}

ViewBlender::ViewBlender(const OpacityField& field, const Progress& progress) : field_(field) {
  const lfm::Rings rings(field.mesh, progress);
  vertices_.assign(rings.vertices().begin(), rings.vertices().end());
  corners_.assign(rings.corners().begin(), rings.corners().end());
  for (const auto& camera : field.cameras) centers_.push_back(camera.center().raw());
  const bool isTriangulated = field.method == Blending::vdtm;
  if (isTriangulated) requireTriangulable(field.visible);
  const size_t vertices = field.mesh.positions.size();
  std::vector<std::optional<ViewTriangulation>> triangulations(isTriangulated ? vertices : 0);
  if (!isTriangulated) directions_.resize(field.visible.views.size());
  progress("view directions", 0);
  tbb::parallel_for(size_t{0}, vertices, [&](size_t vertex) {
    const size_t first = field.visible.first[vertex];
    const std::span<const uint32_t> views = field.visible.of(static_cast<uint32_t>(vertex));
    const Vec3<double> p = field.mesh.positions[vertex].cast<double>().raw();
    thread_local std::vector<Vec3<double>> directions;
    directions.clear();
    for (const uint32_t view : views) directions.push_back((centers_[view] - p).normalized());
    if (isTriangulated)
      triangulations[vertex].emplace(directions, rings.frame(static_cast<uint32_t>(vertex)), field.domain);
    else
      std::ranges::copy(directions, directions_.begin() + static_cast<std::ptrdiff_t>(first));
  });
  progress.checkpoint();
  triangulations_.reserve(triangulations.size());
  for (auto& triangulation : triangulations) triangulations_.push_back(std::move(*triangulation));
}

ClosestViews ViewBlender::closest(uint32_t vertex, const Vec3<double>& viewer) const {
  const size_t first = field_.visible.first[vertex];
  const std::span<const uint32_t> views = field_.visible.of(vertex);
  const Vec3<double> p = field_.mesh.positions[vertex].cast<double>().raw();
  // A viewer at the vertex sees it from no direction: its first view answers.
  const Vec3<double> d =
      (viewer == p ? Vec3<double>(centers_[views[0]] - p) : Vec3<double>(viewer - p)).normalized();
  ClosestViews closest;
  if (field_.method == Blending::vdtm) {
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

std::vector<TriangleBlend> ViewBlender::blends(const Vec3<double>& viewer,
                                               std::map<std::string, double>* seconds,
                                               const Progress& progress) const {
  Stopwatch stopwatch;
  const auto lap = [&](const char* stage) {
    if (seconds) (*seconds)[stage] += stopwatch.seconds();
    stopwatch = {};
  };
  std::vector<ClosestViews> ofVertex(field_.mesh.positions.size());
  tbb::parallel_for(size_t{0}, vertices_.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    ofVertex[vertices_[i]] = closest(vertices_[i], viewer);
  });
  lap("closest views");
  std::vector<TriangleBlend> blends(field_.mesh.triangles.size());
  tbb::parallel_for(size_t{0}, blends.size(), [&](size_t t) {
    progress.checkNowAndThen(t);
    const auto& [a, b, c] = corners_[t];
    blends[t] = combined({ofVertex[a], ofVertex[b], ofVertex[c]});
  });
  lap("blends");
  return blends;
}

std::map<std::string, size_t> ViewBlender::bytes() const {
  const auto bytesOf = [](const auto& values) { return std::span(values).size_bytes(); };
  size_t triangulations = 0;
  for (const ViewTriangulation& triangulation : triangulations_) triangulations += triangulation.bytes();
  return {{"triangulation_bytes", triangulations},
          {"direction_bytes", bytesOf(directions_) + bytesOf(centers_)},
          {"visible_view_bytes", bytesOf(field_.visible.first) + bytesOf(field_.visible.views)},
          {"corner_bytes", bytesOf(vertices_) + bytesOf(corners_)}};
}

} // namespace surflect::olf
