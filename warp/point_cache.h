// Point caches: files with the positions of a mesh's vertices at many times, in MDD or PC2.
#pragma once

#include "surfel/base/file.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace surflect::warp {

// Layout of the files; all numbers have four bytes.
//   MDD, the most significant byte first: number of samples, number of points, the time of each sample in
//   seconds, then x y z of each point, sample by sample.
//   PC2, the least significant byte first: "POINTCACHE2\0", version 1, number of points, first frame, frames
//   per sample, number of samples; then x y z as in MDD.
class PointCache {
public:
  enum class Format { mdd, pc2 }; // a PC2 is known by its first bytes

  // Reads all samples once. Throws Error unless the file has `points` points, rising times and as many bytes
  // as it states, and for positions that are not finite.
  PointCache(const std::filesystem::path& path, size_t points);

  Format format() const { return format_; }
  const std::filesystem::path& path() const { return file_.path(); }
  // When the samples are: seconds in MDD, frames in PC2.
  const std::vector<double>& times() const { return times_; }
  // Positions of all points. Reads from the file; throws Error if the file has changed since it was opened.
  std::vector<Vec3<double>> positions(size_t sample) const;
  uint64_t contentHash() const { return hash_; }

private:
  void readMddTimes();
  void readPc2Times();
  void requireCounts(uint64_t samples, uint64_t points, uint64_t headerBytes);

  OpenFile file_;
  size_t points_;
  Format format_ = Format::mdd;
  uint64_t firstByte_ = 0; // of the positions
  std::vector<double> times_;
  uint64_t hash_ = 0;
};

} // namespace surflect::warp
