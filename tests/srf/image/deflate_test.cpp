#include "srf/image/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <random>
#include <string>

namespace surflect {
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

// Frequencies like Fibonacci's ask for codes of up to 22 bits, where deflate has 15.
TEST(Deflate, CodesThatWouldBeTooLongAreCutOff) {
  std::string bytes;
  size_t count = 1, next = 1;
  for (char c = 0; c < 22; ++c) {
    bytes.append(count, c);
    next = std::exchange(count, next) + next;
  }
  std::mt19937 random(2);
  std::shuffle(bytes.begin(), bytes.end(), random);
  ASSERT_LT(bytes.size(), 65536u); // in one block
  expectBack(bytes);
}

TEST(Deflate, IsAboutAsSmallAsZlibsRunsAndCodes) {
  const std::string bytes = skewedBytes(500'000, 3);
  std::string wanted(bytes.size(), '\0');
  z_stream stream{};
  ASSERT_EQ(::deflateInit2(&stream, 6, Z_DEFLATED, 15, 9, Z_RLE), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(wanted.data());
  stream.avail_out = static_cast<uInt>(wanted.size());
  EXPECT_EQ(::deflate(&stream, Z_FINISH), Z_STREAM_END);
  ::deflateEnd(&stream);
  EXPECT_LT(static_cast<double>(packed(bytes).size()), 1.01 * static_cast<double>(stream.total_out));
}

} // namespace
} // namespace surflect
