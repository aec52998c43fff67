#include "srf/image/deflate.h"

#include <libdeflate.h>

#include <cassert>
#include <memory>
#include <new>

namespace surflect::image {

namespace {

struct Free {
  void operator()(libdeflate_compressor* compressor) const { ::libdeflate_free_compressor(compressor); }
};
using Compressor = std::unique_ptr<libdeflate_compressor, Free>;

} // namespace

std::string zlibStream(std::span<const std::byte> bytes) {
  constexpr int kFastest = 1;
  static thread_local const Compressor compressor(::libdeflate_alloc_compressor(kFastest));
  if (!compressor) throw std::bad_alloc();
  std::string stream(::libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  const size_t size =
      ::libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), stream.data(), stream.size());
  assert(size > 0); // the bound is large enough
  stream.resize(size);
  return stream;
}

} // namespace surflect::image
