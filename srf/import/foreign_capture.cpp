#include "srf/import/foreign_capture.h"

#include "srf/capture/file_names.h"
#include "srf/capture/rig.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace surflect::importers {

namespace fs = std::filesystem;

std::optional<fs::path> SourceFiles::find(std::string_view written) const {
  const auto isControl = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
  if (written.empty() || written.size() > 4096 || std::any_of(written.begin(), written.end(), isControl))
    throw Error::mismatch("a file's name", shownText(written));
  std::string slashes(written);
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  for (const fs::path& name : {fs::path(written), fs::path(slashes)}) {
    const fs::path file = root / name; // an absolute name replaces the root
    if (!isFile(file)) continue;
    check(file);
    return file;
  }
  return std::nullopt;
}

fs::path SourceFiles::at(std::string_view written) const {
  if (auto file = find(written)) return *std::move(file);
  std::string slashes(written);
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  const auto similar = capture::similarFile(root, slashes);
  throw Error::mismatch("a file in " + (root.empty() ? "." : root.string()) +
                            (similar ? " (there is " + similar->string() + ")" : ""),
                        shownText(written));
}

void SourceFiles::check(const fs::path& file) const {
  if (allowOutside) return;
  std::error_code problem;
  const fs::path folder = fs::canonical(root.empty() ? "." : root, problem),
                 place = problem ? fs::path() : fs::canonical(file, problem);
  if (problem) throw Error("cannot open (" + problem.message() + ")").in(file);
  if (std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first != folder.end())
    throw Error("found " + shownText(file.string()) + ", which leaves the folder " + folder.string() +
                "; --allow-outside lets it");
}

std::string SourceFiles::shown(const fs::path& file) const {
  const fs::path whole = file.lexically_normal(), from = root.lexically_normal();
  for (const fs::path& folder : {from, from.parent_path()}) {
    const fs::path inner = whole.lexically_relative(folder);
    if (!inner.empty() && *inner.begin() != "..") return inner.string();
  }
  return file.string();
}

Rigid<CameraSpace, AcquisitionSpace> poseFromVisionAxes(const Mat3<double>& rotation,
                                                        const Vec3<double>& translation,
                                                        capture::RoundedRotations& rotations) {
  if (!rotation.allFinite() || !translation.allFinite()) throw Error("the pose is not finite");
  if (!(translation.norm() <= capture::kFarthest)) // bounds the camera's position too
    throw Error::mismatch("a translation within 1e12", "a longer one");
  const Vec3<double> flip(1, -1, -1); // x right, y up, looking along -z
  return {flip.asDiagonal() * rotations.nearest(rotation), flip.cwiseProduct(translation)};
}

std::vector<std::string> namesOfPictures(const std::vector<fs::path>& pictures) {
  std::set<std::string> different;
  std::vector<std::string> names;
  for (fs::path picture : pictures) {
    names.push_back(picture.replace_extension().generic_string());
    different.insert(names.back());
  }
  if (different.size() == pictures.size()) return names;
  names.clear();
  for (const fs::path& picture : pictures) names.push_back(picture.generic_string());
  return names;
}

double checkedFocalLength(double pixels) {
  if (!(pixels >= 1e-12 && pixels <= 1e12))
    throw Error::mismatch("a focal length above 0 (1e-12 to 1e12)", numberText(pixels));
  return pixels;
}

double checkedCenter(double pixels) {
  if (!(std::abs(pixels) <= capture::kFarthest))
    throw Error::mismatch("a principal point within 1e12", "one farther out");
  return pixels;
}

int checkedPixelCount(double pixels) {
  constexpr int most = 1 << 16;
  if (!(pixels >= 1 && pixels <= most && pixels == std::floor(pixels)))
    throw Error::mismatch("pixels, a whole number from 1 to " + std::to_string(most), numberText(pixels));
  return static_cast<int>(pixels);
}

} // namespace surflect::importers
