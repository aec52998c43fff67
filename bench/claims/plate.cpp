#include "bench/claims/plate.h"

#include "srf/capture/writer.h"
#include "srf/model/pack.h"
#include "surfel/base/file.h"

#include <fmt/format.h>

namespace surflect {

namespace fs = std::filesystem;

Model packPlate(const fs::path& folder, const Camera<AcquisitionSpace>& camera, std::span<const Light> lights,
                std::span<const Image> photographs, double halfSide, double z, size_t surfels) {
  fs::create_directories(folder);
  writeFileAtomically(folder / "plate.obj", fmt::format("v {0} {0} {1}\nv {2} {0} {1}\nv {2} {2} {1}\n"
                                                        "v {0} {2} {1}\nf 1 2 3 4\n",
                                                        -halfSide, z, halfSide));
  Capture capture;
  capture.file = folder / "transforms.json";
  capture.colorSpace = ColorSpace::linear;
  capture.geometry = "plate.obj";
  capture.lights.assign(lights.begin(), lights.end());
  capture.views.push_back({"C0", camera});
  std::vector<RadianceLayer> layers;
  for (size_t i = 0; i < photographs.size(); ++i) {
    Frame frame;
    if (!lights.empty()) frame.light = i;
    frame.picture = "C0.exr";
    frame.layer = fmt::format("L{}", i);
    layers.push_back({frame.layer, &photographs[i]});
    capture.frames.push_back(frame);
  }
  writeViewPictures(folder / "C0.exr", layers);
  writeCapture(capture, folder);

  PackOptions options;
  options.tolerance = 0;
  options.surfels = surfels;
  options.overwrite = true; // that of an earlier run, of photographs written anew
  pack(capture, folder / "model.srf", options, {}, nullptr);
  return openModel(folder / "model.srf");
}

} // namespace surflect
