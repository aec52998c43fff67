#include "bench/accuracy/plate.h"

#include "srf/capture/writer.h"
#include "srf/model/pack.h"
#include "surfel/base/file.h"

#include <fmt/format.h>

namespace surflect::bench {

namespace fs = std::filesystem;

model::Model packPlate(const fs::path& folder, const capture::Camera<AcquisitionSpace>& camera,
                       std::span<const capture::Light> lights, std::span<const image::Image> photographs,
                       double halfSide, double z, size_t surfels) {
  fs::create_directories(folder);
  writeFileAtomically(folder / "plate.obj", fmt::format("v {0} {0} {1}\nv {2} {0} {1}\nv {2} {2} {1}\n"
                                                        "v {0} {2} {1}\nf 1 2 3 4\n",
                                                        -halfSide, z, halfSide));
  capture::Capture capture;
  capture.file = folder / "transforms.json";
  capture.colorSpace = capture::ColorSpace::linear;
  capture.geometry = "plate.obj";
  capture.lights.assign(lights.begin(), lights.end());
  capture.views.push_back({"C0", camera});
  std::vector<capture::RadianceLayer> layers;
  for (size_t i = 0; i < photographs.size(); ++i) {
    capture::Frame frame;
    if (!lights.empty()) frame.light = i;
    frame.picture = "C0.exr";
    frame.layer = fmt::format("L{}", i);
    layers.push_back({frame.layer, &photographs[i]});
    capture.frames.push_back(frame);
  }
  capture::writeViewPictures(folder / "C0.exr", layers);
  capture::writeCapture(capture, folder);

  model::PackOptions options;
  options.tolerance = 0;
  options.surfels = surfels;
  options.overwrite = true; // a model of an earlier run, whose photographs were replaced
  model::pack(capture, folder / "model.srf", options, {}, nullptr);
  return model::openModel(folder / "model.srf");
}

} // namespace surflect::bench
