// Makes captures: the description, and the pictures in the form that reads fastest.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/exr.h"
#include "srf/image/image.h"

#include <filesystem>
#include <span>
#include <string>

namespace surflect::capture {

// Writes folder/transforms.json, atomically; capture.file plays no part. What readCapture gives back is
// equal, but for rounding of poses in the last digits and the order of views, which is that of the frames.
// Frames must refer to pictures by paths inside the folder. Throws Error.
void writeCapture(const Capture& capture, const std::filesystem::path& folder);
// What it writes there.
std::string captureText(const Capture& capture, const std::filesystem::path& folder);

// A layer of one view's file: the photograph under one light.
struct RadianceLayer {
  std::string layer;                      // Frame::layer
  const image::Image* radiance = nullptr; // 3 channels, not multiplied by alpha
};

// Writes the photographs of one view as one multi-layer EXR, for frames of exposure 1. Where alpha (1
// channel) is given, colours are stored multiplied by it, and it as `alphaLayer`.A: Frame::alphaLayer. Throws
// Error and Cancelled.
void writeViewPictures(const std::filesystem::path& path, std::span<const RadianceLayer> layers,
                       const image::Image* alpha = nullptr, const std::string& alphaLayer = "",
                       image::Precision precision = image::Precision::half, const Progress& progress = {});

} // namespace surflect::capture
