#include "srf/model/fade_file.h"

#include "surfel/error.h"

#include <zlib.h>

#include <cassert>
#include <string>

namespace surflect {

// Fades are few values in long runs once they stand view by view; deflate makes them small.
std::vector<std::byte> packFades(const ViewFades& fades) {
  const size_t surfels = fades.views ? fades.values.size() / fades.views : 0;
  std::vector<Bytef> byView;
  byView.reserve(fades.values.size());
  for (size_t view = 0; view < fades.views; ++view)
    for (size_t i = 0; i < surfels; ++i) byView.push_back(fades.values[i * fades.views + view]);
  std::vector<std::byte> packed(compressBound(byView.size()));
  uLongf size = packed.size();
  [[maybe_unused]] const int status =
      compress2(reinterpret_cast<Bytef*>(packed.data()), &size, byView.data(), byView.size(), 6);
  assert(status == Z_OK);
  packed.resize(size);
  return packed;
}

ViewFades unpackFades(std::span<const std::byte> packed, size_t surfels, size_t views) {
  const auto mismatch = [&] {
    return Error::mismatch("deflated fades of " + std::to_string(surfels) + " surfels x " +
                               std::to_string(views) + " views",
                           "other content");
  };
  constexpr size_t kDensest = 1032; // bytes that one byte of deflate can stand for
  const size_t most = kDensest * packed.size();
  if (views > 0 && surfels > most / views) throw mismatch();
  std::vector<Bytef> byView(surfels * views);
  uLongf size = byView.size();
  uLong used = packed.size();
  const int status = uncompress2(byView.data(), &size, reinterpret_cast<const Bytef*>(packed.data()), &used);
  if (status != Z_OK || size != byView.size() || used != packed.size()) throw mismatch();
  ViewFades fades{views, std::vector<uint8_t>(byView.size())};
  for (size_t i = 0; i < fades.values.size(); ++i) fades.values[i] = byView[i % views * surfels + i / views];
  return fades;
}

} // namespace surflect
