#include "srf/image/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <random>
#include <string>

namespace surflect::image {
namespace {

std::string inflated(const std::string& stream, size_t size) {
  std::string bytes(size + 1, '\0'); // room for one too many
  uLongf got = bytes.size();
  EXPECT_EQ(::uncompress(reinterpret_cast<Bytef*>(bytes.data()), &got,
                         reinterpret_cast<const Bytef*>(stream.data()), stream.size()),
            Z_OK);
  bytes.resize(got);
  return bytes;
}

std::string packed(const std::string& bytes) { return zlibStream(std::as_bytes(std::span(bytes))); }

void expectBack(const std::string& bytes) {
  EXPECT_TRUE(inflated(packed(bytes), bytes.size()) == bytes) << bytes.size() << " bytes";
}

// Bytes of which each is about as frequent as all rarer ones together, and runs of all lengths.
std::string skewedBytes(size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::geometric_distribution<int> value(0.4), length(0.01);
  std::string bytes;
  while (bytes.size() < size)
    bytes.append(random() % 32 == 0 ? static_cast<size_t>(length(random)) : 1,
                 static_cast<char>(value(random)));
  bytes.resize(size);
  return bytes;
}

TEST(Deflate, ZlibReadsBackWhatWasWritten) {
  std::mt19937 random(1);
  std::string noise(200'000, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  for (const size_t size : {0, 1, 2, 3, 4, 257, 258, 259, 260, 65535, 65536, 65537, 65539, 131072, 200'000}) {
    expectBack(std::string(size, 'x'));
    expectBack(noise.substr(0, size));
    expectBack(skewedBytes(size, static_cast<unsigned>(size)));
  }
}

TEST(Deflate, InflatesWholeStreamsOfTheirSizeAlone) {
  const std::string bytes = skewedBytes(1000, 7);
  for (const size_t effort : {1, 6, 12}) {
    const std::string stream = zlibStream(std::as_bytes(std::span(bytes)), effort);
    const auto inflates = [&](const std::string& packed, size_t size) {
      std::string found(size, '\0');
      return inflatesTo(std::as_bytes(std::span(packed)), std::as_writable_bytes(std::span(found))) &&
             found == bytes;
    };
    EXPECT_TRUE(inflates(stream, 1000));
    for (const size_t size : {0, 999, 1001}) EXPECT_FALSE(inflates(stream, size));
    for (size_t size = 0; size < stream.size(); ++size) EXPECT_FALSE(inflates(stream.substr(0, size), 1000));
    EXPECT_FALSE(inflates(stream + '\0', 1000));
  }
}

} // namespace
} // namespace surflect::image
