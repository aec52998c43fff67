#include "srf/import/colmap.h"

#include "srf/import/masks.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>

namespace surflect::importers {

namespace fs = std::filesystem;

namespace {

// Models in the order of COLMAP's numbers, from 0 [COLMAP, src/colmap/sensor/models/base.h].
struct Model {
  std::string_view name;
  size_t parameters;
  bool isOurs = false; // representable by our lenses
};
constexpr std::array kModels{Model{"SIMPLE_PINHOLE", 3, true},
                             Model{"PINHOLE", 4, true},
                             Model{"SIMPLE_RADIAL", 4, true},
                             Model{"RADIAL", 5, true},
                             Model{"OPENCV", 8, true},
                             Model{"OPENCV_FISHEYE", 8},
                             Model{"FULL_OPENCV", 12, true},
                             Model{"FOV", 5},
                             Model{"SIMPLE_RADIAL_FISHEYE", 4},
                             Model{"RADIAL_FISHEYE", 5},
                             Model{"THIN_PRISM_FISHEYE", 12},
                             Model{"RAD_TAN_THIN_PRISM_FISHEYE", 16},
                             Model{"SIMPLE_DIVISION", 4},
                             Model{"DIVISION", 5},
                             Model{"SIMPLE_FISHEYE", 3},
                             Model{"FISHEYE", 4},
                             Model{"EUCM", 6},
                             Model{"EQUIRECTANGULAR", 2}};

constexpr std::string_view kKnown =
    "SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV (undistort the pictures with COLMAP first)";

using Cameras = std::map<uint32_t, capture::Lens>;

struct Registered {
  std::string name;
  uint32_t camera = 0;
  Rigid<CameraSpace, AcquisitionSpace> cameraFromWorld;
};

// Pose by COLMAP's QW QX QY QZ TX TY TZ.
Rigid<CameraSpace, AcquisitionSpace> poseOf(const std::array<double, 7>& v,
                                            capture::RoundedRotations& rotations) {
  const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
  const double deviation = std::abs(q.norm() - 1);
  if (!(deviation <= 2e-3)) // rounding to three decimals; at most 1e-3 by it
    throw Error::mismatch("a unit quaternion", "length " + numberText(q.norm())).at("QW QX QY QZ");
  rotations.count(deviation);
  return poseFromVisionAxes(q.normalized().toRotationMatrix(), {v[4], v[5], v[6]}, rotations);
}

void addCamera(Cameras& cameras, uint32_t id, const capture::Lens& lens) {
  if (!cameras.try_emplace(id, lens).second) throw Error("a second camera has this CAMERA_ID");
}

std::string numbered(const char* list, uint64_t index) {
  return std::string(list).append("[").append(std::to_string(index)).append("]");
}

// ---------------------------------------------------------------------------------------------------------
// Text.

std::vector<double> numbersOf(std::span<const std::string_view> words) {
  std::vector<double> numbers;
  for (const std::string_view word : words) numbers.push_back(numberOf(word));
  return numbers;
}

// Checks a count against COLMAP's comment, "# Number of cameras: 3", if there is one: the file may be
// truncated.
void checkCount(const std::string& content, std::string_view things, size_t found) {
  const std::string label = "Number of " + std::string(things) + ":";
  for (const TextLine& line : linesOf(content)) {
    const size_t at = line.text.starts_with("#") ? line.text.find(label) : std::string_view::npos;
    if (at == std::string_view::npos) continue;
    const std::vector<std::string_view> words = wordsOf(line.text.substr(at + label.size()), ",");
    if (words.empty() || words[0].find_first_not_of("0123456789") != std::string_view::npos) continue;
    if (countOf(words[0]) != found)
      throw Error::mismatch(std::string(words[0]) + ", as " + fieldOf(line) + " says",
                            std::to_string(found) + " " + std::string(things));
  }
}

Cameras readCamerasText(const std::string& content) {
  Cameras cameras;
  for (const TextLine& line : sayingLinesOf(content)) try {
      const std::vector<std::string_view> words = wordsOf(line.text);
      if (words.size() < 4)
        throw Error::mismatch("CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", shownText(line.text));
      const capture::Lens lens =
          colmapLens(words[1], checkedPixelCount(numberOf(words[2])), checkedPixelCount(numberOf(words[3])),
                     numbersOf(std::span(words).subspan(4)));
      addCamera(cameras, static_cast<uint32_t>(countOf(words[0])), lens);
    } catch (Error& e) {
      throw std::move(e).at(fieldOf(line));
    }
  checkCount(content, "cameras", cameras.size());
  return cameras;
}

Registered registeredIn(std::string_view text, capture::RoundedRotations& rotations) {
  constexpr const char* expected = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME";
  const std::vector<std::string_view> words = wordsOf(text);
  if (words.size() < 10) throw Error::mismatch(expected, shownText(text));
  std::array<double, 7> pose;
  for (size_t i = 0; i < pose.size(); ++i) pose[i] = numberOf(words[i + 1]);
  Registered image;
  image.name = text.substr(static_cast<size_t>(words[9].data() - text.data())); // names may contain blanks
  image.camera = static_cast<uint32_t>(countOf(words[8]));
  image.cameraFromWorld = poseOf(pose, rotations);
  return image;
}

// Checks lines of points, which are not used: a line with other content means a damaged file.
void checkPoints(std::string_view text) {
  const std::vector<std::string_view> words = wordsOf(text);
  if (words.size() % 3 != 0 || !areNumbers(words))
    throw Error::mismatch("the picture's points, (X, Y, POINT3D_ID) each, or an empty line", shownText(text));
}

std::vector<Registered> readImagesText(const std::string& content, capture::RoundedRotations& rotations) {
  const std::vector<TextLine> lines = linesOf(content);
  std::vector<Registered> images;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].text.empty() || lines[i].text.front() == '#') continue;
    try {
      images.push_back(registeredIn(lines[i].text, rotations));
    } catch (Error& e) {
      throw std::move(e).at(fieldOf(lines[i]));
    }
    if (++i == lines.size()) break; // editors remove the last empty line of points
    try {
      checkPoints(lines[i].text);
    } catch (Error& e) {
      throw std::move(e).at(fieldOf(lines[i]));
    }
  }
  checkCount(content, "images", images.size());
  return images;
}

// ---------------------------------------------------------------------------------------------------------
// Binary, little-endian.

static_assert(std::endian::native == std::endian::little);

class Bytes {
public:
  explicit Bytes(std::string_view file) : rest_(file), size_(file.size()) {}

  template <class T> T take(const char* field) {
    T value;
    std::memcpy(&value, bytes(sizeof value, field).data(), sizeof value);
    return value;
  }
  // Number of following records of at least `recordBytes` bytes each.
  uint64_t takeCount(const char* field, size_t recordBytes) {
    const auto count = take<uint64_t>(field);
    if (count > rest_.size() / recordBytes)
      throw Error::mismatch("at most " + std::to_string(rest_.size() / recordBytes) +
                                ", as the file has no room for more",
                            std::to_string(count))
          .at(field);
    return count;
  }
  std::string_view takeText(const char* field) {
    const size_t end = rest_.find('\0');
    if (end == std::string_view::npos) throw truncated(field);
    const std::string_view text = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return text;
  }
  void skip(size_t count, const char* field) { bytes(count, field); }
  void finish() const {
    if (!rest_.empty())
      throw Error::mismatch("the end of the file", std::to_string(rest_.size()) + " more bytes");
  }

private:
  std::string_view bytes(size_t count, const char* field) {
    if (rest_.size() < count) throw truncated(field);
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  Error truncated(const char* field) const {
    return Error("the file is truncated, at byte " + std::to_string(size_)).at(field);
  }

  std::string_view rest_;
  size_t size_;
};

Cameras readCamerasBinary(const std::string& content) {
  Bytes bytes(content);
  Cameras cameras;
  const uint64_t count = bytes.takeCount("num_cameras", 4 + 4 + 8 + 8 + 2 * 8);
  for (uint64_t i = 0; i < count; ++i) try {
      const auto id = bytes.take<uint32_t>("camera_id");
      const auto model = bytes.take<uint32_t>("model_id");
      const auto width = bytes.take<uint64_t>("width"), height = bytes.take<uint64_t>("height");
      if (model >= kModels.size())
        throw Error::mismatch(kKnown, "model number " + std::to_string(model)).at("model_id");
      std::vector<double> parameters(kModels[model].parameters);
      for (double& parameter : parameters) parameter = bytes.take<double>("params");
      addCamera(cameras, id,
                colmapLens(kModels[model].name, checkedPixelCount(static_cast<double>(width)),
                           checkedPixelCount(static_cast<double>(height)), parameters));
    } catch (Error& e) {
      throw std::move(e).at(numbered("cameras", i));
    }
  bytes.finish();
  return cameras;
}

std::vector<Registered> readImagesBinary(const std::string& content, capture::RoundedRotations& rotations) {
  Bytes bytes(content);
  std::vector<Registered> images;
  const uint64_t count = bytes.takeCount("num_reg_images", 4 + 7 * 8 + 4 + 1 + 8);
  for (uint64_t i = 0; i < count; ++i) try {
      bytes.take<uint32_t>("image_id");
      std::array<double, 7> pose;
      for (double& value : pose) value = bytes.take<double>("qvec tvec");
      Registered image;
      image.cameraFromWorld = poseOf(pose, rotations);
      image.camera = bytes.take<uint32_t>("camera_id");
      image.name = bytes.takeText("name");
      constexpr size_t pointBytes = 8 + 8 + 8;
      bytes.skip(bytes.takeCount("num_points2D", pointBytes) * pointBytes, "points2D");
      images.push_back(std::move(image));
    } catch (Error& e) {
      throw std::move(e).at(numbered("images", i));
    }
  bytes.finish();
  return images;
}

// ---------------------------------------------------------------------------------------------------------

template <class Read> auto readAt(const fs::path& file, Read read) {
  try {
    return read(readFile(file));
  } catch (Error& e) {
    throw std::move(e).in(file);
  }
}

fs::path imagesFileOf(const fs::path& model) {
  return model / (isFile(model / "cameras.bin") ? "images.bin" : "images.txt");
}

// Registered pictures of a model.
struct Reconstruction {
  fs::path folder;
  std::vector<Registered> images;
  capture::RoundedRotations rotations;
};

Reconstruction readReconstruction(const fs::path& folder) {
  Reconstruction model{folder, {}, {}};
  const fs::path file = imagesFileOf(folder);
  model.images = readAt(file, [&](const std::string& content) {
    return file.extension() == ".bin" ? readImagesBinary(content, model.rotations)
                                      : readImagesText(content, model.rotations);
  });
  return model;
}

// COLMAP writes a model for each part of the photographs that it cannot connect: sparse/0, sparse/1, .. in
// any order of size. Notes name the smaller ones.
Reconstruction largestModel(const std::vector<fs::path>& models, const fs::path& folder,
                            std::vector<std::string>& notes) {
  if (models.empty()) throw Error("no cameras.bin or cameras.txt here or in sparse/0").in(folder);
  if (models.size() == 1) return readReconstruction(models[0]);
  std::vector<std::string> sizes;
  Reconstruction best;
  size_t largest = 0;
  for (size_t m = 0; m < models.size(); ++m) try {
      Reconstruction model = readReconstruction(models[m]);
      sizes.push_back(std::to_string(model.images.size()) + " photographs");
      if (model.images.size() > best.images.size()) largest = m, best = std::move(model);
    } catch (const Error& e) {
      sizes.push_back("cannot be read: " + std::string(e.what()));
    }
  if (best.images.empty()) return readReconstruction(models[0]); // throws if it cannot be read
  std::string others;
  for (size_t m = 0; m < models.size(); ++m)
    if (m != largest) others += (others.empty() ? "" : ", ") + models[m].string() + " (" + sizes[m] + ")";
  notes.push_back("of " + std::to_string(models.size()) + " COLMAP models the largest is taken, " +
                  models[largest].string() + " (" + sizes[largest] + "); left out: " + others);
  return best;
}

} // namespace

capture::Lens colmapLens(std::string_view model, int width, int height, std::span<const double> parameters) {
  const auto known =
      std::find_if(kModels.begin(), kModels.end(), [&](const Model& m) { return m.name == model; });
  if (known == kModels.end()) throw Error::mismatch(kKnown, shownText(model)).at("MODEL");
  if (!known->isOurs) throw Error::mismatch(kKnown, std::string(model)).at("MODEL");
  if (parameters.size() != known->parameters)
    throw Error::mismatch(std::to_string(known->parameters) + " of " + std::string(model),
                          std::to_string(parameters.size()))
        .at("PARAMS");
  for (const double parameter : parameters)
    if (!std::isfinite(parameter)) throw Error("found a value that is not finite").at("PARAMS");

  capture::Lens lens{.model = capture::Lens::Model::pinhole, .width = width, .height = height};
  const bool oneFocal = model.starts_with("SIMPLE_") || model == "RADIAL";
  lens.focalX = checkedFocalLength(parameters[0]);
  lens.focalY = checkedFocalLength(parameters[oneFocal ? 0 : 1]);
  const auto rest = parameters.subspan(oneFocal ? 1 : 2);
  lens.centerX = checkedCenter(rest[0]), lens.centerY = checkedCenter(rest[1]);
  if (model == "SIMPLE_PINHOLE" || model == "PINHOLE") return lens;
  lens.k1 = rest[2];
  if (model == "SIMPLE_RADIAL") return lens;
  lens.k2 = rest[3];
  if (model == "RADIAL") return lens;
  lens.p1 = rest[4], lens.p2 = rest[5];
  const auto further = rest.subspan(model == "FULL_OPENCV" ? 7 : 6);
  if (model == "FULL_OPENCV") lens.k3 = rest[6];
  if (std::any_of(further.begin(), further.end(), [](double k) { return k != 0; }))
    throw Error::mismatch(kKnown, std::string(model) + " with k4 to k6 that are not 0").at("MODEL");
  return lens;
}

std::vector<fs::path> findColmapModels(const fs::path& folder) {
  std::vector<fs::path> folders{folder};
  for (const char* below : {"sparse", "colmap/sparse"}) {
    std::vector<fs::path> inside;
    std::error_code problem;
    for (fs::directory_iterator entry(folder / below, problem), end; !problem && entry != end;
         entry.increment(problem))
      if (!isHidden(entry->path())) inside.push_back(entry->path());
    std::ranges::sort(inside, naturallyBefore, [](const fs::path& path) { return path.string(); });
    folders.insert(folders.end(), inside.begin(), inside.end());
    folders.push_back(folder / below);
  }
  std::erase_if(folders, [](const fs::path& model) {
    return !isFile(model / "cameras.bin") && !isFile(model / "cameras.txt");
  });
  // A table of one's own may be called cameras.txt too.
  const auto isWhole = [](const fs::path& model) { return isFile(imagesFileOf(model)); };
  if (std::ranges::any_of(folders, isWhole)) std::erase_if(folders, std::not_fn(isWhole));
  return folders;
}

ForeignCapture readColmap(const fs::path& folder, const fs::path& images, bool allowOutside) {
  ForeignCapture source;
  auto [model, registered, rotations] = largestModel(findColmapModels(folder), folder, source.notes);
  const bool binary = isFile(model / "cameras.bin");
  const fs::path camerasFile = model / (binary ? "cameras.bin" : "cameras.txt"),
                 imagesFile = imagesFileOf(model);
  const Cameras cameras = readAt(camerasFile, binary ? readCamerasBinary : readCamerasText);
  if (registered.empty()) throw Error("no picture is registered").in(imagesFile);
  // COLMAP numbers pictures in the order in which threads finish them.
  std::sort(registered.begin(), registered.end(),
            [](const Registered& a, const Registered& b) { return a.name < b.name; });

  source.files = {images.empty() ? folder / "images" : images, allowOutside};
  if (!isFolder(source.files.root))
    throw Error("no such folder; --images says where the pictures are").in(source.files.root);
  if (!source.files.root.has_filename()) source.files.root = source.files.root.parent_path(); // "images_2/"
  const fs::path& root = source.files.root;
  for (const auto& found : {maskFoldersIn(root.parent_path(), root.filename().string()),
                            maskFoldersIn(folder), maskFoldersIn(root)})
    source.maskFolders.insert(source.maskFolders.end(), found.begin(), found.end());
  std::vector<fs::path> names;
  for (const Registered& image : registered) names.emplace_back(image.name);
  const std::vector<std::string> identities = namesOfPictures(names);
  for (size_t i = 0; i < registered.size(); ++i) try {
      const auto lens = cameras.find(registered[i].camera);
      if (lens == cameras.end())
        throw Error::mismatch("a camera of " + camerasFile.filename().string(),
                              std::to_string(registered[i].camera))
            .at("CAMERA_ID");
      if (i > 0 && registered[i].name == registered[i - 1].name) throw Error("is listed twice");
      capture::Frame frame{.view = i, .picture = source.files.at(registered[i].name)};
      source.capture.views.push_back({identities[i], {lens->second, registered[i].cameraFromWorld}});
      source.capture.frames.push_back(std::move(frame));
    } catch (Error& e) {
      throw std::move(e).at("picture " + shownText(registered[i].name)).in(imagesFile);
    }
  source.notes.push_back("COLMAP's model in " + model.string() + (binary ? ", binary" : ", text") +
                         "; scale and orientation of its world are kept");
  for (std::string& note : rotations.notes()) source.notes.push_back(std::move(note));
  return source;
}

} // namespace surflect::importers
