// Little-endian serialisation: appends values to a byte buffer, and reads them with bounds checks.
#pragma once

#include "surfel/base/error.h"

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace surflect::codec {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in memory");

template <class T> void append(std::vector<std::byte>& bytes, const T& value) {
  static_assert(std::is_arithmetic_v<T>);
  const auto raw = std::as_bytes(std::span(&value, 1));
  bytes.insert(bytes.end(), raw.begin(), raw.end());
}

class ByteReader {
public:
  explicit ByteReader(std::span<const std::byte> bytes) : rest_(bytes) {}

  // Both throw Error if fewer bytes are left.
  std::span<const std::byte> take(size_t count) {
    if (count > rest_.size())
      throw Error::mismatch("at least " + std::to_string(count) + " more bytes",
                            std::to_string(rest_.size()) + " bytes");
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  template <class T> T take() {
    static_assert(std::is_arithmetic_v<T>);
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }

  size_t left() const { return rest_.size(); }

private:
  std::span<const std::byte> rest_;
};

} // namespace surflect::codec
