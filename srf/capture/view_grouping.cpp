#include "srf/capture/view_grouping.h"

#include "surfel/base/error.h"
#include "surfel/base/message_text.h"

#include <algorithm>

namespace surflect::capture {

namespace fs = std::filesystem;

namespace {

std::string shownPath(const fs::path& path) { return path.empty() ? "none" : path.string(); }

// Returns whether the bracket already has this picture.
bool isListed(const Frame& bracket, const Frame& frame) {
  const auto isSame = [&](const auto& e) {
    return e.exposure == frame.exposure && e.picture == frame.picture && e.layer == frame.layer &&
           e.alphaLayer == frame.alphaLayer;
  };
  return bracket.mask == frame.mask && (isSame(bracket) || std::ranges::any_of(bracket.further, isSame));
}

void addExposure(Frame& bracket, Frame frame) {
  if (bracket.mask != frame.mask)
    throw Error::mismatch("that of the other exposures, " + shownPath(bracket.mask), shownPath(frame.mask))
        .at("mask_path");
  bracket.further.push_back(
      {std::move(frame.picture), std::move(frame.layer), std::move(frame.alphaLayer), frame.exposure});
}

} // namespace

ViewGrouping::ViewKey ViewGrouping::keyOf(const std::optional<std::string>& cameraName,
                                          const Camera<AcquisitionSpace>& camera) {
  const Lens& lens = camera.lens;
  const auto& pose = camera.cameraFromWorld;
  ViewKey key{cameraName, {}};
  Eigen::Map<Eigen::Matrix<double, 23, 1>>(key.second.data()) << static_cast<double>(lens.model), lens.width,
      lens.height, lens.focalX, lens.focalY, lens.centerX, lens.centerY, lens.k1, lens.k2, lens.p1, lens.p2,
      pose.rotation().reshaped(), pose.translation();
  return key;
}

void ViewGrouping::add(Capture& capture, Frame frame, const std::optional<std::string>& cameraName,
                       const Camera<AcquisitionSpace>& camera) {
  std::vector<size_t>& views = views_[keyOf(cameraName, camera)];
  const auto addView = [&] {
    views.push_back(capture.views.size());
    capture.views.push_back(
        {cameraName ? *cameraName : fs::path(frame.picture).replace_extension().string(), camera});
  };
  if (views.empty()) addView();
  const std::pair place(views[0], frame.light);
  if (shown_.try_emplace({frame.picture, frame.layer}, place).first->second != place && ++shared_ == 1)
    firstShared_ = frame.picture.string() + (frame.layer.empty() ? "" : ", layer " + frame.layer);
  const size_t next = capture.frames.size();
  const auto [found, isNew] = shots_.try_emplace({views[0], frame.light, frame.split}, Shot{0, next});
  Shot& shot = found->second;
  if (!isNew) {
    Frame& last = capture.frames[shot.frame];
    const auto hasExposure = [&](const auto& e) { return e.exposure == frame.exposure; };
    if (!hasExposure(last) && std::ranges::none_of(last.further, hasExposure))
      return addExposure(last, std::move(frame));
    if (frame.split == Split::train) {
      if (isListed(last, frame)) {
        ++listedTwice_;
        return;
      }
      if (++repeated_ == 1) firstRepeated_ = frame.picture.string() + " that of " + last.picture.string();
      if (++shot.copy == views.size()) addView();
    }
    shot.frame = next;
  }
  frame.view = views[shot.copy];
  capture.frames.push_back(std::move(frame));
}

std::vector<std::string> ViewGrouping::notes() const {
  std::vector<std::string> notes;
  if (repeated_ > 0)
    notes.push_back(counted(repeated_, "photograph") + " with view and light of another (" + firstRepeated_ +
                    (repeated_ > 1 ? ", ..)" : ")") + ": each is kept as a view of its own");
  if (listedTwice_ > 0)
    notes.push_back(counted(listedTwice_, "frame") + (listedTwice_ > 1 ? " are" : " is") +
                    " listed twice, and taken once");
  if (shared_ > 0)
    notes.push_back(counted(shared_, "frame") + (shared_ > 1 ? " show" : " shows") +
                    " the picture of another camera or light (" + firstShared_ +
                    (shared_ > 1 ? ", ..)" : ")"));
  return notes;
}

} // namespace surflect::capture
