// Groups the frames of a capture into views, and further exposures into photographs.
#pragma once

#include "srf/capture/capture.h"

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace surflect::capture {

class ViewGrouping {
public:
  // Adds a frame to its view, as a photograph, or as a further exposure of the photograph of that light and
  // split. A view may have several test photographs. A second training photograph becomes a view of its own,
  // as if taken by another camera. Frames without a camera's name share a view if pose and lens agree.
  void add(Capture& capture, Frame frame, const std::optional<std::string>& cameraName,
           const Camera<AcquisitionSpace>& camera);

  // Notes for the user: photographs that repeat view and light of another, frames listed twice, and frames
  // whose picture is that of another camera or light.
  std::vector<std::string> notes() const;

private:
  // The camera's name, if any, then the numbers of lens and pose.
  using ViewKey = std::pair<std::optional<std::string>, std::array<double, 23>>;

  // Last photograph of a pose, light and split, and the view it belongs to.
  struct Shot {
    size_t copy = 0, frame = 0;
  };

  static ViewKey keyOf(const std::optional<std::string>& cameraName, const Camera<AcquisitionSpace>& camera);

  std::map<ViewKey, std::vector<size_t>> views_;                           // of one pose, in file order
  std::map<std::tuple<size_t, std::optional<size_t>, Split>, Shot> shots_; // by the pose's first view
  // First view of the pose, and light, of each picture and layer.
  std::map<std::pair<std::filesystem::path, std::string>, std::pair<size_t, std::optional<size_t>>> shown_;
  size_t repeated_ = 0, listedTwice_ = 0, shared_ = 0;
  std::string firstRepeated_, firstShared_;
};

} // namespace surflect::capture
