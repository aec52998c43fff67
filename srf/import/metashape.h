// Cameras that Agisoft Metashape exports as XML (File > Export > Export Cameras).
//
// Cameras look along +z with y down; a camera's transform is chunk from camera, and that of its component, or
// else of its chunk, is world from chunk with a scale. cx and cy count from the picture's middle; b1 is added
// to the horizontal focal length; p1 and p2 are OpenCV's p2 and p1. [Metashape User Manual, appendix "Camera
// models"; Metashape Python Reference, Camera.transform, Chunk.transform]
#pragma once

#include "srf/import/foreign_capture.h"

#include <filesystem>
#include <string>
#include <vector>

namespace surflect::importers {

struct MetashapeOptions {
  std::filesystem::path
      images; // folder of the photographs; empty: images/ beside the file, or its own folder
  std::vector<std::string>
      chunks; // labels; empty: the component with the most cameras, of the enabled chunks
  bool allowOutside = false;
};

// Reads aligned and enabled cameras; every photograph is a view of its own, under fixed light. A photograph
// is found by its camera's label: a file's name with or without extension, alone or below the name of the
// camera's group. Throws Error, also for lenses other than frame cameras with f, cx, cy, b1, k1 to k3, p1,
// p2.
ForeignCapture readMetashape(const std::filesystem::path& file, const MetashapeOptions& options);

} // namespace surflect::importers
