#include "srf/import/metashape.h"

#include "srf/import/masks.h"
#include "srf/import/similarity.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <pugixml.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string_view>

namespace surflect::importers {

namespace fs = std::filesystem;

namespace {

// ---------------------------------------------------------------------------------------------------------
// Elements and attributes.

std::string attributeOf(pugi::xml_node node, const char* name) { return node.attribute(name).value(); }

// "sensor \"2\"": an element with its id, or else its label, for messages.
std::string fieldOf(pugi::xml_node node) {
  const std::string id = attributeOf(node, node.attribute("id") ? "id" : "label");
  return std::string(node.name()) + (id.empty() ? "" : " " + shownText(id));
}

pugi::xml_node childOf(pugi::xml_node node, const char* name) {
  const pugi::xml_node child = node.child(name);
  if (!child) throw Error::mismatch("<" + std::string(name) + ">", "none").at(fieldOf(node));
  return child;
}

// Numbers of an element's text; `count` of them.
std::vector<double> numbersOf(pugi::xml_node node, size_t count) try {
  const std::vector<std::string_view> words = wordsOf(node.child_value());
  if (words.size() != count) throw Error::mismatch(counted(count, "number"), std::to_string(words.size()));
  std::vector<double> numbers;
  for (const std::string_view word : words) numbers.push_back(numberOf(word));
  return numbers;
} catch (Error& e) {
  throw std::move(e).at(node.name());
}

double numberIn(pugi::xml_node node, const char* name, double otherwise) {
  const pugi::xml_node child = node.child(name);
  return child ? numbersOf(child, 1)[0] : otherwise;
}

bool isEnabled(pugi::xml_node node) {
  const std::string word = lowerCase(attributeOf(node, "enabled"));
  return word != "false" && word != "0";
}

// ---------------------------------------------------------------------------------------------------------
// Lenses.

int pixelsOf(pugi::xml_node resolution, const char* name) try {
  return checkedPixelCount(numberOf(attributeOf(resolution, name)));
} catch (Error& e) {
  throw std::move(e).at("resolution." + std::string(name));
}

void requireFrame(pugi::xml_node node) {
  if (const std::string type = attributeOf(node, "type"); type != "frame")
    throw Error::mismatch("\"frame\" (let Metashape export undistorted photographs)", shownText(type))
        .at("type");
}

capture::Lens lensOf(pugi::xml_node sensor) try {
  requireFrame(sensor);
  pugi::xml_node calibration = childOf(sensor, "calibration"); // the first, or that of the alignment
  for (const pugi::xml_node other : sensor.children("calibration"))
    if (attributeOf(other, "class") == "adjusted") calibration = other;
  try {
    requireFrame(calibration);
    for (const char* const unsupported : {"k4", "p3", "p4", "b2", "skew"})
      if (const double value = numberIn(calibration, unsupported, 0); value != 0)
        throw Error::mismatch("0 (optimize cameras without it, or export undistorted photographs)",
                              numberText(value))
            .at(unsupported);
    const pugi::xml_node own = calibration.child("resolution"),
                         resolution = own ? own : childOf(sensor, "resolution");
    capture::Lens lens{.model = capture::Lens::Model::pinhole,
                       .width = pixelsOf(resolution, "width"),
                       .height = pixelsOf(resolution, "height")};
    const double f = numbersOf(childOf(calibration, "f"), 1)[0];
    lens.focalX = checkedFocalLength(f + numberIn(calibration, "b1", 0));
    lens.focalY = checkedFocalLength(f);
    lens.centerX = checkedCenter(lens.width / 2. + numberIn(calibration, "cx", 0));
    lens.centerY = checkedCenter(lens.height / 2. + numberIn(calibration, "cy", 0));
    lens.k1 = numberIn(calibration, "k1", 0);
    lens.k2 = numberIn(calibration, "k2", 0);
    lens.k3 = numberIn(calibration, "k3", 0);
    lens.p1 = numberIn(calibration, "p2", 0);
    lens.p2 = numberIn(calibration, "p1", 0);
    return lens;
  } catch (Error& e) {
    throw std::move(e).at("calibration");
  }
} catch (Error& e) {
  throw std::move(e).at(fieldOf(sensor));
}

// ---------------------------------------------------------------------------------------------------------
// Poses.

Mat3<double> matrixOf(const std::vector<double>& numbers, size_t stride) {
  Mat3<double> matrix;
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column)
      matrix(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
          numbers[stride * row + column];
  return matrix;
}

// Camera from chunk.
Rigid<CameraSpace, AcquisitionSpace> poseOf(pugi::xml_node transform, capture::RoundedRotations& rotations) {
  const std::vector<double> m = numbersOf(transform, 16);
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
    throw Error::mismatch("0 0 0 1 as the last row", numberText(m[12]) + " " + numberText(m[13]) + " " +
                                                         numberText(m[14]) + " " + numberText(m[15]))
        .at("transform");
  const Mat3<double> camera = matrixOf(m, 4).transpose();
  const Vec3<double> place(m[3], m[7], m[11]);
  try {
    return poseFromVisionAxes(camera, -(camera * place), rotations);
  } catch (Error& e) {
    throw std::move(e).at("transform");
  }
}

// World from chunk.
Similarity worldOf(pugi::xml_node transform, capture::RoundedRotations& rotations) try {
  Similarity similarity;
  similarity.rotation = rotations.nearest(matrixOf(numbersOf(childOf(transform, "rotation"), 9), 3));
  const std::vector<double> at = numbersOf(childOf(transform, "translation"), 3);
  similarity.translation = {at[0], at[1], at[2]};
  if (!(similarity.translation.norm() <= capture::kFarthest))
    throw Error::mismatch("a place within 1e12", numberText(similarity.translation.norm())).at("translation");
  similarity.scale = numberIn(transform, "scale", 1);
  if (!(similarity.scale >= 1e-12 && similarity.scale <= 1e12))
    throw Error::mismatch("a scale from 1e-12 to 1e12", numberText(similarity.scale)).at("scale");
  return similarity;
} catch (Error& e) {
  throw std::move(e).at("transform");
}

// ---------------------------------------------------------------------------------------------------------
// Photographs.

// Pictures below a folder by name, without masks.
class Photographs {
public:
  explicit Photographs(const SourceFiles& files) : files_(files) {
    for (const fs::path& picture : picturesBelow(files.root)) {
      const fs::path name = picture.lexically_relative(files.root);
      const auto isOfMasks = [](const fs::path& part) { return part == "masks" || part == "mask"; };
      if (std::ranges::any_of(name.parent_path(), isOfMasks) || isMaskName(name)) continue;
      byName_[name.filename().string()].push_back(picture);
      byName_[name.stem().string()].push_back(picture);
    }
  }

  fs::path of(const std::string& label, const std::string& group) const {
    std::string name = label;
    std::ranges::replace(name, '\\', '/');
    name = fs::path(name).filename().string(); // labels may be paths of another computer
    auto found = byName_.find(name);
    if (found == byName_.end())
      found = byName_.find(fs::path(name).stem().string()); // of another file format
    if (found == byName_.end())
      throw Error::mismatch("a photograph in " + files_.root.string() + " (--images says where they are)",
                            shownText(label));
    std::vector<fs::path> fitting = found->second;
    if (fitting.size() > 1 && !group.empty())
      std::erase_if(fitting,
                    [&](const fs::path& picture) { return picture.parent_path().filename() != group; });
    if (fitting.size() != 1) {
      std::vector<std::string> names;
      for (const fs::path& picture : found->second) names.push_back(files_.shown(picture));
      throw Error::mismatch(
          "a label of one photograph (rename the files, or name camera groups like folders)",
          shownText(label) + ", which fits " + firstNames(names));
    }
    files_.check(fitting[0]);
    return fitting[0];
  }

private:
  const SourceFiles& files_;
  std::map<std::string, std::vector<fs::path>> byName_;
};

// ---------------------------------------------------------------------------------------------------------
// Chunks.

struct Aligned {
  pugi::xml_node camera;
  std::string group;
};

// Cameras that were aligned with each other: those of a component, or of a chunk without components.
struct Part {
  pugi::xml_node chunk;
  std::string component; // id; empty: none
  std::vector<Aligned> cameras;

  pugi::xml_node transform() const {
    for (const pugi::xml_node other : chunk.child("components").children("component"))
      if (attributeOf(other, "id") == component && other.child("transform")) return other.child("transform");
    return chunk.child("transform");
  }
  std::string name() const {
    return "chunk " + shownText(attributeOf(chunk, "label")) +
           (component.empty() ? "" : ", component " + shownText(component));
  }
};

struct Counts {
  size_t disabled = 0, unaligned = 0, slaves = 0; // slaves: posed by their master alone

  std::string text() const {
    return std::to_string(disabled) + " disabled, " + std::to_string(unaligned) + " not aligned" +
           (slaves > 0
                ? ", " + std::to_string(slaves) + " of a multi-camera system without poses of their own"
                : "");
  }
};

// Cameras of a chunk or of a group, which hold no groups.
void addCameras(pugi::xml_node folder, const std::string& group, std::map<std::string, Part>& parts,
                Counts& counts) {
  for (const pugi::xml_node camera : folder.children("camera"))
    if (!isEnabled(camera))
      ++counts.disabled;
    else if (!camera.child("transform"))
      ++(camera.attribute("master_id") ? counts.slaves : counts.unaligned);
    else
      parts[attributeOf(camera, "component_id")].cameras.push_back({camera, group});
}

std::vector<Part> partsOf(pugi::xml_node document, const std::vector<std::string>& chunks, Counts& counts) {
  std::vector<Part> all;
  std::vector<std::string> labels;
  for (const pugi::xml_node chunk : document.children("chunk")) {
    labels.push_back(attributeOf(chunk, "label"));
    const bool isNamed = std::ranges::find(chunks, labels.back()) != chunks.end();
    if (chunks.empty() ? !isEnabled(chunk) : !isNamed) continue;
    std::map<std::string, Part> parts;
    const pugi::xml_node cameras = chunk.child("cameras");
    addCameras(cameras, "", parts, counts);
    for (const pugi::xml_node group : cameras.children("group"))
      addCameras(group, attributeOf(group, "label"), parts, counts);
    for (auto& [component, part] : parts) {
      part.chunk = chunk, part.component = component;
      all.push_back(std::move(part));
    }
  }
  for (const std::string& wanted : chunks)
    if (std::ranges::find(labels, wanted) == labels.end()) {
      const std::vector<std::string_view> known(labels.begin(), labels.end());
      throw Error::mismatch(known.empty()
                                ? "a chunk, of which there is none"
                                : "one of the chunks " + firstNames(labels) + didYouMean(wanted, known),
                            shownText(wanted))
          .at("--chunks");
    }
  return all;
}

// Leaves the largest part, unless chunks were named: then all must lead to one world.
void choose(std::vector<Part>& parts, bool areNamed, std::vector<std::string>& notes) {
  if (parts.size() < 2) return;
  if (areNamed) {
    for (const Part& part : parts)
      if (!part.transform())
        throw Error("has no transform to the world of the others; let Metashape align the chunks")
            .at(part.name());
    return;
  }
  const auto largest =
      std::ranges::max_element(parts, {}, [](const Part& part) { return part.cameras.size(); });
  std::vector<std::string> others;
  for (const Part& part : parts)
    if (&part != &*largest) others.push_back(part.name() + " (" + std::to_string(part.cameras.size()) + ")");
  notes.push_back("warning: of " + std::to_string(parts.size()) +
                  " parts with poses of their own the largest is taken, " + largest->name() + " (" +
                  counted(largest->cameras.size(), "camera") + "); left out: " + firstNames(others) +
                  "; --chunks takes those that Metashape has aligned with each other");
  parts = {*largest};
}

} // namespace

ForeignCapture readMetashape(const fs::path& file, const MetashapeOptions& options) try {
  const std::string content = readFile(file);
  pugi::xml_document xml;
  if (const pugi::xml_parse_result result = xml.load_buffer(content.data(), content.size()); !result)
    throw Error("found no complete XML (" + lowerCase(result.description()) + ")")
        .at("line " + std::to_string(1 + std::count(content.begin(), content.begin() + result.offset, '\n')));
  const pugi::xml_node document = xml.child("document");
  if (!document)
    throw Error::mismatch("<document> of Metashape's \"Export Cameras\"",
                          "<" + shownText(xml.first_child().name()) + ">");

  ForeignCapture source;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  source.files = {!options.images.empty()       ? options.images
                  : isFolder(folder / "images") ? folder / "images"
                                                : folder,
                  options.allowOutside};
  if (!isFolder(source.files.root))
    throw Error::mismatch("a folder of photographs", source.files.root.string()).at("--images");
  if (!source.files.root.has_filename()) source.files.root = source.files.root.parent_path(); // "images_2/"
  const fs::path& root = source.files.root;
  for (const auto& found : {maskFoldersIn(root.parent_path(), root.filename().string()),
                            maskFoldersIn(folder), maskFoldersIn(root)})
    source.maskFolders.insert(source.maskFolders.end(), found.begin(), found.end());

  Counts counts;
  std::vector<Part> parts = partsOf(document, options.chunks, counts);
  if (parts.empty())
    throw Error::mismatch("cameras with a <transform> in an enabled chunk", "none; " + counts.text());
  choose(parts, !options.chunks.empty(), source.notes);

  const Photographs photographs(source.files);
  capture::RoundedRotations rotations;
  std::set<fs::path> taken;
  std::vector<fs::path> names;
  for (const Part& part : parts) try {
      std::map<std::string, pugi::xml_node> sensors;
      for (const pugi::xml_node sensor : part.chunk.child("sensors").children("sensor"))
        if (!sensors.emplace(attributeOf(sensor, "id"), sensor).second)
          throw Error("is listed twice").at(fieldOf(sensor));
      std::map<std::string, capture::Lens> lenses;
      std::optional<Similarity> world;
      if (const pugi::xml_node transform = part.transform()) world = worldOf(transform, rotations);
      if (!world)
        source.notes.push_back(part.name() + " has no transform: scale and axes are Metashape's own");
      if (const std::string reference = part.chunk.child_value("reference");
          !reference.empty() && !reference.starts_with("LOCAL_CS"))
        source.notes.push_back(
            "warning: " + part.name() +
            " is georeferenced: poses are in metres from the middle of the earth, and so must a mesh be "
            "(export it in geocentric coordinates)");
      for (const auto& [camera, group] : part.cameras) try {
          const std::string id = attributeOf(camera, "sensor_id");
          const auto sensor = sensors.find(id);
          if (sensor == sensors.end()) throw Error::mismatch("a sensor's id", shownText(id)).at("sensor_id");
          auto lens = lenses.find(id);
          if (lens == lenses.end()) lens = lenses.emplace(id, lensOf(sensor->second)).first;
          auto pose = poseOf(camera.child("transform"), rotations);
          if (world) pose = moved(pose, *world);
          const fs::path picture = photographs.of(attributeOf(camera, "label"), group);
          if (!taken.insert(picture).second)
            throw Error("found " + shownText(source.files.shown(picture)) + " a second time");
          source.capture.frames.push_back({.view = source.capture.views.size(), .picture = picture});
          source.capture.views.push_back({"", {lens->second, pose}});
          names.push_back(picture.lexically_relative(root));
        } catch (Error& e) {
          throw std::move(e).at(fieldOf(camera));
        }
    } catch (Error& e) {
      throw std::move(e).at("chunk " + shownText(attributeOf(part.chunk, "label")));
    }
  const std::vector<std::string> identities = namesOfPictures(names);
  for (size_t i = 0; i < names.size(); ++i) source.capture.views[i].identity = identities[i];

  source.notes.push_back(
      "Metashape: " + counted(names.size(), "aligned camera") +
      (counts.disabled + counts.unaligned + counts.slaves > 0 ? "; left out: " + counts.text() : ""));
  for (std::string& note : rotations.notes()) source.notes.push_back(std::move(note));
  return source;
} catch (Error& e) {
  throw std::move(e).in(file);
}

} // namespace surflect::importers
