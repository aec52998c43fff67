// Held-out frames of a chart, in memory: truth, scene, and their comparison with pictures.
#pragma once

#include "render/chart/chart.h"
#include "render/evaluation/measure.h"
#include "render/evaluation/true_frames.h"
#include "render/method/renderer.h"

#include <memory>
#include <string>
#include <vector>

namespace surflect::chart {

struct Sample {
  scene::Scene scene;
  image::Image truth; // RGBA, linear, premultiplied
  std::string name;   // "camera C07, light L12"
};

// At most `count` of the capture's test frames, spread over cameras and lights, under the exposure of all
// test frames.
class Samples {
public:
  // Throws Error and Cancelled as TrueFrames; `rig` must outlive the object.
  Samples(const capture::Capture& capture, const capture::Capture& rig, warp::WarpPointer warp, size_t count,
          const Progress& progress);

  const std::vector<Sample>& all() const { return samples_; }
  double exposure() const { return exposure_; }
  size_t heldOut() const { return heldOut_; } // test frames of the capture
  uint64_t hash() const { return hash_; }     // of exposure, photographs, cameras and lights
  size_t brightest() const;                   // sample that shows most light

private:
  warp::WarpPointer warp_;
  double exposure_ = 1;
  size_t heldOut_ = 0;
  uint64_t hash_ = 0;
  std::vector<Sample> samples_;
};

// The scene on a picture of `scale` times its size.
scene::Scene scaled(scene::Scene scene, double scale);
// Bilinear between pixel centres; the border is repeated. The image itself if it has that size.
image::Image enlarged(image::Image small, int width, int height);

// Agreement pooled over pictures.
class PooledAgreement {
public:
  void add(const image::Image& truth, const image::Image& rendered, double exposure);
  Agreement agreement() const;

private:
  evaluation::Difference difference_;
  evaluation::PooledMean flip_;
};

// Relative RMS, pooled over pictures: sqrt(sum |a - b|^2 / sum |b|^2) of colour in linear light.
class RelativeRms {
public:
  void add(const image::Image& a, const image::Image& b);
  double value() const; // 0 if nothing differs

private:
  double difference_ = 0, reference_ = 0;
};

// Truth, rendering and FLIP as PNG files, cropped to the object and made small.
Panel panelOf(const Sample& sample, const image::Image& rendered, double exposure);

} // namespace surflect::chart
