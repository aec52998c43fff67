// Files of other programs, as text and bytes, for cameras in computer vision's axes.
#pragma once

#include "tests/support/vision_camera.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace surflect {

// ---------------------------------------------------------------------------------------------------------
// COLMAP. [https://colmap.github.io/format.html, https://colmap.github.io/cameras.html]

inline constexpr std::array colmapModels{"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL",
                                         "RADIAL",         "OPENCV",  "FULL_OPENCV"};

struct ColmapImage {
  std::string name;
  std::string model;
  VisionCamera camera;
};

// The parameters of a camera in COLMAP's order, and the camera as far as the model can say it.
inline std::pair<std::vector<double>, VisionCamera> asColmapModel(const std::string& model, VisionCamera c) {
  if (model != "PINHOLE" && model != "OPENCV" && model != "FULL_OPENCV") c.fy = c.fx;
  if (model != "FULL_OPENCV") c.k3 = 0;
  if (model.ends_with("PINHOLE")) c.k1 = c.k2 = c.p1 = c.p2 = 0;
  if (model.ends_with("RADIAL")) c.p1 = c.p2 = 0;
  if (model == "SIMPLE_RADIAL") c.k2 = 0;
  const std::map<std::string, std::vector<double>> parameters{
      {"SIMPLE_PINHOLE", {c.fx, c.cx, c.cy}},
      {"PINHOLE", {c.fx, c.fy, c.cx, c.cy}},
      {"SIMPLE_RADIAL", {c.fx, c.cx, c.cy, c.k1}},
      {"RADIAL", {c.fx, c.cx, c.cy, c.k1, c.k2}},
      {"OPENCV", {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2}},
      {"FULL_OPENCV", {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, 0, 0, 0}}};
  return {parameters.at(model), c};
}

// Numbers of COLMAP's cameras, which need be neither consecutive nor in order.
inline uint32_t colmapCameraId(size_t i) { return static_cast<uint32_t>(1000 - 7 * i); }

inline std::string colmapCamerasText(const std::vector<ColmapImage>& images) {
  std::string text = "# Camera list with one line of data per camera:\n";
  for (size_t i = 0; i < images.size(); ++i) {
    const auto& [name, model, camera] = images[i];
    for (const std::string& word : {std::to_string(colmapCameraId(i)), model, std::to_string(camera.width)})
      text.append(word).append(" ");
    text += std::to_string(camera.height);
    for (const double p : asColmapModel(model, camera).first) text.append(" ").append(digits(p));
    text += "\n";
  }
  return text;
}

// Every other image has a point.
inline std::string colmapImagesText(const std::vector<ColmapImage>& images) {
  std::string text = "# Image list with two lines of data per image:\n";
  for (size_t i = 0; i < images.size(); ++i) {
    const VisionCamera& c = images[i].camera;
    for (const std::string& word : {std::to_string(i + 5),
                                    row(c.rotation.w(), c.rotation.x(), c.rotation.y(), c.rotation.z(),
                                        c.translation[0], c.translation[1], c.translation[2]),
                                    std::to_string(colmapCameraId(i)), images[i].name})
      text.append(word).append(" ");
    text += "\n";
    text += i % 2 ? "\n" : "1.5 2.5 -1 3.5 4.5 17\n";
  }
  return text;
}

template <class... Values> void putBytes(std::string& bytes, Values... values) {
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
}

inline std::string colmapCamerasBinary(const std::vector<ColmapImage>& images) {
  std::string bytes;
  putBytes(bytes, uint64_t{images.size()});
  for (size_t i = 0; i < images.size(); ++i) {
    const auto& [name, model, camera] = images[i];
    const auto number = std::ranges::find(colmapModels, model) - colmapModels.begin();
    putBytes(bytes, colmapCameraId(i), static_cast<int32_t>(number == 5 ? 6 : number),
             static_cast<uint64_t>(camera.width), static_cast<uint64_t>(camera.height));
    for (const double p : asColmapModel(model, camera).first) putBytes(bytes, p);
  }
  return bytes;
}

inline std::string colmapImagesBinary(const std::vector<ColmapImage>& images) {
  std::string bytes;
  putBytes(bytes, uint64_t{images.size()});
  for (size_t i = 0; i < images.size(); ++i) {
    const VisionCamera& c = images[i].camera;
    putBytes(bytes, static_cast<uint32_t>(i + 5), c.rotation.w(), c.rotation.x(), c.rotation.y(),
             c.rotation.z(), c.translation[0], c.translation[1], c.translation[2], colmapCameraId(i));
    bytes += images[i].name + '\0';
    putBytes(bytes, uint64_t{i % 2}); // points
    if (i % 2) putBytes(bytes, 1.5, 2.5, int64_t{-1});
  }
  return bytes;
}

// ---------------------------------------------------------------------------------------------------------
// Metashape: a <chunk> of cameras with a sensor each, whose own space is brought to the world by scale,
// rotation and translation.

struct MetashapeChunk {
  std::string label = "Chunk 1";
  double scale = 1;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Vec3<double> translation = Vec3<double>::Zero();
};

inline std::string rowsText(const Mat3<double>& m) {
  return row(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2));
}

// x_camera = R x_world + t and x_world = s Q x_chunk + b, so that x_camera / s = R Q x_chunk + (R b + t) / s.
inline std::string metashapeCamera(size_t id, const std::string& label, const VisionCamera& c,
                                   const MetashapeChunk& chunk) {
  const Mat3<double> r = (c.rotation * chunk.rotation).toRotationMatrix().transpose();
  const Vec3<double> place = -(r * (c.rotation * chunk.translation + c.translation)) / chunk.scale;
  return "<camera id=\"" + std::to_string(id) + "\" sensor_id=\"" + std::to_string(id) +
         "\" component_id=\"0\" label=\"" + label + "\"><transform>" +
         row(r(0, 0), r(0, 1), r(0, 2), place[0], r(1, 0), r(1, 1), r(1, 2), place[1]) + " " +
         row(r(2, 0), r(2, 1), r(2, 2), place[2], 0., 0., 0., 1.) + "</transform></camera>\n";
}

inline std::string metashapeSensor(size_t id, const VisionCamera& c) {
  std::string numbers;
  for (const auto& [name, value] : {std::pair("f", c.fy),
                                    {"b1", c.fx - c.fy},
                                    {"cx", c.cx - c.width / 2.},
                                    {"cy", c.cy - c.height / 2.},
                                    {"k1", c.k1},
                                    {"k2", c.k2},
                                    {"k3", c.k3},
                                    {"p1", c.p2},
                                    {"p2", c.p1}})
    numbers += "<" + std::string(name) + ">" + digits(value) + "</" + name + ">";
  const std::string size =
      "<resolution width=\"" + std::to_string(c.width) + "\" height=\"" + std::to_string(c.height) + "\"/>";
  return "<sensor id=\"" + std::to_string(id) + "\" label=\"unknown\" type=\"frame\">" + size +
         "<calibration type=\"frame\" class=\"adjusted\">" + size + numbers + "</calibration></sensor>\n";
}

// `inside` goes into the list of cameras as it is.
inline std::string metashapeChunk(const MetashapeChunk& chunk,
                                  const std::vector<std::pair<std::string, VisionCamera>>& cameras,
                                  const std::string& inside = "") {
  std::string sensors, list;
  for (size_t i = 0; i < cameras.size(); ++i) {
    sensors += metashapeSensor(i, cameras[i].second);
    list += metashapeCamera(i, cameras[i].first, cameras[i].second, chunk);
  }
  return "<chunk label=\"" + chunk.label + "\" enabled=\"true\">\n<sensors>" + sensors +
         "</sensors>\n<components><component id=\"0\" label=\"Component 1\"><transform><rotation>" +
         rowsText(chunk.rotation.toRotationMatrix()) + "</rotation><translation>" +
         row(chunk.translation[0], chunk.translation[1], chunk.translation[2]) + "</translation><scale>" +
         digits(chunk.scale) + "</scale></transform></component></components>\n<cameras>" + list + inside +
         "</cameras>\n</chunk>\n";
}

inline std::string metashapeDocument(const std::string& chunks) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\">\n" + chunks +
         "</document>\n";
}

// ---------------------------------------------------------------------------------------------------------
// NeRF.

// Camera to world with OpenGL's axes.
inline nlohmann::json openGlMatrixOf(const VisionCamera& camera) {
  const Mat3<double> r = camera.rotation.toRotationMatrix().transpose();
  const Vec3<double> center = -(r * camera.translation);
  auto rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({r(i, 0), -r(i, 1), -r(i, 2), center[i]});
  rows.push_back({0, 0, 0, 1});
  return rows;
}

// ---------------------------------------------------------------------------------------------------------
// Middlebury: a line of *_par.txt, with K times `scale`. Pixel centres are whole numbers in the file, and in
// `camera`.

inline std::string middleburyLine(const std::string& name, const VisionCamera& camera, double scale = 1,
                                  double skew = 0) {
  const Mat3<double> r = camera.rotation.toRotationMatrix();
  const double k = scale;
  return name + " " + row(k * camera.fx, skew, k * camera.cx, 0., k * camera.fy, k * camera.cy, 0., 0., k) +
         " " + row(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)) + " " +
         row(camera.translation[0], camera.translation[1], camera.translation[2]) + "\n";
}

} // namespace surflect
