// [RFC 1950] Deutsch, Gailly: ZLIB Compressed Data Format Specification 3.3.
// [RFC 1951] Deutsch: DEFLATE Compressed Data Format Specification 1.3.
#include "srf/image/deflate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

namespace surflect {

namespace {

constexpr size_t kBlockBytes = 1 << 16; // of input: each block has codes of its own
constexpr size_t kLiterals = 256, kEndOfBlock = 256;
constexpr size_t kShortestRun = 3, kLongestRun = 258; // [RFC 1951, 3.2.5]
constexpr size_t kSymbols = 286;
constexpr size_t kTokens = kLiterals + kLongestRun + 1;

// A literal is a token below kLiterals, a run is kLiterals plus its length.
using Token = uint16_t;

struct Code {
  uint64_t bits = 0;
  int length = 0;
};

// Two codes, one behind the other.
Code operator+(Code first, Code second) {
  return {first.bits | second.bits << first.length, first.length + second.length};
}

// Bits of a byte are filled from the least significant on [RFC 1951, 3.1.1].
class BitWriter {
public:
  // Nothing is written beyond so many bytes.
  explicit BitWriter(size_t room) : bytes_(std::make_unique_for_overwrite<char[]>(room + sizeof pending_)) {}

  void put(Code code) { // of at most 56 bits
    pending_ |= code.bits << pendingBits_;
    pendingBits_ += code.length;
    static_assert(std::endian::native == std::endian::little);
    std::memcpy(&bytes_[end_], &pending_, sizeof pending_);
    end_ += static_cast<size_t>(pendingBits_) / 8;
    pending_ >>= pendingBits_ & ~7;
    pendingBits_ &= 7;
  }
  // The bytes that are full, or all.
  void moveTo(std::string& out, bool all) {
    if (all && pendingBits_ > 0) put({0, 8 - pendingBits_});
    out.append(bytes_.get(), std::exchange(end_, 0));
  }

private:
  std::unique_ptr<char[]> bytes_;
  size_t end_ = 0;
  uint64_t pending_ = 0;
  int pendingBits_ = 0; // fewer than 8 between calls
};

// How often bytes[at] comes again in a row, up to `end` and the longest run.
size_t runLength(const std::byte* bytes, size_t at, size_t end) {
  const size_t last = std::min(end, at + kLongestRun);
  const uint64_t pattern = 0x0101010101010101u * std::to_integer<uint64_t>(bytes[at]);
  size_t i = at + 1;
  for (uint64_t eight; i + sizeof eight <= last; i += sizeof eight) {
    std::memcpy(&eight, bytes + i, sizeof eight);
    if (eight != pattern) return i - at + static_cast<size_t>(std::countr_zero(eight ^ pattern)) / 8;
  }
  while (i < last && bytes[i] == bytes[at]) ++i;
  return i - at;
}

// Divides bytes [begin, end) into literals and runs; they lie in the memory of `tokens`.
std::span<const Token> tokenize(const std::byte* bytes, size_t begin, size_t end,
                                std::vector<Token>& tokens) {
  tokens.resize(std::max(tokens.size(), end - begin));
  Token* next = tokens.data();
  for (size_t i = begin; i < end;) {
    if (i > 0 && bytes[i] == bytes[i - 1])
      if (const size_t length = runLength(bytes, i, end); length >= kShortestRun) {
        *next++ = static_cast<Token>(kLiterals + length);
        i += length;
        continue;
      }
    *next++ = std::to_integer<Token>(bytes[i++]);
  }
  return {tokens.data(), next};
}

// The symbol of a run, and the bits behind its code [RFC 1951, 3.2.5].
struct RunSymbol {
  size_t symbol;
  Code extra;
};
RunSymbol symbolOfRun(size_t length) {
  const size_t beyond = length - kShortestRun;
  if (length == kLongestRun) return {285, {}};
  if (beyond < 8) return {257 + beyond, {}};
  const int extra = static_cast<int>(std::bit_width(beyond)) - 3;
  return {257 + 4 * static_cast<size_t>(extra) + (beyond >> extra),
          {beyond & ((size_t{1} << extra) - 1), extra}};
}

// Lengths of a Huffman code over the symbols that occur, at least two of them; 0 for the others.
std::vector<uint8_t> codeLengths(std::span<const uint32_t> counts, int longest) {
  std::vector<std::pair<uint32_t, size_t>> symbols; // count and symbol, rarest first
  for (size_t s = 0; s < counts.size(); ++s)
    if (counts[s] > 0) symbols.emplace_back(counts[s], s);
  assert(symbols.size() >= 2);
  std::ranges::sort(symbols);

  // Nodes 0 .. n-1 are the leaves, the others in the order in which they are joined: both rise in weight.
  const size_t n = symbols.size(), root = 2 * n - 2;
  std::vector<uint64_t> weight(root + 1);
  std::vector<size_t> parent(root + 1);
  for (size_t i = 0; i < n; ++i) weight[i] = symbols[i].first;
  size_t leaf = 0, inner = n;
  for (size_t joined = n; joined <= root; ++joined)
    for (int child = 0; child < 2; ++child) {
      const size_t lighter =
          leaf < n && (inner >= joined || weight[leaf] <= weight[inner]) ? leaf++ : inner++;
      weight[joined] += weight[lighter];
      parent[lighter] = joined;
    }
  std::vector<int> depth(root + 1);
  std::vector<uint32_t> ofLength(static_cast<size_t>(longest) + 1);
  for (size_t node = root; node-- > 0;) {
    depth[node] = depth[parent[node]] + 1;
    if (node < n) ++ofLength[static_cast<size_t>(std::min(depth[node], longest))];
  }
  // Leaves that were cut off at `longest` overfill the code space: a shorter code is made longer for two.
  uint32_t filled = 0;
  for (int l = 1; l <= longest; ++l) filled += ofLength[static_cast<size_t>(l)] << (longest - l);
  for (; filled > 1u << longest; --filled) {
    auto l = static_cast<size_t>(longest) - 1;
    while (ofLength[l] == 0) --l;
    --ofLength[l];
    ofLength[l + 1] += 2;
    --ofLength.back();
  }
  std::vector<uint8_t> lengths(counts.size());
  auto symbol = symbols.begin();
  for (auto l = static_cast<size_t>(longest); l > 0; --l)
    for (uint32_t i = 0; i < ofLength[l]; ++i) lengths[symbol++->second] = static_cast<uint8_t>(l);
  return lengths;
}

// The canonical code of these lengths, most significant bit first in the stream [RFC 1951, 3.2.2].
std::vector<Code> canonicalCodes(std::span<const uint8_t> lengths) {
  std::array<uint32_t, 17> next{};
  for (const uint8_t length : lengths)
    if (length > 0) ++next[length + 1u];
  for (size_t l = 1; l < next.size(); ++l) next[l] = (next[l] + next[l - 1]) << 1;
  std::vector<Code> codes(lengths.size());
  for (size_t s = 0; s < lengths.size(); ++s) {
    const int length = lengths[s];
    if (length == 0) continue;
    const uint32_t value = next[static_cast<size_t>(length)]++;
    for (int bit = 0; bit < length; ++bit) codes[s].bits |= (value >> bit & 1) << (length - 1 - bit);
    codes[s].length = length;
  }
  return codes;
}

// Code lengths as they are written: repeats are counted [RFC 1951, 3.2.7].
struct LengthItem {
  uint8_t symbol; // 0..15 a length, 16 the last 3..6 times more, 17 and 18 zeros
  Code extra;
};
std::vector<LengthItem> lengthItems(std::span<const uint8_t> lengths) {
  std::vector<LengthItem> items;
  for (size_t i = 0; i < lengths.size();) {
    const uint8_t length = lengths[i];
    size_t same = 1;
    while (i + same < lengths.size() && lengths[i + same] == length) ++same;
    i += same;
    if (length > 0) items.push_back({length, {}}), --same;
    const auto most = length > 0 ? size_t{6} : size_t{138};
    while (same >= 3) {
      const size_t some = std::min(same, most);
      if (length > 0)
        items.push_back({16, {some - 3, 2}});
      else if (some < 11)
        items.push_back({17, {some - 3, 3}});
      else
        items.push_back({18, {some - 11, 7}});
      same -= some;
    }
    for (; same > 0; --same) items.push_back({length, {}});
  }
  return items;
}

void writeCodes(std::span<const uint8_t> lengths, BitWriter& out) {
  constexpr std::array<size_t, 19> kOrder = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                             11, 4,  12, 3, 13, 2, 14, 1, 15};
  const std::vector<LengthItem> items = lengthItems(lengths);
  std::array<uint32_t, kOrder.size()> counts{};
  for (const LengthItem& item : items) ++counts[item.symbol];
  const std::vector<uint8_t> itemLengths = codeLengths(counts, 7);
  const std::vector<Code> itemCodes = canonicalCodes(itemLengths);
  size_t stated = kOrder.size();
  while (itemLengths[kOrder[stated - 1]] == 0) --stated;
  out.put({lengths.size() - 1 - 257, 5}); // all but one are of literals and runs
  out.put({0, 5});                        // and one of distances
  out.put({stated - 4, 4});
  for (size_t i = 0; i < stated; ++i) out.put({itemLengths[kOrder[i]], 3});
  for (const LengthItem& item : items) {
    out.put(itemCodes[item.symbol] + item.extra);
  }
}

void writeBlock(std::span<const Token> tokens, bool isLast, BitWriter& out) {
  std::array<std::array<uint32_t, kTokens>, 2> halves{}; // two, so that counting does not wait for itself
  size_t at = 0;
  for (; at + 1 < tokens.size(); at += 2) ++halves[0][tokens[at]], ++halves[1][tokens[at + 1]];
  if (at < tokens.size()) ++halves[0][tokens[at]];
  std::array<uint32_t, kSymbols> counts{};
  for (size_t t = 0; t < kLiterals; ++t) counts[t] = halves[0][t] + halves[1][t];
  for (size_t length = kShortestRun; length <= kLongestRun; ++length)
    counts[symbolOfRun(length).symbol] += halves[0][kLiterals + length] + halves[1][kLiterals + length];
  counts[kEndOfBlock] = 1;
  if (tokens.empty()) counts[0] = 1; // for codeLengths

  std::vector<uint8_t> lengths = codeLengths(counts, 15);
  while (lengths.back() == 0) lengths.pop_back();
  const std::vector<Code> codes = canonicalCodes(lengths);
  lengths.push_back(1); // of the distance 1, the only one, whose code is the bit 0

  std::array<Code, kTokens> tokenCodes;
  std::copy_n(codes.begin(), kLiterals, tokenCodes.begin());
  for (size_t length = kShortestRun; length <= kLongestRun; ++length) {
    const auto [symbol, extra] = symbolOfRun(length);
    if (symbol >= codes.size()) continue;
    tokenCodes[kLiterals + length] = codes[symbol] + extra + Code{0, 1};
  }
  out.put({isLast, 1});
  out.put({2, 2}); // dynamic Huffman codes
  writeCodes(lengths, out);
  for (at = 0; at + 1 < tokens.size(); at += 2) out.put(tokenCodes[tokens[at]] + tokenCodes[tokens[at + 1]]);
  if (at < tokens.size()) out.put(tokenCodes[tokens[at]]);
  out.put(codes[kEndOfBlock]);
}

// [RFC 1950, 8.2] The sums over 4096 bytes at a time fit 32 bits, and are taken in lanes.
uint32_t adler32(std::span<const std::byte> bytes) {
  constexpr uint32_t kBase = 65521, kPart = 4096, kRow = 64;
  uint64_t a = 1, b = 0;
  while (!bytes.empty()) {
    const auto part = bytes.first(std::min<size_t>(kPart, bytes.size()));
    bytes = bytes.subspan(part.size());
    // b grows by each byte as often as there are bytes from it on: by those of its row, and by whole rows.
    uint32_t sum = 0, rows = 0, within = 0;
    size_t i = 0;
    for (; i + kRow <= part.size(); i += kRow) {
      rows += sum;
      for (uint32_t k = 0; k < kRow; ++k) {
        const auto byte = std::to_integer<uint16_t>(part[i + k]);
        sum += byte;
        within += static_cast<uint16_t>(byte * (kRow - k)); // at most 255 * 64
      }
    }
    b += i * a + uint64_t{kRow} * rows + within;
    a += sum;
    for (; i < part.size(); ++i) {
      a += std::to_integer<uint64_t>(part[i]);
      b += a;
    }
    a %= kBase, b %= kBase;
  }
  return static_cast<uint32_t>(b << 16 | a);
}

} // namespace

std::string zlibStream(std::span<const std::byte> bytes) {
  std::string stream("\x78\x01", 2);     // deflate, a window of 32 KiB, the fastest level [RFC 1950, 2.2]
  BitWriter out(2 * kBlockBytes + 1024); // no code of a byte is longer than 15 bits
  std::vector<Token> tokens;
  for (size_t begin = 0; begin == 0 || begin < bytes.size(); begin += kBlockBytes) {
    const size_t end = std::min(begin + kBlockBytes, bytes.size());
    writeBlock(tokenize(bytes.data(), begin, end, tokens), end == bytes.size(), out);
    out.moveTo(stream, end == bytes.size());
  }
  const uint32_t check = adler32(bytes);
  for (const int shift : {24, 16, 8, 0}) stream += static_cast<char>(check >> shift);
  return stream;
}

} // namespace surflect
