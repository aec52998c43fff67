// One block of a view: 8x8 pixels under all of the view's lights, factored as  X ~ E A.
//
// X has a row for each object texel and colour channel, and a column for each light; E holds K eigenimages,
// A their coefficients, which the three channels share. The mean is not taken off: it would be one more
// eigenimage. [Weyrich 2005, §5.3] stores such "PCA data"; what follows is ours: each term, an
// eigenimage with its coefficients, has its own precision, and rank and precisions are the cheapest that keep
// the block's error bound.
//
// The record of a block is specified to the byte in docs/format.md.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace surflect::codec {

inline constexpr int blockSize = 8; // pixels a side
inline constexpr int blockTexels = blockSize * blockSize;

// What a look-up needs of a block, wherever it is kept: eigenimages as levels of 8 bits, and coefficients
// times what a level stands for, so that X' is their product. Terms at 16 bits are two here, of high and of
// low levels.
struct BlockTerms {
  int rank = 0;                        // K, of terms as they are stored
  int stride = 0;                      // terms here, rounded up to a multiple of 8; what is too many is zero
  const float* coefficients = nullptr; // [lights][stride]
  const int8_t* levels = nullptr;      // [64 texels][3 channels][stride]

  const float* light(size_t l) const { return coefficients + l * stride; }
  const int8_t* texel(int t) const { return levels + static_cast<size_t>(t) * 3 * stride; }
};

// Where they lie in the values of a Block: coefficients, then levels.
constexpr size_t levelsOffset(int stride, size_t lights) { return lights * stride * sizeof(float); }
constexpr size_t valuesBytes(int stride, size_t lights) {
  return levelsOffset(stride, lights) + size_t{3 * blockTexels} * stride;
}
inline BlockTerms blockTerms(int rank, int stride, size_t lights, const std::byte* values) {
  return {rank, stride, reinterpret_cast<const float*>(values),
          reinterpret_cast<const int8_t*>(values + levelsOffset(stride, lights))};
}

// Bytes that begin a line of the processor's cache: eight coefficients are never in two. Not set; not read
// once moved from.
class CacheLines {
public:
  CacheLines() = default;
  explicit CacheLines(size_t size)
      : size_(size), room_(std::make_unique_for_overwrite<std::byte[]>(size + kLine - 1)) {}

  std::byte* data() {
    std::byte* const begin = room_.get();
    if (!begin) return nullptr;
    return begin + (kLine - reinterpret_cast<uintptr_t>(begin) % kLine) % kLine;
  }
  const std::byte* data() const { return const_cast<CacheLines*>(this)->data(); }
  std::span<const std::byte> bytes() const { return {data(), size_}; }
  size_t memory() const { return room_ ? size_ + kLine - 1 : 0; }
  friend bool operator==(const CacheLines& a, const CacheLines& b) {
    return std::ranges::equal(a.bytes(), b.bytes());
  }

private:
  static constexpr size_t kLine = 64;

  size_t size_ = 0;
  std::unique_ptr<std::byte[]> room_;
};

// A block ready for look-ups. Absent texels are filled from the nearest present one, so that bilinear
// interpolation inside the block never mixes background in.
struct Block {
  int rank = 0, stride = 0; // as BlockTerms has them
  uint64_t present = 0;     // as given to encodeBlock
  size_t lights = 0;
  CacheLines values; // of blockTerms

  BlockTerms terms() const { return blockTerms(rank, stride, lights, values.data()); }
  const float* light(size_t l) const { return terms().light(l); }
  const int8_t* texel(int t) const { return terms().texel(t); }
  size_t memory() const { return sizeof(Block) + values.memory(); }
};

// Throws Error where the record is not one of a block under so many lights.
Block decodeBlock(std::span<const std::byte> record, size_t lights);

} // namespace surflect::codec
