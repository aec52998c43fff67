// Look-ups by chunks: a chunk is as many terms of a job as a vector has lanes. Sums run over the weights of a
// light, then over lights, taps, terms of a chunk, and chunks.
#include "srf/shading/block_lookup.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "srf/shading/block_lookup.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::shading {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// No wider, since blocks have few terms and further lanes would stay empty.
using Tag = hn::CappedTag<float, 8>;
using Vector = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr size_t kWidth = hn::MaxLanes(Tag());

// Chunks processed together: each has four sums, which must stay in registers.
constexpr size_t kChunksAtOnce = HWY_TARGET <= HWY_AVX3 ? 6 : 3;

HWY_INLINE Vector load(const float* from) { return hn::LoadU(kTag, from); }
HWY_INLINE Vector number(float x) { return hn::Set(kTag, x); }
HWY_INLINE Vector levels(const int8_t* from) {
  const hn::Rebind<int8_t, Tag> bytes;
  const hn::Rebind<int32_t, Tag> whole;
  return hn::ConvertTo(kTag, hn::PromoteTo(whole, hn::LoadU(bytes, from)));
}

struct Chunk {
  const BlockLookup* job;
  size_t first; // term
};

// A row of weights::LightRows.
struct Row {
  const weights::BlendedLight* lights;
  size_t count;
  const weights::LightWeight* weights;
};

// Sums of a chunk over lights, one number for each term, by channel.
struct Channels {
  Vector red, green, blue;
};

// c_k = sum_i color_i sum_l w_il a_lk of `count` chunks. If `sameStride`, a light has the same offset in all
// of them.
template <size_t count, bool sameStride>
HWY_INLINE void addLights(const Row& row, const Chunk* chunks, Channels* sums) {
  const float* coefficients[count];
  size_t strides[count];
#pragma GCC unroll 8
  for (size_t i = 0; i < count; ++i) {
    coefficients[i] = chunks[i].job->coefficients + chunks[i].first;
    strides[i] = chunks[i].job->stride;
    sums[i] = {hn::Zero(kTag), hn::Zero(kTag), hn::Zero(kTag)};
  }
  for (const weights::BlendedLight* light = row.lights; light != row.lights + row.count; ++light) {
    Vector blended[count];
#pragma GCC unroll 8
    for (Vector& b : blended) b = hn::Zero(kTag);
    for (const weights::LightWeight* of = row.weights + light->begin; of != row.weights + light->end; ++of) {
      const Vector weight = number(of->weight);
      const size_t place = of->light * strides[0];
#pragma GCC unroll 8
      for (size_t i = 0; i < count; ++i)
        blended[i] = hn::MulAdd(weight, load(coefficients[i] + (sameStride ? place : of->light * strides[i])),
                                blended[i]);
    }
    const Vector red = number(light->color.r), green = number(light->color.g), blue = number(light->color.b);
#pragma GCC unroll 8
    for (size_t i = 0; i < count; ++i)
      sums[i] = {hn::MulAdd(red, blended[i], sums[i].red), hn::MulAdd(green, blended[i], sums[i].green),
                 hn::MulAdd(blue, blended[i], sums[i].blue)};
  }
}

// Adds the sums of three vectors to rgb, adding neighbours first.
HWY_INLINE void addTo(float* rgb, Vector red, Vector green, Vector blue) {
#if HWY_TARGET == HWY_SCALAR
  rgb[0] += hn::GetLane(red);
  rgb[1] += hn::GetLane(green);
  rgb[2] += hn::GetLane(blue);
#else
  const hn::CappedTag<float, 4> four;
  using Four = hn::Vec<decltype(four)>;
  const auto inFour = [four](auto x) HWY_ATTR {
    if constexpr (kWidth == 8)
      return hn::LowerHalf(four, x) + hn::UpperHalf(four, x);
    else
      return x;
  };
  const auto pairSums = [four](Four a, Four b) // a0 + a1, a2 + a3, b0 + b1, b2 + b3
      HWY_ATTR { return hn::ConcatEven(four, b, a) + hn::ConcatOdd(four, b, a); };
  const Four b = inFour(blue), sums = pairSums(pairSums(inFour(red), inFour(green)), pairSums(b, b));
  hn::StoreU(hn::LoadU(four, rgb) + sums, four, rgb);
#endif
}

// Adds sum_k c_k (sum over taps of tap * e_k) to the job's radiance.
HWY_INLINE void addTaps(const Chunk& chunk, const Channels& folded) {
  const BlockLookup& job = *chunk.job;
  const int8_t* texels = job.levels + chunk.first;
  const size_t stride = job.stride;
  Channels e{hn::Zero(kTag), hn::Zero(kTag), hn::Zero(kTag)};
#pragma GCC unroll 4
  for (size_t t = 0; t < 4; ++t) {
    const Vector weight = number(job.weights[t]);
    const int8_t* texel = texels + (t % 2 != 0 ? job.right : 0) + (t / 2 != 0 ? job.down : 0);
    e = {hn::MulAdd(weight, levels(texel), e.red), hn::MulAdd(weight, levels(texel + stride), e.green),
         hn::MulAdd(weight, levels(texel + 2 * stride), e.blue)};
  }
  addTo(job.rgb, folded.red * e.red, folded.green * e.green, folded.blue * e.blue);
}

template <size_t count> HWY_INLINE void answerAll(const Row& row, const Chunk* chunks) {
  Channels sums[count];
  bool isSame = true;
  for (size_t i = 1; i < count; ++i) isSame &= chunks[i].job->stride == chunks[0].job->stride;
  if (isSame)
    addLights<count, true>(row, chunks, sums);
  else
    addLights<count, false>(row, chunks, sums);
#pragma GCC unroll 8
  for (size_t i = 0; i < count; ++i) addTaps(chunks[i], sums[i]);
}

// Processes `count` chunks, 1..most.
template <size_t most> HWY_INLINE void answer(const Row& row, const Chunk* chunks, size_t count) {
  if (count == most) return answerAll<most>(row, chunks);
  if constexpr (most > 1) answer<most - 1>(row, chunks, count);
}

// Jobs in few blocks: the sums over lights are kept for the blocks that were looked up last.
HWY_INLINE void lookUpInFewBlocks(const Row& row, const BlockLookup* jobs, size_t count) {
  constexpr size_t kBits = 5, kMostChunks = 16 / kWidth;
  constexpr uint64_t kGolden = 0x9e3779b97f4a7c15; // 2^64 over the golden ratio
  const float* held[size_t{1} << kBits]{};         // coefficients of the blocks
  Channels sums[size_t{1} << kBits][kMostChunks];
  for (const BlockLookup* job = jobs; job != jobs + count; ++job) {
    const size_t chunks = job->stride / kWidth;
    if (chunks > kMostChunks) {
      for (size_t first = 0; first < job->stride; first += kWidth) {
        const Chunk chunk{job, first};
        answerAll<1>(row, &chunk);
      }
      continue;
    }
    const size_t slot = reinterpret_cast<uintptr_t>(job->coefficients) * kGolden >> (64 - kBits);
    for (size_t i = 0; i < chunks; ++i) {
      const Chunk chunk{job, i * kWidth};
      if (held[slot] != job->coefficients) addLights<1, true>(row, &chunk, &sums[slot][i]);
      addTaps(chunk, sums[slot][i]);
    }
    held[slot] = job->coefficients;
  }
}

void lookUp(const weights::BlendedLight* lights, size_t lightCount, const weights::LightWeight* weights,
            const BlockLookup* jobs, size_t count) {
  constexpr size_t kFewBlocks = 16; // of a single surfel and all its views
  const Row row{lights, lightCount, weights};
  if (count > kFewBlocks) return lookUpInFewBlocks(row, jobs, count);
  Chunk chunks[kChunksAtOnce];
  size_t held = 0;
  for (const BlockLookup* job = jobs; job != jobs + count; ++job)
    for (size_t first = 0; first < job->stride; first += kWidth) {
      chunks[held++] = {job, first};
      if (held < kChunksAtOnce) continue;
      answerAll<kChunksAtOnce>(row, chunks);
      held = 0;
    }
  if (held > 0) answer<kChunksAtOnce - 1>(row, chunks, held);
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::shading
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::shading {

HWY_EXPORT(lookUp);
void lookUp(const weights::BlendedLight* row, size_t lights, const weights::LightWeight* weights,
            const BlockLookup* jobs, size_t count) {
  HWY_DYNAMIC_DISPATCH(lookUp)(row, lights, weights, jobs, count);
}

} // namespace surflect::shading
#endif
