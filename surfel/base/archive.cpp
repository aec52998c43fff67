#include "surfel/base/archive.h"

#include "surfel/base/file.h"

#include <cstring>

namespace surflect {

void Archive::magic(std::string_view text) {
  std::string found(text);
  raw("magic", std::as_writable_bytes(std::span(found)));
  if (found != text) throw Error::mismatch('"' + std::string(text) + '"', "other bytes").at("magic");
}

uint64_t Archive::hash() const {
  return contentHash(isReading_ ? content_.first(content_.size() - rest_.size()) : std::span(written_));
}

void Archive::checksum(std::string_view name, uint64_t hash) {
  uint64_t stored = hash;
  raw(name, std::as_writable_bytes(std::span(&stored, 1)));
  if (stored != hash) throw Error::mismatch(hex(stored), hex(hash)).at(name);
}

void Archive::end() const {
  if (left() > 0) throw Error::mismatch("the end", std::to_string(left()) + " more bytes").at("end");
}

void Archive::raw(std::string_view name, std::span<std::byte> field) {
  if (!isReading_) {
    written_.insert(written_.end(), field.begin(), field.end());
    return;
  }
  requireLeft(name, field.size(), 1);
  if (!field.empty()) std::memcpy(field.data(), rest_.data(), field.size());
  rest_ = rest_.subspan(field.size());
}

void Archive::requireLeft(std::string_view name, size_t count, size_t elementBytes) const {
  if (count > left() / elementBytes)
    throw Error::mismatch(std::to_string(count) + " times " + std::to_string(elementBytes) + " bytes",
                          std::to_string(left()) + " bytes")
        .at(name);
}

} // namespace surflect
