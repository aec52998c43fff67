// Files of our own formats. A description names each field of a file once, with its bounds. By it, an archive
// writes a value or reads it:
//
//   void describe(Archive& archive, Grid& grid) {
//     size_t points = grid.points.size();
//     archive.magic("srf grid");
//     archive.constant<uint32_t>("version", 1);
//     archive.number<uint32_t>("points", points, {1, 1000});
//     archive.array<float>("points", grid.points, points);
//   }
//
//   const std::vector<std::byte> file = written(grid, describe);
//   parse(file, [&](Archive& archive) { describe(archive, grid); });
//
// Numbers are little-endian, one after another. A file that breaks its description is an Error that names the
// field: a number out of its range, a float that is not finite, a missing byte, a further byte. A reader
// takes memory only as the file has bytes for it. A writer checks nothing, and does not change the value.
#pragma once

#include "surfel/base/error.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace surflect {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

// Numbers from lowest to highest; NaN is in no range.
template <class Number> struct Range {
  Number lowest = std::numeric_limits<Number>::lowest(), highest = std::numeric_limits<Number>::max();

  bool holds(Number number) const { return number >= lowest && number <= highest; }
};

// Range of the indices of `end` elements.
struct Below {
  uint64_t end;

  template <class Number> operator Range<Number>() const {
    if (end == 0) return {1, 0};
    return {0, static_cast<Number>(std::min<uint64_t>(end - 1, std::numeric_limits<Number>::max()))};
  }
};

class Archive {
public:
  Archive() = default;                                 // writes
  explicit Archive(std::span<const std::byte> content) // reads
      : isReading_(true), content_(content), rest_(content) {}

  bool isReading() const { return isReading_; }
  // Bytes that have not been read; 0 for a writer.
  size_t left() const { return rest_.size(); }
  std::vector<std::byte> bytes() && { return std::move(written_); }

  // Text that tells the format.
  void magic(std::string_view text);

  // Number, stored as Stored. The range must be one of Value's, too.
  template <class Stored, class Value> void number(std::string_view name, Value& value, Range<Stored> range) {
    auto stored = static_cast<Stored>(value);
    numbers<Stored>(name, std::span(&stored, 1), range);
    if (isReading_) value = static_cast<Value>(stored);
  }
  // Number that can have one value only.
  template <class Stored> void constant(std::string_view name, std::type_identity_t<Stored> value) {
    number<Stored>(name, value, {value, value});
  }
  // Enumeration whose values are 0..last.
  template <class Stored, class Enum> void choice(std::string_view name, Enum& value, Enum last) {
    number<Stored>(name, value, {0, static_cast<Stored>(last)});
  }

  // Elements, each a number or several.
  template <class Number, class Elements>
  void numbers(std::string_view name, Elements&& elements, Range<Number> range = {}) {
    const std::span span(elements);
    constexpr size_t kPerElement = sizeof(span[0]) / sizeof(Number);
    static_assert(sizeof(span[0]) % sizeof(Number) == 0);
    raw(name, std::as_writable_bytes(span));
    if (!isReading_) return;
    const auto* const first = reinterpret_cast<const Number*>(span.data());
    for (size_t i = 0; i < kPerElement * span.size(); ++i)
      if (!range.holds(first[i])) {
        Error error = Error::mismatch(textOf(range), textOf(first[i]));
        if (span.size() > 1) error = std::move(error).at('[' + std::to_string(i / kPerElement) + ']');
        throw std::move(error).at(name);
      }
  }
  // A vector of `count` elements, which is stated elsewhere. A writer writes all that there are.
  template <class Number, class Vector>
  void array(std::string_view name, Vector& elements, size_t count, Range<Number> range = {}) {
    if (isReading_) {
      requireLeft(name, count, sizeof(elements[0]));
      elements.resize(count);
    }
    numbers<Number>(name, elements, range);
  }
  // Such a vector of structures: work(element) describes one. Each takes a byte at least, so that a wrong
  // count ends with the file.
  template <class Vector, class Work>
  void each(std::string_view name, Vector& elements, size_t count, const Work& work) {
    for (size_t i = 0; i < (isReading_ ? count : elements.size()); ++i) try {
        work(isReading_ ? elements.emplace_back() : elements[i]);
      } catch (Error& error) {
        throw std::move(error).at('[' + std::to_string(i) + ']').at(name);
      }
  }

  // contentHash() of all bytes before; and a checksum, which must agree with it.
  uint64_t hash() const;
  void checksum(std::string_view name, uint64_t hash);

  // Bytes that are read in another way: all that are left.
  std::span<const std::byte> rest() { return std::exchange(rest_, {}); }
  // Throws Error unless all bytes have been read.
  void end() const;

private:
  template <class Number> static std::string textOf(Number number) {
    if constexpr (std::is_integral_v<Number>)
      return std::to_string(number);
    else
      return numberText(static_cast<double>(number));
  }
  template <class Number> static std::string textOf(const Range<Number>& range) {
    if (range.lowest == range.highest) return textOf(range.lowest);
    if (range.highest < std::numeric_limits<Number>::max())
      return textOf(range.lowest) + ".." + textOf(range.highest);
    const std::string number = std::is_integral_v<Number> ? "a number" : "a finite number";
    return range.lowest == Range<Number>().lowest ? number : number + " of at least " + textOf(range.lowest);
  }
  void raw(std::string_view name, std::span<std::byte> field);
  void requireLeft(std::string_view name, size_t count, size_t elementBytes) const;

  bool isReading_ = false;
  std::vector<std::byte> written_;
  std::span<const std::byte> content_, rest_;
};

// Bytes of a value by describe(archive, value).
template <class Value, class Describe>
std::vector<std::byte> written(const Value& value, const Describe& describe) {
  Archive archive;
  describe(archive, const_cast<Value&>(value)); // which a writer does not change
  return std::move(archive).bytes();
}

// Reads bytes by describe(archive). Throws Error.
template <class Describe> void parse(std::span<const std::byte> bytes, const Describe& describe) {
  Archive archive(bytes);
  describe(archive);
  archive.end();
}

} // namespace surflect
