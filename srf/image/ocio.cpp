#include "srf/image/ocio.h"

#include "srf/image/foreign/foreign.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <vector>

namespace surflect::image {

namespace {

void requireName(const char* field, const std::string& name, const std::vector<std::string>& known,
                 const std::string& of) {
  if (std::ranges::find(known, name) != known.end()) return;
  std::string list;
  for (const std::string& each : known) list += (list.empty() ? "" : ", ") + each;
  throw Error::mismatch("one of " + of + ": " + list +
                            didYouMean(name, std::vector<std::string_view>(known.begin(), known.end())),
                        '"' + name + '"')
      .at(field);
}

} // namespace

OcioView::OcioView(const std::string& display, const std::string& view) {
  const char* const file = std::getenv("OCIO");
  if (!file || !*file)
    throw Error(
        "\"ocio\" needs a configuration of OpenColorIO, which the environment variable OCIO names; it "
        "is not set")
        .at("tone");
  static auto* const open = reinterpret_cast<OpenForeignView*>(foreignDoor(openForeignViewSymbol));
  ForeignView opened{
      .display = display, .view = view, .displays = {}, .views = {}, .source = {}, .processor = {}};
  std::string problem;
  if (!open(opened, problem))
    throw Error("$OCIO, " + std::string(file) + ", cannot be used (" + problem + ")").at("tone");
  requireName("ocio_display", opened.display, opened.displays, "the displays of $OCIO");
  requireName("ocio_view", opened.view, opened.views, "the views of " + opened.display);
  opened_ = std::make_shared<const ForeignView>(std::move(opened));
}

const std::string& OcioView::display() const { return opened_->display; }
const std::string& OcioView::view() const { return opened_->view; }

void OcioView::apply(std::span<float> rgb) const {
  opened_->apply(opened_->processor.get(), rgb.data(), rgb.size() / 3);
}

uint64_t OcioView::hash() const {
  constexpr int kSide = 9;
  std::vector<float> lattice; // each channel 2^-8 to 2^8
  for (int i = 0; i < kSide * kSide * kSide; ++i)
    for (const int step : {i % kSide, i / kSide % kSide, i / (kSide * kSide)})
      lattice.push_back(std::exp2(static_cast<float>(2 * step - 8)));
  apply(lattice);
  return contentHash(std::as_bytes(std::span(lattice)));
}

} // namespace surflect::image
