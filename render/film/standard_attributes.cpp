#include "render/film/standard_attributes.h"

#include "render/film/video.h"
#include "render/scene/scene.h"
#include "surfel/base/version.h"

#include <Eigen/Dense>
#include <fmt/format.h>

namespace surflect::film {

namespace {

using Matrix = Eigen::Matrix4d; // acts on columns

image::RowMatrix asRows(const Matrix& columns) {
  image::RowMatrix rows;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      rows[static_cast<size_t>(row)][static_cast<size_t>(column)] = static_cast<float>(columns(column, row));
  return rows;
}

// Our camera axes have z backwards.
Matrix columnsToCamera(const capture::Camera<ObjectSpace>& camera) {
  Matrix matrix = Matrix::Identity();
  matrix.topLeftCorner<3, 3>() = camera.cameraFromWorld.rotation();
  matrix.topRightCorner<3, 1>() = camera.cameraFromWorld.translation();
  matrix.row(2) *= -1;
  return matrix;
}

} // namespace

image::RowMatrix worldToCamera(const capture::Camera<ObjectSpace>& camera) {
  return asRows(columnsToCamera(camera));
}

std::optional<image::RowMatrix> worldToNdc(const capture::Camera<ObjectSpace>& camera) {
  const capture::Lens& lens = camera.lens;
  if (lens.distorts()) return std::nullopt;
  const double w = lens.width, h = lens.height;
  Matrix ndcFromCamera; // camera space with z ahead
  if (lens.model == capture::Lens::Model::pinhole)
    ndcFromCamera << lens.focalX / w, 0, lens.centerX / w, 0, //
        0, -lens.focalY / h, lens.centerY / h, 0,             //
        0, 0, 1, -1,                                          //
        0, 0, 1, 0;
  else
    ndcFromCamera << lens.focalX / w, 0, 0, lens.centerX / w, //
        0, -lens.focalY / h, 0, lens.centerY / h,             //
        0, 0, 1, 0,                                           //
        0, 0, 0, 1;
  return asRows(ndcFromCamera * columnsToCamera(camera));
}

image::ExrAttributes standardAttributes(const capture::Camera<ObjectSpace>& camera,
                                        const scene::Script& script, int frame) {
  image::ExrAttributes attributes{{"worldToCamera", worldToCamera(camera)},
                                  {"framesPerSecond", frameRate(script.frames->fps)},
                                  {"imageCounter", frame},
                                  {"software", std::string("surflect ") + kVersion}};
  if (const auto ndc = worldToNdc(camera)) attributes["worldToNDC"] = *ndc;
  const capture::Lens& lens = camera.lens;
  if (lens.model == capture::Lens::Model::pinhole && !lens.distorts()) {
    // Pixels are as high as 1 / fy at depth 1, and as wide as 1 / fx.
    attributes["screenWindowWidth"] = static_cast<float>(lens.width / lens.focalX);
    attributes["screenWindowCenter"] =
        image::Pair{static_cast<float>((lens.width / 2.0 - lens.centerX) / lens.focalX),
                    static_cast<float>((lens.centerY - lens.height / 2.0) / lens.focalY)};
    attributes["pixelAspectRatio"] = static_cast<float>(lens.focalY / lens.focalX);
  }
  if (!script.output->owner.empty()) attributes["owner"] = script.output->owner;
  return attributes;
}

image::ExrAttributes frameAttributes(const capture::Camera<ObjectSpace>& camera, const scene::Script& script,
                                     int frame) {
  image::ExrAttributes attributes = standardAttributes(camera, script, frame);
  attributes["surflect.version"] = std::string(kVersion);
  attributes["surflect.frame"] = std::to_string(frame);
  const auto stops = scene::exposureAt(script, scene::shotTime(script, frame));
  if (stops) attributes["surflect.exposure"] = fmt::format("{}", *stops);
  return attributes;
}

} // namespace surflect::film
