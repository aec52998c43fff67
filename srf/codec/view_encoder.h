// Encodes the photographs of one view, one for each light, as a view file.
#pragma once

#include "srf/codec/view_file.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::codec {

// The photographs of one view. All images are width x height.
struct ReflectanceStack {
  int width = 0, height = 0;
  std::vector<image::Image> lights; // linear radiance, 3 channels; one image for each light, at least one
  image::Image alpha;               // 1 channel: the fraction of a pixel that the object covers
};

struct EncodeOptions {
  double tolerance = 0.02;   // error tolerance of every block; see blockErrorBound
  double white = 1;          // radiance of a white pixel, 1e-20..1e20
  double presentAlpha = 0.5; // texels with at least this alpha are stored
};

// Size and errors of encoded views; the summaries of several views add up.
struct ViewSummary {
  uint64_t fileBytes = 0;
  uint64_t objectTexels = 0;
  uint64_t values = 0; // object texels x lights x RGB
  std::vector<uint64_t> blocksOfRank;
  double squaredError = 0;        // over all values
  double clippedSquaredError = 0; // with both sides clipped to [0, white]

  ViewSummary& operator+=(const ViewSummary& other);
};

// Size of the object's values as half floats, divided by the size of the file.
double compressionRatio(const ViewSummary& summary);
// Peak signal-to-noise ratio of the clipped values, in linear light; infinite if there is no error.
double psnrDb(const ViewSummary& summary, double white);

struct EncodedView {
  std::vector<std::byte> file; // for writeFileAtomically
  ViewSummary summary;
};

// Blocks of some rows of a view, in row order. The summary lacks the bytes of the file.
struct EncodedRows {
  std::vector<PlacedRecord> records;
  ViewSummary summary;
};

// Header of the file that encodeView makes.
ViewHeader headerOf(int width, int height, size_t lights, const EncodeOptions& options);

// Encodes some rows of a view. `top`: their first row in the view, a multiple of blockSize. Unless they end
// with the view, their number is a multiple of blockSize too. Throws as encodeView.
EncodedRows encodeRows(const ReflectanceStack& rows, int top, const EncodeOptions& options,
                       const Progress& progress = {});

// Encodes all blocks in parallel; the bytes do not depend on the number of threads. Throws Error if image
// sizes disagree or a radiance is not finite and below 1e30, and Cancelled.
EncodedView encodeView(const ReflectanceStack& stack, const EncodeOptions& options,
                       const Progress& progress = {});

} // namespace surflect::codec
