#include "srf/import/colors_taken.h"

#include "srf/capture/picture_encoding.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"

#include <map>
#include <set>
#include <utility>

namespace surflect::importers {

namespace {

std::string formatDefault(int bits) {
  return bits == 0 ? "floating point that states nothing" : std::to_string(bits) + " bits that state nothing";
}

// Interpretation of a picture's colours, and its reason.
std::pair<std::string, std::string> colorsOf(const capture::Capture& capture,
                                             const std::filesystem::path& path) {
  const image::PictureHeader header = image::readPictureHeader(path);
  const auto& stated = header.color;
  const int bits = header.bits;
  if (capture.response) return {"the capture's response curve", "response"};
  const image::ColorEncoding encoding = capture::encodingOf(capture.colorSpace, stated, path);
  std::string word = stated ? stated->source : formatDefault(bits);
  if (capture.colorSpace) word = "color_space" + (stated ? ", over " + stated->source : "");
  return {image::described(encoding, capture::usualTransfer(bits)), word};
}

} // namespace

std::string colorsTaken(const capture::Capture& capture, const Progress& progress) {
  std::map<std::filesystem::path, std::set<std::string>> layersOf; // layers that frames use, by picture
  for (const capture::Frame& frame : capture.frames)
    for (const capture::Exposure& shot : capture::bracketOf(frame))
      layersOf[capture.folder() / shot.picture].insert(shot.layer);
  std::map<std::pair<std::string, std::string>, size_t> counts;
  size_t seen = 0;
  for (const auto& [path, layers] : layersOf) {
    progress("looking at colours", static_cast<double>(seen++) / static_cast<double>(layersOf.size()));
    if (image::formatOf(path) == image::PictureFormat::exr) {
      const image::ExrFile file(path);
      for (const std::string& layer : layers) image::colorChannels(file, layer); // throws if there are none
    }
    ++counts[colorsOf(capture, path)];
  }
  std::string text;
  for (const auto& [colors, count] : counts)
    text += (text.empty() ? "colour: " : ", ") + std::to_string(count) +
            (!text.empty() ? ""
             : count == 1  ? " picture"
                           : " pictures") +
            " as " + colors.first + " (" + colors.second + ")";
  return text;
}

} // namespace surflect::importers
