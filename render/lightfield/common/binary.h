// Numbers in files of light fields: little-endian, one after another.
#pragma once

#include "surfel/base/error.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace surflect::lightfield {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in memory");

template <class T> void append(std::vector<std::byte>& bytes, std::span<const T> values) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto raw = std::as_bytes(values);
  bytes.insert(bytes.end(), raw.begin(), raw.end());
}

inline void append(std::vector<std::byte>& bytes, uint64_t number) {
  append(bytes, std::span<const uint64_t>(&number, 1));
}

// Takes numbers from the front of bytes. Each throws Error naming the field where there are too few.
class Reader {
public:
  explicit Reader(std::span<const std::byte> bytes) : rest_(bytes) {}

  size_t left() const { return rest_.size(); }

  template <class T> std::vector<T> takeMany(uint64_t count, const std::string& field) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (count > rest_.size() / sizeof(T))
      throw Error::mismatch(std::to_string(count) + " values", std::to_string(rest_.size()) + " more bytes")
          .at(field);
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), rest_.data(), count * sizeof(T));
    rest_ = rest_.subspan(count * sizeof(T));
    return values;
  }
  // A number of 8 bytes. Throws Error also outside lowest..highest.
  uint64_t take(uint64_t lowest, uint64_t highest, const std::string& field) {
    const uint64_t number = takeMany<uint64_t>(1, field)[0];
    if (number < lowest || number > highest)
      throw Error::mismatch(std::to_string(lowest) + ".." + std::to_string(highest), std::to_string(number))
          .at(field);
    return number;
  }
  // Throws Error unless the next bytes are the given ones.
  void takeStart(std::string_view expected) {
    const std::vector<char> found = takeMany<char>(expected.size(), "start");
    if (std::string_view(found.data(), found.size()) != expected)
      throw Error::mismatch('"' + std::string(expected) + '"', "something else").at("start");
  }
  void requireEnd() const {
    if (left() > 0) throw Error::mismatch("the end", std::to_string(left()) + " more bytes").at("end");
  }

private:
  std::span<const std::byte> rest_;
};

} // namespace surflect::lightfield
