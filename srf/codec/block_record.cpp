#include "srf/codec/block_record.h"

#include <Imath/half.h>

#include <algorithm>
#include <cstring>
#include <span>

namespace surflect::codec {

namespace {

// Writes into a buffer of sufficient size.
class RecordWriter {
public:
  explicit RecordWriter(std::byte* to) : to_(to) {}

  template <class T> void put(T value) {
    std::memcpy(to_, &value, sizeof value);
    to_ += sizeof value;
  }
  void putLevels(std::span<const float> levels, int bits) {
    if (bits == 16)
      for (const float level : levels) put(static_cast<int16_t>(level));
    else if (bits == 8)
      for (const float level : levels) put(static_cast<int8_t>(level));
    else
      for (size_t i = 0; i < levels.size(); i += 2) {
        const int low = static_cast<int>(levels[i]);
        const int high = i + 1 < levels.size() ? static_cast<int>(levels[i + 1]) : 0;
        put(static_cast<uint8_t>((low & 15) | (high & 15) << 4));
      }
  }

private:
  std::byte* to_;
};

} // namespace

void describeRecordHead(Archive& archive, RecordHead& head) {
  archive.number<uint8_t>("flags", head.flags, {0, floatCoefficients | partialBlock});
  archive.numbers<uint8_t>("terms", head.terms);
  if (head.flags & partialBlock) archive.number<uint64_t>("present", head.present, {1});
}

PaddedRows<double> radiancePerLevel(const StoredTerms& stored, size_t lights) {
  PaddedRows<double> perLevel(stored.terms.size(), lights);
  for (size_t k = 0; k < stored.terms.size(); ++k) {
    const StoredTerm& term = stored.terms[k];
    double* const to = perLevel.row(k);
    if (term.bits == 16)
      for (size_t l = 0; l < lights; ++l) to[l] = double{inImageSteps(term.coefficients[l])};
    else
      for (size_t l = 0; l < lights; ++l)
        to[l] = double{static_cast<float>(levelInImageSteps(term.peak, term.bits) * term.lightLevels[l])};
  }
  return perLevel;
}

std::vector<std::byte> recordOf(uint64_t present, size_t lights, const StoredTerms& stored) {
  const bool half = stored.type == CoefficientType::half, partial = present != allPresent;
  RecordHead head{
      static_cast<uint8_t>((half ? 0 : floatCoefficients) | (partial ? partialBlock : 0)), {}, present};
  for (size_t p = 0; p < precisions.size(); ++p)
    head.terms[p] = static_cast<uint8_t>(std::ranges::count(stored.terms, precisions[p], &StoredTerm::bits));
  std::vector<std::byte> record = written(head, describeRecordHead);
  const size_t headBytes = record.size();
  size_t bytes = headBytes;
  for (const StoredTerm& term : stored.terms)
    bytes += coefficientBytes(lights, term.bits, stored.type) + levelBytes(term.levels.size(), term.bits);
  record.resize(bytes);
  RecordWriter writer(record.data() + headBytes);
  for (const StoredTerm& term : stored.terms) {
    if (term.bits < 16) {
      writer.put(term.peak);
      writer.putLevels(term.lightLevels, term.bits);
    }
    for (const float a : term.coefficients)
      if (half)
        writer.put(imath_float_to_half(a));
      else
        writer.put(a);
    writer.putLevels(term.levels, term.bits);
  }
  return record;
}

} // namespace surflect::codec
