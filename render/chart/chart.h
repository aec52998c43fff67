// A chart of speed against accuracy: what frames cost and how right they are, for each setting of a
// renderer's knobs.
#pragma once

#include "render/method/option.h"

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::chart {

// Agreement of pictures with held-out photographs, pooled over frames by the protocol of measure.h.
struct Agreement {
  double psnrLinearDb = 0, psnrSrgbDb = 0, ssim = 0;
  double flip = 0; // mean FLIP, 0..1; less is better
};

// One model with one setting.
struct Point {
  std::filesystem::path model;
  method::Setting setting;
  std::string name;    // "preview"; empty for a setting without a name
  std::string command; // renders and scores this point alone

  Agreement rest;                // held-out frames of the object at rest
  std::optional<Agreement> bent; // held-out frames of the deformed object, if there are any
  double rmsToFull = 0; // relative RMS of the pictures against the same model with every knob at full

  double milliseconds = 0;                // median of a frame
  std::map<std::string, double> stages;   // milliseconds by stage
  double bytesRead = 0;                   // per frame, from the model's files, with an empty cache
  size_t modelBytes = 0, memoryBytes = 0; // size of the model's files; peak memory of the process

  bool isOnFront = false; // no other point is both faster and closer to the photographs at rest
  bool isChosen = false;  // shown with pictures
};

// A frame of a chosen point beside truth.
struct Panel {
  size_t point = 0;                            // index in Chart::points
  std::string frame;                           // camera and light, in words
  std::string truthPng, renderedPng, errorPng; // files' content; the error picture is a FLIP map
};

struct Chart {
  std::string title;                       // "vase.srf on examples/vase"
  std::string machine;                     // processor, threads and instruction set
  std::string command;                     // makes the chart again
  size_t restFrames = 0, bentFrames = 0;   // frames that were rendered
  size_t restHeldOut = 0, bentHeldOut = 0; // held-out frames of the captures
  std::vector<method::Option> knobs;       // with the values that were swept; the first is full
  std::map<std::filesystem::path, std::vector<std::string>> idleKnobs; // without effect alone, by model
  std::vector<Point> points;
  std::vector<Panel> panels;
};

} // namespace surflect::chart
