// Writes captures: the description, and pictures in the format that reads fastest.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/exr.h"
#include "srf/image/image.h"

#include <filesystem>
#include <span>
#include <string>

namespace surflect::capture {

// Writes folder/transforms.json atomically; capture.file is ignored. readCapture() returns an equal capture,
// except that the last digits of poses may be rounded and views are ordered by their first frame. Paths of
// pictures must be inside the folder. Throws Error.
void writeCapture(const Capture& capture, const std::filesystem::path& folder);
// Text of the file that writeCapture() writes.
std::string captureText(const Capture& capture, const std::filesystem::path& folder);

// A layer of a view's file: the photograph under one light.
struct RadianceLayer {
  std::string layer;                      // Frame::layer
  const image::Image* radiance = nullptr; // 3 channels, not multiplied by alpha
};

// Writes the photographs of one view, with exposure 1, as one multi-layer EXR. With alpha (1 channel),
// colours are stored premultiplied, and alpha as `alphaLayer`.A (Frame::alphaLayer). Throws Error and
// Cancelled.
void writeViewPictures(const std::filesystem::path& path, std::span<const RadianceLayer> layers,
                       const image::Image* alpha = nullptr, const std::string& alphaLayer = "",
                       image::Precision precision = image::Precision::half, const Progress& progress = {});

} // namespace surflect::capture
