#include "srf/image/deflate.h"

#include <libdeflate.h>

#include <array>
#include <cassert>
#include <memory>
#include <new>

namespace surflect::image {

namespace {

struct Free {
  void operator()(libdeflate_compressor* compressor) const { ::libdeflate_free_compressor(compressor); }
  void operator()(libdeflate_decompressor* decompressor) const {
    ::libdeflate_free_decompressor(decompressor);
  }
};

} // namespace

std::string zlibStream(std::span<const std::byte> bytes, size_t effort) {
  static thread_local std::array<std::unique_ptr<libdeflate_compressor, Free>, 13> compressors;
  auto& compressor = compressors.at(effort);
  if (!compressor) compressor.reset(::libdeflate_alloc_compressor(static_cast<int>(effort)));
  if (!compressor) throw std::bad_alloc();
  std::string stream(::libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  const size_t size =
      ::libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), stream.data(), stream.size());
  assert(size > 0); // the bound is large enough
  stream.resize(size);
  return stream;
}

bool inflatesTo(std::span<const std::byte> stream, std::span<std::byte> bytes) {
  static thread_local const std::unique_ptr<libdeflate_decompressor, Free> decompressor(
      ::libdeflate_alloc_decompressor());
  if (!decompressor) throw std::bad_alloc();
  size_t read = 0, made = 0;
  return ::libdeflate_zlib_decompress_ex(decompressor.get(), stream.data(), stream.size(), bytes.data(),
                                         bytes.size(), &read, &made) == LIBDEFLATE_SUCCESS &&
         read == stream.size() && made == bytes.size();
}

} // namespace surflect::image
