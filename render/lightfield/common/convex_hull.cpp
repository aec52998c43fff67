#include "render/lightfield/common/convex_hull.h"

#include "surfel/base/error.h"

#include <libqhull_r/qhull_ra.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace surflect::lightfield {

namespace {

// Memory for what Qhull would print.
class Sink {
public:
  Sink() : stream_(::open_memstream(&text_, &size_)) {
    if (!stream_) throw Error("no memory for messages of Qhull");
  }
  ~Sink() {
    std::fclose(stream_);
    std::free(text_);
  }
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  std::FILE* stream() const { return stream_; }

private:
  char* text_ = nullptr;
  size_t size_ = 0;
  std::FILE* stream_;
};

} // namespace

std::vector<std::array<uint32_t, 3>> convexHull(std::span<const Vec3<double>> points) {
  std::vector<std::array<uint32_t, 3>> triangles;
  if (points.size() < 4) return triangles;
  std::vector<double> coordinates;
  for (const Vec3<double>& p : points) coordinates.insert(coordinates.end(), {p.x(), p.y(), p.z()});
  qhT state;
  qh_zero(&state, nullptr);
  // Qt: triangles only.
  char options[] = "qhull Qt";
  const Sink complaints;
  const int failed = qh_new_qhull(&state, 3, static_cast<int>(points.size()), coordinates.data(), False,
                                  options, complaints.stream(), complaints.stream());
  if (!failed) {
    qhT* qh = &state; // the macros expect this name
    facetT* facet;
    FORALLfacets {
      std::array<uint32_t, 3> corners{};
      vertexT *vertex, **vertexp;
      size_t count = 0;
      FOREACHvertex_(facet->vertices) if (count < 3) corners[count++] =
          static_cast<uint32_t>(qh_pointid(qh, vertex->point));
      if (facet->toporient ^ qh_ORIENTclock) std::swap(corners[1], corners[2]);
      triangles.push_back(corners);
    }
  }
  qh_freeqhull(&state, !qh_ALL);
  int inUse = 0, bytes = 0;
  qh_memfreeshort(&state, &inUse, &bytes);
  return triangles;
}

} // namespace surflect::lightfield
