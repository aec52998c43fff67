#include "render/gaussians/particle_field.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <iterator>
#include <optional>
#include <string_view>

namespace surflect::gaussians {

namespace {

using Text = fmt::memory_buffer;

// Appends "(a, b, c)" with so many significant digits.
template <class Numbers> void addTuple(const Numbers& numbers, int digits, Text& text) {
  auto out = std::back_inserter(text);
  char before = '(';
  for (const auto number : numbers) {
    out = fmt::format_to(out, "{}{:.{}g}", before == '(' ? "(" : ", ", number, digits);
    before = ',';
  }
  fmt::format_to(out, ")");
}

// Index of each drawn surfel among the Gaussians; their number if the surfel is dead.
std::vector<size_t> indicesOf(const Gaussians& gaussians, size_t drawn) {
  std::vector<size_t> indices(drawn, gaussians.size());
  for (size_t i = 0; i < gaussians.size(); ++i) indices[gaussians.alive()[i]] = i;
  return indices;
}

// Writes the entries [0, count) of an array, separated by commas. entry(i, text) appends one.
template <class Entry> void writeEntries(AtomicFile& file, size_t begin, size_t end, const Entry& entry) {
  constexpr size_t kPerText = 2048;
  std::vector<Text> texts((end - begin + kPerText - 1) / kPerText);
  tbb::parallel_for(size_t{0}, texts.size(), [&](size_t t) {
    const size_t first = begin + t * kPerText;
    for (size_t i = first; i < std::min(end, first + kPerText); ++i) {
      if (i > 0) texts[t].append(std::string_view(", "));
      entry(i, texts[t]);
    }
  });
  for (const Text& text : texts) file.write(std::string_view(text.data(), text.size()));
}

// Writes attributes of the field, each with its value at every frame.
class FieldWriter {
public:
  FieldWriter(AtomicFile& file, const ParticleFieldFrames& frames, const GaussiansAt& at,
              const Progress& progress)
      : file_(file), frames_(frames), at_(at), progress_(progress) {}

  // value(gaussians, progress) writes the array of a frame. `weight`: share of all work.
  template <class Value> void attribute(std::string_view declaration, double weight, const Value& value) {
    const bool isSampled = frames_.frames.size() > 1;
    const Progress share = shareOf(weight);
    file_.write(fmt::format("    {}{} = ", declaration, isSampled ? ".timeSamples" : ""));
    if (isSampled) file_.write("{\n");
    for (size_t k = 0; k < frames_.frames.size(); ++k) {
      const Progress part = stepOf(share, kStage, k, frames_.frames.size());
      part(kStage, 0);
      if (isSampled) file_.write(fmt::format("        {}: ", frames_.frames[k]));
      file_.write("[");
      value(*at_(k), part);
      file_.write(isSampled ? "],\n" : "]");
    }
    done_ += weight;
    file_.write(isSampled ? "    }\n" : "\n");
  }

private:
  // Progress of this share of all work, after what is done.
  Progress shareOf(double weight) const {
    Progress share = progress_;
    if (progress_.report)
      share.report = [this, weight](std::string_view stage, double fraction) {
        progress_.report(stage, done_ + weight * fraction);
      };
    return share;
  }

  AtomicFile& file_;
  const ParticleFieldFrames& frames_;
  const GaussiansAt& at_;
  const Progress& progress_;
  double done_ = 0;
};

std::string headerOf(const ParticleFieldFrames& frames) {
  std::string times;
  if (frames.frames.size() > 1)
    times = fmt::format("    endTimeCode = {}\n    framesPerSecond = {}\n    startTimeCode = {}\n"
                        "    timeCodesPerSecond = {}\n",
                        frames.frames.back(), frames.framesPerSecond, frames.frames.front(),
                        frames.framesPerSecond);
  return fmt::format(
      "#usda 1.0\n(\n    \"\"\"{}\"\"\"\n    defaultPrim = \"Surfels\"\n{}    metersPerUnit = 1\n"
      "    upAxis = \"{}\"\n)\n\n",
      frames.comment, times, frames.isZUp ? 'Z' : 'Y');
}

constexpr std::string_view kPrim = R"(def ParticleField "Surfels" (
    prepend apiSchemas = ["ParticleFieldPositionAttributeAPI", "ParticleFieldOrientationAttributeAPI", "ParticleFieldScaleAttributeAPI", "ParticleFieldOpacityAttributeAPI", "ParticleFieldKernelGaussianSurfletAPI", "ParticleFieldSphericalHarmonicsAttributeAPI"]
)
{
)";

// Characters of an entry, about: with its separators, at the digits below.
constexpr size_t kPositionText = 36, kRotationText = 44, kScaleText = 40, kColorText = 29, kOpacityText = 6;
constexpr int kPositionDigits = 7, kRotationDigits = 6, kScaleDigits = 5, kColorDigits = 4;

} // namespace

uint64_t particleFieldBytes(const ParticleFieldFrames& frames, int degree) {
  const uint64_t perFrame = kPositionText + kRotationText + kScaleText + kColorText * coefficientsOf(degree);
  return frames.drawn * (frames.frames.size() * perFrame + kOpacityText);
}

void writeParticleField(const std::filesystem::path& path, const ParticleFieldFrames& frames,
                        const GaussiansAt& at, int degree, const Progress& progress) {
  assert(!frames.frames.empty());
  AtomicFile file(path);
  file.write(headerOf(frames));
  file.write(kPrim);
  FieldWriter field(file, frames, at, progress);
  const size_t drawn = frames.drawn, perParticle = coefficientsOf(degree);
  // Writes an array of one tuple for each particle; numbers(shape) are those of its Gaussian.
  const auto shapes = [&](std::string_view declaration, int digits, const auto& ofDead, const auto& numbers) {
    std::vector<std::optional<Shape>> before(drawn); // the last in which the particle lived
    field.attribute(declaration, 0.05, [&](const Gaussians& gaussians, const Progress&) {
      const std::vector<size_t> indices = indicesOf(gaussians, drawn);
      writeEntries(file, 0, drawn, [&](size_t i, Text& text) {
        const size_t index = indices[i];
        if (index >= gaussians.size()) return addTuple(ofDead, digits, text);
        const Shape shape = gaussians.shape(index);
        before[i] = before[i] ? nearestTo(*before[i], shape) : shape;
        addTuple(numbers(*before[i]), digits, text);
      });
    });
  };
  using Triple = std::array<float, 3>;
  field.attribute("float3[] extent", 0.02, [&](const Gaussians& gaussians, const Progress&) {
    Vec3<float> low = Vec3<float>::Zero(), high = low;
    for (size_t i = 0; i < gaussians.size(); ++i) {
      const Shape shape = gaussians.shape(i);
      const Vec3<float> reach = Vec3<float>::Constant(3 * shape.scale[0]); // of the kernel, nearly all
      low = i == 0 ? Vec3<float>(shape.center - reach) : Vec3<float>(low.cwiseMin(shape.center - reach));
      high = i == 0 ? Vec3<float>(shape.center + reach) : Vec3<float>(high.cwiseMax(shape.center + reach));
    }
    Text text;
    addTuple(low, kPositionDigits, text);
    text.append(std::string_view(", "));
    addTuple(high, kPositionDigits, text);
    file.write(std::string_view(text.data(), text.size()));
  });
  shapes("point3f[] positions", kPositionDigits, Triple{}, [](const Shape& shape) {
    return Triple{shape.center[0], shape.center[1], shape.center[2]};
  });
  shapes("quatf[] orientations", kRotationDigits, std::array<float, 4>{1, 0, 0, 0},
         [](const Shape& shape) { return shape.rotation; });
  shapes("float3[] scales", kScaleDigits, Triple{}, [](const Shape& shape) { return shape.scale; });
  file.write(fmt::format("    uniform int radiance:sphericalHarmonicsDegree = {}\n", degree));
  std::vector<float> opacities(drawn, -1); // -1: it has not lived yet
  const auto colors = [&](const Gaussians& gaussians, const Progress& part) {
    const std::vector<size_t> indices = indicesOf(gaussians, drawn);
    const size_t parts = (drawn + kAtOnce - 1) / kAtOnce;
    for (size_t p = 0, first = 0; p < parts; ++p) {
      const size_t begin = p * kAtOnce, end = std::min(drawn, begin + kAtOnce);
      size_t last = first;
      while (last < gaussians.size() && gaussians.alive()[last] < end) ++last;
      const std::vector<Look> looks = gaussians.looks(first, last, degree, stepOf(part, kStage, p, parts));
      writeEntries(file, begin, end, [&](size_t i, Text& text) {
        const bool lives = indices[i] < gaussians.size();
        const Look look = lives ? looks[indices[i] - first] : Look{};
        if (lives && opacities[i] < 0) opacities[i] = look.opacity;
        for (size_t j = 0; j < perParticle; ++j) {
          Color color = look.color[j];
          if (j == 0)
            for (double& channel : color) channel -= 0.5 / kConstantHarmonic;
          if (j > 0) text.append(std::string_view(", "));
          addTuple(color, kColorDigits, text);
        }
      });
      first = last;
    }
  };
  field.attribute("float3[] radiance:sphericalHarmonicsCoefficients", 0.8, colors);
  if (std::ranges::all_of(opacities, [](float opacity) { return opacity < 0; }))
    throw Error("no surfel has a place and an area in any frame once warped").in(path);
  file.write("    float[] opacities = [");
  writeEntries(file, 0, drawn, [&](size_t i, Text& text) {
    fmt::format_to(std::back_inserter(text), "{:.{}g}", std::max(0.f, opacities[i]), kColorDigits);
  });
  file.write("]\n}\n");
  file.commit();
}

} // namespace surflect::gaussians
