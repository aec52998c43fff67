#include "render/surfels/patch_queries.h"

namespace surflect::surfels {

PatchQueries patchQueries(const Patches& patches, std::span<const uint32_t> visible,
                          const DeformedCloud& deformed) {
  PatchQueries queries;
  size_t next = 0; // patch after the last one that was asked
  for (uint32_t place = 0; place < visible.size(); ++place) {
    if (visible[place] < patches.first[next]) continue;
    while (patches.first[next] <= visible[place]) ++next;
    const uint32_t middle = patches.middle[next - 1];
    queries.surfels.push_back(deformed.handedness[middle] == Handedness::dead ? visible[place] : middle);
    queries.firstPlace.push_back(place);
  }
  queries.firstPlace.push_back(static_cast<uint32_t>(visible.size()));
  return queries;
}

void addPlaces(const PatchQueries& queries, std::span<const uint32_t> visible, size_t begin, size_t end,
               weights::QueryBatch& batch) {
  const uint32_t first = queries.firstPlace[begin], last = queries.firstPlace[end];
  batch.places.assign(visible.begin() + first, visible.begin() + last);
  batch.firstPlace.clear();
  for (size_t query = begin; query <= end; ++query)
    batch.firstPlace.push_back(queries.firstPlace[query] - first);
}

Patches patchesIn(const Cut& cut, const Patches& whole) {
  Patches patches;
  size_t next = 0; // patch of the whole cloud after the last one that has a piece
  for (uint32_t i = 0; i < cut.surfels.size(); ++i) {
    if (cut.surfels[i] < whole.first[next]) continue;
    while (whole.first[next] <= cut.surfels[i]) ++next;
    patches.first.push_back(i);
  }
  patches.first.push_back(static_cast<uint32_t>(cut.surfels.size()));
  for (size_t patch = 0; patch + 1 < patches.first.size(); ++patch)
    patches.middle.push_back((patches.first[patch] + patches.first[patch + 1]) / 2);
  return patches;
}

} // namespace surflect::surfels
