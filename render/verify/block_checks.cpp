#include "render/verify/block_checks.h"

#include "srf/codec/block.h"
#include "srf/model/pack_source.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>

namespace surflect::verify {

void forEachBlock(const codec::ViewFile& file, std::vector<std::string>& faults, const Progress& progress,
                  const std::function<void(uint32_t, const codec::Block&)>& use) {
  for (uint32_t number = 0; number < file.blockCount(); ++number) {
    progress.checkNowAndThen(number);
    std::optional<codec::Block> block;
    try {
      block = file.read(number);
    } catch (const Error& error) {
      faults.emplace_back(error.what());
    }
    if (block) use(number, *block);
  }
}

Vec3<float> radianceAt(const codec::Block& block, int texel, size_t light) {
  const float* coefficients = block.light(light);
  const int8_t* levels = block.texel(texel);
  Vec3<float> radiance;
  for (int channel = 0; channel < 3; ++channel) {
    float sum = 0;
    for (int k = 0; k < block.stride; ++k)
      sum += coefficients[k] * static_cast<float>(levels[channel * block.stride + k]);
    radiance[channel] = sum;
  }
  return radiance;
}

std::vector<image::Image> storedPictures(const codec::ViewFile& file, const codec::AlphaPlane* alpha,
                                         std::span<const uint32_t> columns, const Progress& progress) {
  const codec::ViewHeader& header = file.header();
  std::vector<image::Image> pictures(columns.size(), image::Image(header.width, header.height, 4));
  for (uint32_t number = 0; number < file.blockCount(); ++number) {
    progress.checkNowAndThen(number);
    const codec::Block block = file.read(number);
    const auto [blockX, blockY] = file.position(number);
    for (int texel = 0; texel < codec::blockTexels; ++texel) {
      if ((block.present >> texel & 1) == 0) continue;
      const int x = blockX * codec::blockSize + texel % codec::blockSize,
                y = blockY * codec::blockSize + texel / codec::blockSize;
      const float a = alpha ? alpha->at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) : 1;
      for (size_t i = 0; i < columns.size(); ++i) {
        const Vec3<float> radiance = a * radianceAt(block, texel, columns[i]);
        std::ranges::copy(std::array{radiance[0], radiance[1], radiance[2], a}, pictures[i].at(x, y).begin());
      }
    }
  }
  return pictures;
}

namespace {

// Frames of each view in the order of the model's columns.
std::vector<std::vector<size_t>> packedFrames(const model::Model& model, const capture::Capture& training) {
  const auto& rig = model.rig;
  const auto require = [&](const std::string& field, const std::string& expected, const std::string& found) {
    if (expected != found)
      throw Error::mismatch(expected + " as in " + model.folder.string(), found).at(field).in(training.file);
  };
  require("cameras of training frames", std::to_string(rig.views.size()),
          std::to_string(training.views.size()));
  require("training frames", std::to_string(rig.frames.size()), std::to_string(training.frames.size()));
  const auto lightOf = [](const capture::Capture& capture, const capture::Frame& frame) {
    return frame.light ? capture.lights[*frame.light].identity : std::string("none");
  };
  std::vector<std::map<std::string, size_t>> byLight(rig.views.size());
  for (size_t i = 0; i < training.frames.size(); ++i)
    byLight[training.frames[i].view][lightOf(training, training.frames[i])] = i;
  std::vector<std::vector<size_t>> frames(rig.views.size());
  for (const capture::Frame& packed : rig.frames) {
    const std::string camera = rig.views[packed.view].identity, light = lightOf(rig, packed);
    require(fmt::format("camera {}", packed.view), camera, training.views[packed.view].identity);
    const auto found = byLight[packed.view].find(light);
    if (found == byLight[packed.view].end())
      throw Error::mismatch("a training frame under light " + light + " as in " + model.folder.string(),
                            "none")
          .at("camera " + camera)
          .in(training.file);
    frames[packed.view].push_back(found->second);
  }
  return frames;
}

// Root of the weighted squared error of a block over its bound.
double errorOverBound(const codec::Block& block, codec::BlockPosition position,
                      const codec::ReflectanceStack& stack, const model::Model& model) {
  const size_t lights = stack.lights.size();
  codec::ChannelEnergies energies{Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(lights)), 0},
      errors = energies;
  for (int texel = 0; texel < codec::blockTexels; ++texel) {
    if ((block.present >> texel & 1) == 0) continue;
    ++energies.texels;
    const int x = position.x * codec::blockSize + texel % codec::blockSize,
              y = position.y * codec::blockSize + texel / codec::blockSize;
    for (size_t light = 0; light < lights; ++light) {
      const auto truth = stack.lights[light].at(x, y);
      const Vec3<float> stored = radianceAt(block, texel, light);
      for (int channel = 0; channel < 3; ++channel) {
        const double value = double{truth[static_cast<size_t>(channel)]};
        const auto column = static_cast<Eigen::Index>(light);
        energies.sums(channel, column) += value * value;
        errors.sums(channel, column) += std::pow(double{stored[channel]} - value, 2);
      }
    }
  }
  errors.texels = energies.texels;
  const codec::BlockWeights weights = codec::blockWeights(energies, model.white);
  return std::sqrt(codec::weightedSquares(errors, weights)) /
         codec::blockErrorBound(energies, weights, model.tolerance, model.white);
}

} // namespace

std::vector<Check> blockChecks(const model::Model& model, const capture::Capture* capture,
                               const Bounds& bounds, const Progress& progress) {
  std::optional<model::CaptureSource> source;
  std::vector<std::vector<size_t>> frames;
  if (capture) {
    source.emplace(*capture);
    frames = packedFrames(model, source->training());
  }
  std::vector<std::string> faults;
  size_t blocks = 0, measured = 0, unmatted = 0;
  double largest = 0;
  std::string worst;
  for (size_t view = 0; view < model.files.size(); ++view) {
    progress("blocks", static_cast<double>(view) / static_cast<double>(model.files.size()));
    const codec::ViewFile& file = model.files[view];
    std::optional<codec::ReflectanceStack> stack;
    if (source) {
      model::ViewPictures pictures = source->pictures(frames[view], true, progress);
      if (pictures.hasMatte)
        stack = std::move(pictures.stack);
      else
        ++unmatted;
      if (stack && (stack->width != file.header().width || stack->height != file.header().height ||
                    stack->lights.size() != static_cast<size_t>(file.header().lights)))
        throw Error::mismatch(sizeText(file.header().width, file.header().height) + " pixels as in " +
                                  file.path().string(),
                              sizeText(stack->width, stack->height))
            .at("camera " + model.rig.views[view].identity)
            .in(capture->file);
    }
    forEachBlock(file, faults, progress, [&](uint32_t number, const codec::Block& block) {
      ++blocks;
      if (!stack) return;
      ++measured;
      const codec::BlockPosition position = file.position(number);
      const double ratio = errorOverBound(block, position, *stack, model);
      if (ratio <= largest) return;
      largest = ratio;
      worst = fmt::format("camera {}, pixels from ({}, {})", model.rig.views[view].identity,
                          position.x * codec::blockSize, position.y * codec::blockSize);
    });
  }
  progress("blocks", 1);
  std::vector<Check> checks;
  checks.push_back(judged("blocks_damaged", static_cast<double>(faults.size()), bounds,
                          faults.empty()
                              ? fmt::format("all {} blocks were read", blocks)
                              : fmt::format("{} of {} blocks are damaged; the first: {}", faults.size(),
                                            blocks + faults.size(), faults.front())));
  if (!capture)
    checks.push_back(
        inapplicable("block_error", "give the capture that was packed by --capture to measure it"));
  else if (measured == 0)
    checks.push_back(inapplicable(
        "block_error",
        "pack changed the photographs at the outline, as they have no matte: nothing to compare with"));
  else
    checks.push_back(
        judged("block_error", largest, bounds,
               fmt::format("the worst of {} blocks reaches {:.3f} of the error that the tolerance {} "
                           "allows ({}){}",
                           measured, largest, model.tolerance, worst,
                           unmatted > 0 ? "; cameras without a matte are left out" : "")));
  return checks;
}

} // namespace surflect::verify
