// Description of a model or a capture for pages: its entry in /start.
#pragma once

#include "render/method/renderer.h"
#include "srf/capture/capture.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace surflect::viewer {

// A model of the start list, as long as the viewer lives, whether its renderer is open or not.
struct DescribedModel {
  std::string name, method;
  capture::Capture rig;
  std::vector<capture::View> heldOut = {}; // cameras of photographs that the rig lacks
  std::vector<method::Option> options;
  std::vector<std::string> aovs;
  Point3<AcquisitionSpace, double> middle;
  double radius = 1; // of the sphere around the middle that holds the object
  bool isBaked = false;
  nlohmann::json json; // the entry, without photographs
};

// given: options of the command line, which are the page's defaults.
DescribedModel described(const std::string& name, const method::Renderer& renderer,
                         const method::Setting& given);

// A capture alone: `method` is "capture", and it can only be looked at.
DescribedModel described(const capture::Capture& capture);

// Adds a capture's cameras, lights and photographs to the entry of a model: [camera, light or -1, whether it
// is held out] a photograph. Cameras and lights of the model keep their places.
void addPhotographs(const capture::Capture& capture, DescribedModel& model);

} // namespace surflect::viewer
