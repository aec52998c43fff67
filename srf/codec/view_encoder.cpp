#include "srf/codec/view_encoder.h"

#include "srf/codec/block_encoder.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <mutex>
#include <string>

namespace surflect::codec {

namespace {

constexpr float radianceLimit = 1e30f;

std::string sizeOf(const image::Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height) + "x" +
         std::to_string(image.channels);
}

void checkImage(const image::Image& image, const ReflectanceStack& stack, int channels,
                const std::string& field) {
  if (image.width == stack.width && image.height == stack.height && image.channels == channels) return;
  throw Error::mismatch(sizeOf({stack.width, stack.height, channels}), sizeOf(image)).at(field);
}

void checkStack(const ReflectanceStack& stack) {
  if (std::min(stack.width, stack.height) < 1 || std::max(stack.width, stack.height) > largestViewSide)
    throw Error::mismatch("sides of 1.." + std::to_string(largestViewSide) + " pixels",
                          std::to_string(stack.width) + "x" + std::to_string(stack.height))
        .at("size");
  if (stack.lights.empty() || stack.lights.size() > mostLights)
    throw Error::mismatch("1.." + std::to_string(mostLights), std::to_string(stack.lights.size()))
        .at("lights");
  for (size_t l = 0; l < stack.lights.size(); ++l)
    checkImage(stack.lights[l], stack, 3, "lights[" + std::to_string(l) + "]");
  checkImage(stack.alpha, stack, 1, "alpha");
}

void checkOptions(const EncodeOptions& options) {
  if (!(options.white >= 1e-20 && options.white <= 1e20))
    throw Error::mismatch("1e-20..1e20", numberText(options.white)).at("white");
  if (!(options.tolerance >= 0 && options.tolerance <= 1))
    throw Error::mismatch("0..1", numberText(options.tolerance)).at("tolerance");
}

uint64_t presentTexels(const image::Image& alpha, BlockPosition block, double presentAlpha) {
  uint64_t present = 0;
  const int x0 = block.x * blockSize, y0 = block.y * blockSize;
  for (int y = y0; y < std::min(y0 + blockSize, alpha.height); ++y)
    for (int x = x0; x < std::min(x0 + blockSize, alpha.width); ++x)
      if (alpha.at(x, y)[0] >= presentAlpha) present |= uint64_t{1} << ((y - y0) * blockSize + x - x0);
  return present;
}

// Radiance matrix of a block, as encodeBlock expects it; `top`: first row of the stack in its view.
Eigen::MatrixXf gather(const ReflectanceStack& stack, BlockPosition block, uint64_t present, int top) {
  Eigen::MatrixXf radiance(3 * std::popcount(present), stack.lights.size());
  for (size_t l = 0; l < stack.lights.size(); ++l) {
    Eigen::Index row = 0;
    for (uint64_t rest = present; rest != 0; rest &= rest - 1) {
      const int texel = std::countr_zero(rest);
      const int x = block.x * blockSize + texel % blockSize, y = block.y * blockSize + texel / blockSize;
      for (const float value : stack.lights[l].at(x, y)) {
        if (!(std::abs(value) < radianceLimit))
          throw Error::mismatch("a finite radiance below 1e30", numberText(value))
              .at("pixel (" + std::to_string(x) + ", " + std::to_string(top + y) + ")")
              .at("lights[" + std::to_string(l) + "]");
        radiance(row++, static_cast<Eigen::Index>(l)) = value;
      }
    }
  }
  return radiance;
}

} // namespace

ViewSummary& ViewSummary::operator+=(const ViewSummary& other) {
  fileBytes += other.fileBytes;
  objectTexels += other.objectTexels;
  values += other.values;
  blocksOfRank.resize(std::max(blocksOfRank.size(), other.blocksOfRank.size()));
  for (size_t k = 0; k < other.blocksOfRank.size(); ++k) blocksOfRank[k] += other.blocksOfRank[k];
  squaredError += other.squaredError;
  clippedSquaredError += other.clippedSquaredError;
  return *this;
}

double compressionRatio(const ViewSummary& summary) {
  return 2.0 * static_cast<double>(summary.values) / static_cast<double>(summary.fileBytes);
}

double psnrDb(const ViewSummary& summary, double white) {
  return 10 * std::log10(white * white * static_cast<double>(summary.values) / summary.clippedSquaredError);
}

ViewHeader headerOf(int width, int height, size_t lights, const EncodeOptions& options) {
  return {width, height, static_cast<int>(lights), static_cast<float>(options.white),
          static_cast<float>(options.tolerance)};
}

EncodedRows encodeRows(const ReflectanceStack& rows, int top, const EncodeOptions& options,
                       const Progress& progress) {
  assert(top % blockSize == 0);
  checkStack(rows);
  checkOptions(options);
  const ViewHeader header = headerOf(rows.width, rows.height, rows.lights.size(), options);
  std::vector<BlockPosition> positions; // in the rows
  std::vector<uint64_t> present;
  for (BlockPosition at; at.y < header.blocksDown(); ++at.y) {
    for (at.x = 0; at.x < header.blocksAcross(); ++at.x) {
      const uint64_t texels = presentTexels(rows.alpha, at, options.presentAlpha);
      if (texels == 0) continue;
      positions.push_back(at);
      present.push_back(texels);
    }
  }

  std::vector<EncodedBlock> blocks(positions.size());
  std::atomic<size_t> done = 0;
  size_t reported = 0;
  std::mutex reporting; // guards `reported`
  tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t b) {
    progress.checkpoint();
    blocks[b] = encodeBlock(present[b], gather(rows, positions[b], present[b], top), options.tolerance,
                            options.white);
    constexpr size_t kStep = 4096;
    if (++done % kStep == 0) {
      const std::lock_guard lock(reporting);
      reported += kStep;
      progress("encoding", static_cast<double>(reported) / static_cast<double>(blocks.size()));
    }
  });

  EncodedRows encoded;
  ViewSummary& summary = encoded.summary;
  for (size_t b = 0; b < blocks.size(); ++b) {
    EncodedBlock& block = blocks[b];
    summary.objectTexels += std::popcount(present[b]);
    summary.squaredError += block.squaredError;
    summary.clippedSquaredError += block.clippedSquaredError;
    summary.blocksOfRank.resize(std::max<size_t>(summary.blocksOfRank.size(), block.rank + 1));
    ++summary.blocksOfRank[block.rank];
    encoded.records.push_back({{positions[b].x, positions[b].y + top / blockSize}, std::move(block.record)});
  }
  summary.values = summary.objectTexels * 3 * rows.lights.size();
  return encoded;
}

EncodedView encodeView(const ReflectanceStack& stack, const EncodeOptions& options,
                       const Progress& progress) {
  EncodedRows rows = encodeRows(stack, 0, options, progress);
  EncodedView view{
      viewFileBytes(headerOf(stack.width, stack.height, stack.lights.size(), options), rows.records),
      std::move(rows.summary)};
  view.summary.fileBytes = view.file.size();
  return view;
}

} // namespace surflect::codec
