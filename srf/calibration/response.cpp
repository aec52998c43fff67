#include "srf/calibration/response.h"

#include "srf/image/bracket.h"
#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

namespace surflect::calibration {

namespace {

constexpr int kCodes = static_cast<int>(image::Response::codes), kMiddle = 128;
constexpr size_t kBrackets = 16;     // maximum number used
constexpr size_t kPixelsPerCode = 8; // per picture
// Smoothness that bridges codes without pixels; more would straighten the bend at dark codes.
constexpr double kLambda = 0.01;

double weight(int z) { return static_cast<double>(image::hatWeight(static_cast<float>(z), 0, kCodes - 1)); }

} // namespace

std::array<double, image::Response::codes> recoverLogResponse(std::span<const BracketPixel> pixels,
                                                              double lambda) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(kCodes, kCodes);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kCodes);

  // For given g the best ln E_i is a weighted mean, ln E = sum w^2 (g - ln dt) / sum w^2. Substituted into
  // the sum, it leaves one equation in g per sample.
  size_t telling = 0;
  for (const BracketPixel& pixel : pixels) {
    assert(pixel.codes.size() == pixel.logSeconds.size());
    double weights = 0, meanLogSeconds = 0;
    size_t weighted = 0;
    for (size_t j = 0; j < pixel.codes.size(); ++j) {
      const double w = weight(pixel.codes[j]), squared = w * w;
      weights += squared;
      meanLogSeconds += squared * pixel.logSeconds[j];
      weighted += squared > 0;
    }
    if (weighted < 2) continue;
    ++telling;
    meanLogSeconds /= weights;
    for (size_t j = 0; j < pixel.codes.size(); ++j) {
      const int zj = pixel.codes[j];
      const double wj = weight(zj) * weight(zj);
      normal(zj, zj) += wj;
      right[zj] += wj * (pixel.logSeconds[j] - meanLogSeconds);
      for (const uint8_t zk : pixel.codes) normal(zj, zk) -= wj * weight(zk) * weight(zk) / weights;
    }
  }
  if (telling == 0) throw Error::mismatch("pixels between black and clipped in two exposures", "none");
  normal /= static_cast<double>(telling);
  right /= static_cast<double>(telling);

  for (int z = 1; z + 1 < kCodes; ++z) { // g'' = g(z-1) - 2 g(z) + g(z+1)
    const Eigen::Vector3d second(1, -2, 1);
    normal.block<3, 3>(z - 1, z - 1) += lambda * weight(z) * weight(z) * second * second.transpose();
  }
  normal(kMiddle, kMiddle) += normal.diagonal().maxCoeff(); // g(128) = 0; no other equation fixes it
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  const Eigen::VectorXd solution = solver.solve(right);
  std::array<double, image::Response::codes> g;
  for (int z = 0; z < kCodes; ++z) g[static_cast<size_t>(z)] = solution[z] - solution[kMiddle];
  return g;
}

namespace {

// Nearest non-decreasing sequence: decreasing neighbours are pooled to their mean.
std::vector<double> notFalling(std::span<const double> values) {
  struct Pool {
    double mean;
    size_t count;
  };
  std::vector<Pool> pools;
  for (const double value : values) {
    pools.push_back({value, 1});
    while (pools.size() > 1 && pools[pools.size() - 2].mean > pools.back().mean) {
      const Pool last = pools.back();
      pools.pop_back();
      Pool& into = pools.back();
      const auto a = static_cast<double>(into.count), b = static_cast<double>(last.count);
      into = {(a * into.mean + b * last.mean) / (a + b), into.count + last.count};
    }
  }
  std::vector<double> result;
  for (const Pool& pool : pools) result.insert(result.end(), pool.count, pool.mean);
  return result;
}

// Codes of a bracket's pictures, three channels; gray is repeated.
struct Bracket {
  std::vector<std::vector<uint8_t>> codes; // per shot, 3 per pixel
  std::vector<double> logSeconds;
};

std::vector<uint8_t> codesOf(const image::Image& image) {
  const auto channels = static_cast<size_t>(image.channels);
  const size_t pixels = image.values.size() / channels;
  std::vector<uint8_t> codes(3 * pixels);
  for (size_t i = 0; i < codes.size(); ++i) {
    const float value = image.values[i / 3 * channels + (channels >= 3 ? i % 3 : 0)];
    codes[i] = static_cast<uint8_t>(std::lround(std::clamp(value, 0.f, 1.f) * (kCodes - 1)));
  }
  return codes;
}

Bracket readBracket(const capture::Capture& capture, const capture::Frame& frame) {
  const capture::Lens& lens = capture.views[frame.view].camera.lens;
  Bracket bracket;
  for (const capture::Exposure& shot : capture::bracketOf(frame)) {
    const auto path = capture.folder() / shot.picture;
    const image::Picture picture = image::readPicture(path);
    if (picture.bits != 8)
      throw Error::mismatch("8 bits, of which a response can be told",
                            picture.isFloat() ? "floating point" : std::to_string(picture.bits) + " bits")
          .in(path);
    const image::PictureSize size{picture.image.width, picture.image.height};
    if (size != image::PictureSize{lens.width, lens.height})
      throw Error::mismatch(sizeText(lens.width, lens.height), sizeText(size.width, size.height))
          .at("size")
          .in(path);
    bracket.codes.push_back(codesOf(picture.image));
    bracket.logSeconds.push_back(std::log(shot.exposure));
  }
  return bracket;
}

// For each code that occurs in a picture, some of its pixels, evenly chosen.
std::vector<size_t> spreadPixels(std::span<const uint8_t> codes, size_t channel) {
  std::array<std::vector<size_t>, image::Response::codes> having;
  for (size_t i = 0; 3 * i < codes.size(); ++i) having[codes[3 * i + channel]].push_back(i);
  std::vector<size_t> chosen;
  for (size_t z = 1; z + 1 < having.size(); ++z) {
    const size_t count = std::min(kPixelsPerCode, having[z].size());
    for (size_t k = 0; k < count; ++k) chosen.push_back(having[z][k * having[z].size() / count]);
  }
  return chosen;
}

} // namespace

image::Response recoverResponse(const capture::Capture& capture, const Progress& progress) {
  std::vector<const capture::Frame*> frames;
  for (const capture::Frame& frame : capture.frames)
    if (!frame.further.empty()) frames.push_back(&frame);
  if (frames.empty())
    throw Error::mismatch("frames that differ in exposure alone", "none").at("frames").in(capture.file);

  std::vector<std::vector<double>> logSeconds; // referenced by pixels
  std::array<std::vector<BracketPixel>, 3> pixels;
  const size_t count = std::min(kBrackets, frames.size());
  logSeconds.reserve(count);
  for (size_t b = 0; b < count; ++b) {
    progress("response", static_cast<double>(b) / static_cast<double>(count));
    const Bracket bracket = readBracket(capture, *frames[b * frames.size() / count]);
    logSeconds.push_back(bracket.logSeconds);
    for (size_t channel = 0; channel < 3; ++channel)
      for (const std::vector<uint8_t>& shot : bracket.codes)
        for (const size_t i : spreadPixels(shot, channel)) {
          BracketPixel& pixel = pixels[channel].emplace_back(BracketPixel{logSeconds.back(), {}});
          for (const std::vector<uint8_t>& codes : bracket.codes)
            pixel.codes.push_back(codes[3 * i + channel]);
        }
  }

  image::Response response;
  for (size_t channel = 0; channel < 3; ++channel) {
    progress.checkpoint();
    std::array<double, image::Response::codes> g;
    try {
      g = recoverLogResponse(pixels[channel], kLambda);
    } catch (Error& e) {
      throw std::move(e).in(capture.file);
    }
    const std::vector<double> rising = notFalling(g);
    const auto middle = static_cast<double>(image::linearFromSrgb(kMiddle / 255.f));
    for (size_t z = 0; z < image::Response::codes; ++z)
      response.exposure[channel][z] = static_cast<float>(middle * std::exp(rising[z] - rising[kMiddle]));
  }
  return response;
}

} // namespace surflect::calibration
