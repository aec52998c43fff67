#include "render/lightfield/lumigraph/resample.h"

#include "render/lightfield/common/pull_push.h"
#include "srf/image/half_float.h"

#include <Eigen/Core>

#include <tbb/parallel_for.h>

#include <algorithm>

namespace surflect::lumigraph {

std::vector<Texel> Resampler::picture(const Slab& slab, int i, int j, Tally& tally,
                                      const Progress& progress) const {
  std::vector<Eigen::Vector4f> colors(slab.nodeTexels());
  std::vector<Sample::Kind> kinds(slab.nodeTexels());
  tbb::parallel_for(0, slab.height, [&](int row) {
    progress.checkpoint();
    for (int column = 0; column < slab.width; ++column) {
      const Sample sample =
          at(slab.lineOf({static_cast<double>(i), static_cast<double>(j), column + 0.5, row + 0.5}));
      const size_t texel = static_cast<size_t>(row) * slab.width + column;
      kinds[texel] = sample.kind;
      colors[texel] << sample.color, sample.kind == Sample::Kind::seen ? 1.f : 0.f;
    }
  });
  lightfield::pullPush(colors, slab.width, slab.height);
  std::vector<Texel> texels(slab.nodeTexels());
  for (size_t texel = 0; texel < texels.size(); ++texel) {
    for (int channel = 0; channel < 3; ++channel)
      texels[texel][channel] = image::finiteHalf(colors[texel][channel]);
    texels[texel][3] = image::nearestHalf(kinds[texel] == Sample::Kind::missed ? 0.f : 1.f);
  }
  tally.seen += std::ranges::count(kinds, Sample::Kind::seen);
  tally.unseen += std::ranges::count(kinds, Sample::Kind::unseen);
  tally.missed += std::ranges::count(kinds, Sample::Kind::missed);
  return texels;
}

} // namespace surflect::lumigraph
