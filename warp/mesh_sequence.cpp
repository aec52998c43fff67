#include "warp/mesh_sequence.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace surflect::warp {

namespace {

// A pattern's name: what stands before its run of #, the run's length, and what stands after it.
struct Pattern {
  std::string before;
  size_t width = 0;
  std::string after;
};

Pattern patternOf(const std::string& name) {
  const size_t begin = name.find('#'), end = std::min(name.find_first_not_of('#', begin), name.size());
  if (begin == std::string::npos || name.find('#', end) != std::string::npos)
    throw Error::mismatch("a name such as \"cage.####.obj\"", '"' + name + '"');
  return {name.substr(0, begin), end - begin, name.substr(end)};
}

// Digits in a file name where the pattern has #, however many.
std::optional<std::string> digitsIn(const std::string& name, const Pattern& pattern) {
  if (name.size() <= pattern.before.size() + pattern.after.size() || !name.starts_with(pattern.before) ||
      !name.ends_with(pattern.after))
    return std::nullopt;
  const std::string digits =
      name.substr(pattern.before.size(), name.size() - pattern.before.size() - pattern.after.size());
  if (digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;
  return digits;
}

// Returns whether a number of these digits is written so when padded with zeros to this width.
bool isPadded(const std::string& digits, size_t width) {
  return digits.size() == width || (digits.size() > width && digits[0] != '0');
}

std::map<int, std::filesystem::path> keysOf(const std::filesystem::path& frames) {
  const Pattern pattern = patternOf(frames.filename().string());
  std::map<int, std::filesystem::path> keys;
  std::string unlike; // a file of another padding
  std::error_code error;
  const std::filesystem::path folder = frames.has_parent_path() ? frames.parent_path() : ".";
  for (std::filesystem::directory_iterator entry(folder, error), last; !error && entry != last;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const auto digits = digitsIn(name, pattern);
    if (digits && isPadded(*digits, pattern.width))
      keys.emplace(std::stoi(*digits), entry->path());
    else if (digits)
      unlike = std::max(unlike, name);
  }
  if (error) throw Error("cannot list the folder (" + error.message() + ')').in(folder);
  if (keys.empty())
    throw Error::mismatch("files of this name",
                          unlike.empty() ? "none" : "none, but " + unlike + ": write one # for each digit")
        .in(frames);
  return keys;
}

std::vector<Vec3<double>> positionsOf(const TriangleMesh& mesh) {
  std::vector<Vec3<double>> positions;
  for (const auto& p : mesh.positions) positions.push_back(p.raw().cast<double>());
  return positions;
}

MeshField fieldOf(const TriangleMesh& rest, const std::filesystem::path& path) {
  try {
    return MeshField(positionsOf(rest), rest.triangles);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

uint64_t fileHash(const std::filesystem::path& path) { return surflect::contentHash(readFile(path)); }

// Largest distance of points from those at rest.
template <class Turn>
double distanceFrom(const std::vector<Vec3<double>>& rest, const std::vector<Vec3<double>>& points,
                    const Turn& turn) {
  double most = 0;
  for (size_t i = 0; i < rest.size(); ++i) most = std::max(most, (turn(points[i]) - rest[i]).norm());
  return most;
}

// Largest distance of points that count as the same.
double toleranceOf(const std::vector<Vec3<double>>& points) {
  constexpr double kSame = 1e-4; // of the size of the mesh
  Eigen::AlignedBox3d box;
  for (const Vec3<double>& x : points) box.extend(x);
  return kSame * box.diagonal().norm();
}

// MeshSequence::displacement. The similarity is that of Umeyama 1991.
std::optional<std::string> displacementOf(const std::vector<Vec3<double>>& rest,
                                          const std::vector<Vec3<double>>& points) {
  const double tolerance = toleranceOf(rest);
  if (distanceFrom(rest, points, [](const Vec3<double>& x) { return x; }) <= tolerance) return std::nullopt;
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  Columns from(3, static_cast<Eigen::Index>(rest.size())), to = from;
  for (size_t i = 0; i < rest.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = rest[i];
    to.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  const Eigen::Matrix4d similarity = Eigen::umeyama(from, to);
  const double scale = similarity.topLeftCorner<3, 1>().norm();
  if (!(scale > 0)) return std::nullopt;
  const Mat3<double> rotation = similarity.topLeftCorner<3, 3>() / scale;
  const auto rested = [&](const Vec3<double>& x) -> Vec3<double> {
    return rotation.transpose() * (x - similarity.topRightCorner<3, 1>()) / scale;
  };
  if (!(distanceFrom(rest, points, rested) <= tolerance)) return std::nullopt;
  const double degrees = Eigen::AngleAxisd(rotation).angle() * 180 / std::numbers::pi;
  const double moved = (to.rowwise().mean() - from.rowwise().mean()).norm();
  std::string text;
  const auto add = [&](const std::string& change) { text += (text.empty() ? "" : ", ") + change; };
  if (degrees > 0.01) add(fmt::format("turned by {:.1f} degrees", degrees));
  if (std::abs(scale - 1) > 1e-4) add(fmt::format("scaled by {:.4g}", scale));
  if (moved > tolerance) add(fmt::format("moved by {:.4g}", moved));
  return text;
}

// Throws Error if the points are those at rest with other axes: exporters exchange y and z, or turn z up to y
// up. Points in another pose pass.
void requireAxesOf(const std::vector<Vec3<double>>& rest, const std::vector<Vec3<double>>& points) {
  const double tolerance = toleranceOf(rest);
  using Turn = Vec3<double> (*)(const Vec3<double>&);
  constexpr std::array<std::pair<Turn, const char*>, 3> turns{{{[](const Vec3<double>& x) -> Vec3<double> {
                                                                  return {x[0], -x[2], x[1]};
                                                                },
                                                                "(x, z, -y), y up"},
                                                               {[](const Vec3<double>& x) -> Vec3<double> {
                                                                  return {x[0], x[2], -x[1]};
                                                                },
                                                                "(x, -z, y)"},
                                                               {[](const Vec3<double>& x) -> Vec3<double> {
                                                                  return {x[0], x[2], x[1]};
                                                                },
                                                                "(x, z, y)"}}};
  if (distanceFrom(rest, points, [](const Vec3<double>& x) { return x; }) <= tolerance) return;
  for (const auto& [turn, name] : turns)
    if (distanceFrom(rest, points, turn) <= tolerance)
      throw Error::mismatch("the rest mesh's axes, (x, y, z): export without a change of axes",
                            "its points as " + std::string(name))
          .at("sample[0]");
}

void checkTopology(const TriangleMesh& mesh, const TriangleMesh& rest) {
  const auto check = [](size_t found, size_t expected, const char* field) {
    if (found != expected)
      throw Error::mismatch(std::to_string(expected) + " as at rest", std::to_string(found)).at(field);
  };
  check(mesh.positions.size(), rest.positions.size(), "vertices");
  check(mesh.triangles.size(), rest.triangles.size(), "triangles");
  for (size_t i = 0; i < mesh.triangles.size(); ++i)
    if (mesh.triangles[i] != rest.triangles[i])
      throw Error::mismatch("the corners it has at rest", "other corners")
          .at("triangle[" + std::to_string(i) + "]");
}

} // namespace

MeshSequence::MeshSequence(const std::filesystem::path& rest, const Vec3<double>& origin)
    : origin_(origin), rest_(readMeshAsStored(rest, {Faces::asFans, origin})),
      field_(fieldOf(readMeshAsStored(rest, {.origin = origin}), rest)) {}

MeshSequence::MeshSequence(const std::filesystem::path& rest, const std::filesystem::path& frames,
                           const Vec3<double>& origin)
    : MeshSequence(rest, origin) {
  std::string hashes = hex(fileHash(rest));
  for (const auto& [key, path] : keysOf(frames)) {
    times_.push_back(key);
    files_.push_back(path);
    positionsAt(files_.size() - 1); // throws before the first frame
    hashes += ' ' + std::to_string(key) + ' ' + hex(fileHash(path));
  }
  hash_ = surflect::contentHash(std::as_bytes(std::span(hashes)));
}

MeshSequence MeshSequence::ofCache(const std::filesystem::path& rest, const std::filesystem::path& cache) {
  MeshSequence sequence(rest, Vec3<double>::Zero());
  sequence.cache_.emplace(cache, sequence.rest_.positions.size());
  sequence.times_ = sequence.cache_->times();
  const std::vector<Vec3<double>> rested = positionsOf(sequence.rest_), first = sequence.positionsAt(0);
  inFile(cache, [&] { requireAxesOf(rested, first); });
  sequence.displacement_ = displacementOf(rested, first);
  sequence.hash_ = surflect::contentHash(hex(fileHash(rest)) + ' ' + hex(sequence.cache_->contentHash()));
  return sequence;
}

std::vector<Vec3<double>> MeshSequence::positionsAt(size_t key) const {
  if (cache_) return cache_->positions(key);
  const std::filesystem::path& path = files_[key];
  const TriangleMesh mesh = readMeshAsStored(path, {Faces::asFans, origin_});
  try {
    checkTopology(mesh, rest_);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
  return positionsOf(mesh);
}

WarpPointer MeshSequence::at(double time) const {
  const auto next = static_cast<size_t>(std::ranges::upper_bound(times_, time) - times_.begin());
  if (next == 0) return field_.follow(positionsAt(0));
  const double from = times_[next - 1];
  std::vector<Vec3<double>> positions = positionsAt(next - 1);
  if (next < times_.size() && time > from) {
    const double share = (time - from) / (times_[next] - from);
    const std::vector<Vec3<double>> later = positionsAt(next);
    for (size_t i = 0; i < positions.size(); ++i)
      positions[i] = (1 - share) * positions[i] + share * later[i];
  }
  return field_.follow(positions);
}

} // namespace surflect::warp
