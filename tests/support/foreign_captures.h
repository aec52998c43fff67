// A lit capture in the formats of other programs, to test importers.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "tests/support/vision_camera.h"

#include <filesystem>
#include <string>
#include <vector>

namespace surflect {

// A view and two photographs of it: RGBA, sRGB, straight alpha.
struct ForeignView {
  std::string name; // of files, without extension
  VisionCamera camera;
  image::Image underAll; // all lights at once: fixed illumination
  image::Image underOne; // the lamp alone
  Vec3<double> lamp;     // position, 100 units from the origin
};

// Views first, first + every, .. without those that lack training photographs. Lights must be directional.
// The lamp of a view is its light nearest to the direction above the photographer's right shoulder.
std::vector<ForeignView> photographedByOthers(const capture::Capture& capture, size_t first, size_t every);

// Each writes a folder with pictures as PNG, without geometry.

// RGB over black, masks beside; cameras.bin, images.bin, or both as text.
void writeColmap(const std::vector<ForeignView>& views, const std::filesystem::path& folder, bool binary);
// cameras.xml, RGBA in photographs/.
void writeMetashape(const std::vector<ForeignView>& views, const std::filesystem::path& folder);
// transforms.json, RGBA.
void writeNerfstudio(const std::vector<ForeignView>& views, const std::filesystem::path& folder);
// NRHints: transforms_train.json, RGBA, each photograph under its own lamp.
void writeRelighting(const std::vector<ForeignView>& views, const std::filesystem::path& folder);
// vase_par.txt, RGB over black without masks.
void writeMiddlebury(const std::vector<ForeignView>& views, const std::filesystem::path& folder);

// Backgrounds of photographs without masks.
enum class Backdrop {
  table, // brown, with texture, another for each view; the object's shadow lies on it
  screen // green, unevenly lit
};
// COLMAP's text; photographs with noise before a backdrop, 6 % brighter than its plates, which are in
// plates/. The objects' alphas are in truth/.
void writeBeforeBackdrop(const std::vector<ForeignView>& views, Backdrop backdrop,
                         const std::filesystem::path& folder);

// Mistakes: poses that are y up where the mesh is z up, and lamps mirrored in y.
std::vector<ForeignView> withYUp(std::vector<ForeignView> views);
std::vector<ForeignView> withMirroredLamps(std::vector<ForeignView> views);

} // namespace surflect
