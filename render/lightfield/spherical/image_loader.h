// Loading of images in the background.
#pragma once

#include "render/lightfield/spherical/spherical_file.h"

#include <cstddef>
#include <exception>
#include <memory>
#include <vector>

namespace surflect::spherical {

struct LoadedImage {
  ImageNumber number = 0;
  std::shared_ptr<const PencilImage> image; // or none, and `failure`
  std::exception_ptr failure;
};

class ImageLoader {
public:
  virtual ~ImageLoader() = default;
  // Starts loading an image.
  virtual void request(ImageNumber image) = 0;
  // Images that have been loaded since the last call, in any order. `wait`: waits for at least one, unless
  // none is being loaded.
  virtual std::vector<LoadedImage> finished(bool wait) = 0;
};

// Reads images from a source, which must outlive the loader, by tasks of TBB.
class TaskLoader : public ImageLoader {
public:
  // `tasks` images at once; 0: as many as TBB has threads beside this one.
  explicit TaskLoader(const ImageSource& source, int tasks = 0);
  ~TaskLoader() override;
  void request(ImageNumber image) override;
  std::vector<LoadedImage> finished(bool wait) override;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace surflect::spherical
