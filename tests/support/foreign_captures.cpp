#include "tests/support/foreign_captures.h"

#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "srf/image/image.h"
#include "srf/image/png.h"
#include "surfel/base/file.h"
#include "tests/support/foreign_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace surflect {

namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

constexpr double kLampDistance = 100;

Vec3<double> towardsOf(const capture::Capture& capture, size_t frame) {
  return std::get<capture::DirectionalLight>(capture.lights[*capture.frames[frame].light].kind).towards.raw();
}

// Seen from the origin.
Vec3<double> aboveRightShoulder(const capture::Camera<AcquisitionSpace>& camera) {
  return camera.cameraFromWorld.rotation().transpose() * Vec3<double>(0.6, 0.7, 1).normalized();
}

// Straight alpha, linear light.
image::Image rgbaOf(const capture::Photograph& photograph) {
  image::Image rgba(photograph.alpha.width, photograph.alpha.height, 4);
  for (size_t pixel = 0; pixel < photograph.alpha.values.size(); ++pixel) {
    std::copy_n(&photograph.radiance.values[3 * pixel], 3, &rgba.values[4 * pixel]);
    rgba.values[4 * pixel + 3] = photograph.alpha.values[pixel];
  }
  return rgba;
}

// sRGB, with one exposure for all: 2 % of the object's pixels are white.
void expose(std::vector<ForeignView>& views, image::Image ForeignView::*image) {
  image::PercentileCounter counter;
  for (const ForeignView& view : views) {
    const std::vector<float>& values = (view.*image).values;
    for (size_t i = 0; i < values.size(); i += 4)
      if (values[i + 3] > 0.5f) counter.add(image::luma({values[i], values[i + 1], values[i + 2]}));
  }
  const auto exposure = static_cast<float>(1 / counter.percentile(0.98));
  for (ForeignView& view : views) {
    std::vector<float>& values = (view.*image).values;
    for (size_t i = 0; i < values.size(); ++i)
      if (i % 4 != 3) values[i] = image::srgbFromLinear(std::max(0.f, exposure * values[i]));
  }
}

// Picture over black.
image::Image overBlack(const image::Image& rgba) {
  image::Image rgb(rgba.width, rgba.height, 3);
  for (size_t i = 0; i < rgb.values.size(); ++i)
    rgb.values[i] = image::srgbFromLinear(
        rgba.values[i / 3 * 4 + 3] * std::min(1.f, image::linearFromSrgb(rgba.values[i / 3 * 4 + i % 3])));
  return rgb;
}

image::Image alphaOf(const image::Image& rgba) {
  image::Image alpha(rgba.width, rgba.height, 1);
  for (size_t i = 0; i < alpha.values.size(); ++i) alpha.values[i] = rgba.values[4 * i + 3];
  return alpha;
}

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  writeFileAtomically(path, text);
}
void write(const fs::path& path, const image::Image& image) {
  fs::create_directories(path.parent_path());
  image::writePng(path, image);
}

// Linear light of the backdrop of a view.
std::array<double, 3> backdropAt(Backdrop backdrop, double phase, double x, double y) {
  if (backdrop == Backdrop::screen) {
    const double light = 1 - 0.4 * std::hypot(x - 0.3, y - 0.2);
    return {0.05 * light, 0.42 * light, 0.09 * light};
  }
  const double grain = 1 + 0.3 * std::sin(90 * y + 3 * std::sin(7 * x + phase)) * std::cos(31 * x + phase) +
                       0.15 * std::sin(140 * x - 55 * y + 5 * phase);
  const double light = grain * (0.6 + 0.4 * x);
  return {0.42 * light, 0.27 * light, 0.15 * light};
}

// Share of light that the object's shadow leaves, on the table beside it.
double shadeAt(double x, double y) {
  const double distance = std::hypot((x - 0.68) / 0.22, (y - 0.72) / 0.1);
  return 1 - 0.55 * std::clamp(2 - 2 * distance, 0.0, 1.0);
}

// Picture of 8 bits with noise that is equally large at the root of every value.
class NoisyPicture {
public:
  NoisyPicture(int width, int height, unsigned seed) : image(width, height, 3), random_(seed) {}
  void set(int x, int y, size_t channel, double linear) {
    const double root = std::sqrt(std::max(0.0, linear)) + noise_(random_);
    image.at(x, y)[channel] =
        std::min(1.f, image::srgbFromLinear(static_cast<float>(root > 0 ? root * root : 0)));
  }

  image::Image image;

private:
  std::mt19937 random_;
  std::normal_distribution<double> noise_{0, 0.006};
};

} // namespace

std::vector<ForeignView> photographedByOthers(const capture::Capture& capture, size_t first, size_t every) {
  std::vector<ForeignView> views;
  for (size_t v = first; v < capture.views.size(); v += every) {
    const capture::View& view = capture.views[v];
    std::vector<size_t> frames;
    for (size_t f = 0; f < capture.frames.size(); ++f)
      if (capture.frames[f].view == v && capture.frames[f].split == capture::Split::train)
        frames.push_back(f);
    if (frames.empty()) continue;
    const std::vector<capture::Photograph> photographs = capture::readPhotographs(capture, frames);
    image::Image all = rgbaOf(photographs[0]);
    for (size_t i = 1; i < photographs.size(); ++i)
      for (size_t k = 0; k < photographs[i].radiance.values.size(); ++k)
        all.values[k / 3 * 4 + k % 3] += photographs[i].radiance.values[k];
    const Vec3<double> shoulder = aboveRightShoulder(view.camera);
    const auto nearest = static_cast<size_t>(
        std::ranges::max_element(frames, {}, [&](size_t f) { return towardsOf(capture, f).dot(shoulder); }) -
        frames.begin());
    views.push_back({view.identity, visionCameraOf(view.camera), std::move(all), rgbaOf(photographs[nearest]),
                     kLampDistance * towardsOf(capture, frames[nearest])});
  }
  expose(views, &ForeignView::underAll);
  expose(views, &ForeignView::underOne);
  return views;
}

void writeColmap(const std::vector<ForeignView>& views, const fs::path& folder, bool binary) {
  std::vector<ColmapImage> images;
  for (const ForeignView& view : views) {
    images.push_back({view.name + ".png", "PINHOLE", view.camera});
    write(folder / "images" / images.back().name, overBlack(view.underAll));
    write(folder / "masks" / (images.back().name + ".png"), alphaOf(view.underAll));
  }
  const fs::path model = folder / "sparse/0";
  if (binary) {
    write(model / "cameras.bin", colmapCamerasBinary(images));
    write(model / "images.bin", colmapImagesBinary(images));
  } else {
    write(model / "cameras.txt", colmapCamerasText(images));
    write(model / "images.txt", colmapImagesText(images));
  }
}

void writeBeforeBackdrop(const std::vector<ForeignView>& views, Backdrop backdrop, const fs::path& folder) {
  constexpr double kBrighter = 1.06;
  std::vector<ColmapImage> images;
  for (size_t v = 0; v < views.size(); ++v) {
    const image::Image& object = views[v].underAll;
    NoisyPicture photograph(object.width, object.height, static_cast<unsigned>(2 * v)),
        plate(object.width, object.height, static_cast<unsigned>(2 * v + 1));
    for (int y = 0; y < object.height; ++y)
      for (int x = 0; x < object.width; ++x) {
        const double right = (x + 0.5) / object.width, down = (y + 0.5) / object.height;
        const auto behind = backdropAt(backdrop, static_cast<double>(v), right, down);
        const double alpha = static_cast<double>(object.at(x, y)[3]),
                     shade = backdrop == Backdrop::table ? shadeAt(right, down) : 1;
        for (size_t c = 0; c < 3; ++c) {
          const auto front = static_cast<double>(image::linearFromSrgb(object.at(x, y)[c]));
          photograph.set(x, y, c, alpha * front + (1 - alpha) * shade * behind[c]);
          plate.set(x, y, c, behind[c] / kBrighter);
        }
      }
    images.push_back({views[v].name + ".png", "PINHOLE", views[v].camera});
    write(folder / "images" / images.back().name, photograph.image);
    write(folder / "plates" / images.back().name, plate.image);
    write(folder / "truth" / images.back().name, alphaOf(object));
  }
  write(folder / "sparse/0/cameras.txt", colmapCamerasText(images));
  write(folder / "sparse/0/images.txt", colmapImagesText(images));
}

void writeMetashape(const std::vector<ForeignView>& views, const fs::path& folder) {
  std::vector<std::pair<std::string, VisionCamera>> cameras;
  for (const ForeignView& view : views) {
    cameras.emplace_back(view.name, view.camera);
    write(folder / "photographs" / (view.name + ".png"), view.underAll);
  }
  write(folder / "cameras.xml", metashapeDocument(metashapeChunk({}, cameras)));
}

void writeNerfstudio(const std::vector<ForeignView>& views, const fs::path& folder) {
  const VisionCamera& camera = views.at(0).camera; // of one lens all
  Json json{{"camera_model", "OPENCV"}, {"w", camera.width}, {"h", camera.height}, {"fl_x", camera.fx},
            {"fl_y", camera.fy},        {"cx", camera.cx},   {"cy", camera.cy},    {"frames", Json::array()}};
  for (const ForeignView& view : views) {
    const std::string file = "images/" + view.name + ".png";
    write(folder / file, view.underAll);
    json["frames"].push_back({{"file_path", file}, {"transform_matrix", openGlMatrixOf(view.camera)}});
  }
  write(folder / "transforms.json", json.dump(1));
}

void writeRelighting(const std::vector<ForeignView>& views, const fs::path& folder) {
  const VisionCamera& camera = views.at(0).camera;
  Json json{{"camera_intrinsics", {camera.cx, camera.cy, camera.fx, camera.fy}}, {"frames", Json::array()}};
  for (const ForeignView& view : views) {
    write(folder / "train" / (view.name + ".png"), view.underOne);
    const double intensity = kLampDistance * kLampDistance;
    json["frames"].push_back({{"file_path", "./train/" + view.name},
                              {"file_ext", ".png"},
                              {"transform_matrix", openGlMatrixOf(view.camera)},
                              {"pl_pos", {view.lamp[0], view.lamp[1], view.lamp[2]}},
                              {"pl_intensity", {intensity, intensity, intensity}}});
  }
  write(folder / "transforms_train.json", json.dump(1));
}

void writeMiddlebury(const std::vector<ForeignView>& views, const fs::path& folder) {
  std::string text = std::to_string(views.size()) + "\n";
  for (const ForeignView& view : views) {
    VisionCamera camera = view.camera;
    camera.cx -= 0.5, camera.cy -= 0.5; // centres at whole numbers
    text += middleburyLine(view.name + ".png", camera);
    write(folder / (view.name + ".png"), overBlack(view.underAll));
  }
  write(folder / "vase_par.txt", text);
}

std::vector<ForeignView> withYUp(std::vector<ForeignView> views) {
  const Eigen::Quaterniond quarterTurn(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3<double>::UnitX()));
  for (ForeignView& view : views) view.camera.rotation = view.camera.rotation * quarterTurn;
  return views;
}

std::vector<ForeignView> withMirroredLamps(std::vector<ForeignView> views) {
  for (ForeignView& view : views) view.lamp[1] *= -1;
  return views;
}

} // namespace surflect
