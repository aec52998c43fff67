// A disk and a GPU that take virtual time, so that tests do not depend on the machine's.
#pragma once

#include "render/lightfield/spherical/image_cache.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <deque>
#include <exception>
#include <limits>
#include <map>
#include <set>
#include <vector>

namespace surflect::spherical {

struct VirtualClock {
  double seconds = 0;
};

// Reads images one after another, each in the same time.
class SlowDisk : public ImageLoader {
public:
  SlowDisk(VirtualClock& clock, double secondsPerImage) : clock_(clock), secondsPerImage_(secondsPerImage) {}

  void request(ImageNumber image) override {
    readyAt_ = std::max(readyAt_, clock_.seconds) + secondsPerImage_;
    reading_.push_back({image, readyAt_});
    mostAtOnce_ = std::max(mostAtOnce_, reading_.size());
  }
  std::vector<LoadedImage> finished(bool wait) override {
    if (wait && !reading_.empty()) clock_.seconds = std::max(clock_.seconds, reading_.front().readyAt);
    std::vector<LoadedImage> loaded;
    while (!reading_.empty() && reading_.front().readyAt <= clock_.seconds) {
      const ImageNumber image = reading_.front().image;
      reading_.pop_front();
      if (failing_.erase(image) > 0)
        loaded.push_back({image, {}, std::make_exception_ptr(Error("cannot be read"))});
      else
        loaded.push_back(
            {image,
             std::make_shared<const PencilImage>(PencilImage{{{static_cast<int>(image), {}, {}}}}),
             {}});
    }
    return loaded;
  }

  // From now on nothing arrives.
  void stop() { secondsPerImage_ = std::numeric_limits<double>::infinity(); }
  // The next read of the image fails.
  void fail(ImageNumber image) { failing_.insert(image); }
  size_t mostAtOnce() const { return mostAtOnce_; }

private:
  struct Reading {
    ImageNumber image;
    double readyAt;
  };
  VirtualClock& clock_;
  double secondsPerImage_, readyAt_ = 0;
  std::deque<Reading> reading_;
  std::set<ImageNumber> failing_;
  size_t mostAtOnce_ = 0;
};

// Textures that remember the images of SlowDisk.
class CountingTextures : public TextureStore {
public:
  CountingTextures(VirtualClock& clock, double secondsPerImage)
      : clock_(clock), secondsPerImage_(secondsPerImage) {}

  void upload(uint32_t slot, const PencilImage& image) override {
    images_[slot] = static_cast<ImageNumber>(image.mips[0].size);
    clock_.seconds += secondsPerImage_;
  }
  ImageNumber imageIn(uint32_t slot) const { return images_.at(slot); }
  size_t slotsUsed() const { return images_.size(); }

private:
  VirtualClock& clock_;
  double secondsPerImage_;
  std::map<uint32_t, ImageNumber> images_;
};

} // namespace surflect::spherical
