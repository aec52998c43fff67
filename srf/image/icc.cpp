// [ICC.1:2010] Image technology colour management; 7.2 the header, 8.3 contents of input and display
// profiles.
#include "srf/image/icc.h"

#include "srf/image/color.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <lcms2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

namespace surflect::image {

namespace {

constexpr size_t kLargestProfile = size_t{1} << 26;
constexpr size_t kSteps = 16 * 255; // multiple of 255, so that 8-bit codes lie on table steps

using Light = std::array<float, 3>; // linear RGB, or a pixel's stored values

struct CloseProfile {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
using Profile = std::unique_ptr<void, CloseProfile>;

// Keeps the first error of one thread's work; Little CMS alone would neither print nor keep it.
void keepFirst(cmsContext context, cmsUInt32Number, const char* text) {
  auto& problem = *static_cast<std::string*>(cmsGetContextUserData(context));
  if (problem.empty()) problem = text;
}

std::string nameOf(cmsHPROFILE profile) {
  std::array<char, 64> text{};
  cmsGetProfileInfoASCII(profile, cmsInfoDescription, "en", "US", text.data(), text.size());
  text.back() = '\0';
  std::string name = text.data();
  std::erase_if(name, [](char c) { return c < ' ' || c > '~'; });
  return name.empty() ? "without a name" : name;
}

// Size field of the header, big-endian.  [ICC.1:2010, 7.2.2]
size_t claimedSize(std::string_view bytes) { return bigEndian(bytes, 0, std::min<size_t>(4, bytes.size())); }

// Signature as four letters: "RGB ", "CMYK".
std::string signatureText(uint32_t signature) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(signature >> shift & 0xff);
  while (text.ends_with(' ')) text.pop_back();
  return "'" + text + "'";
}

Profile linearRec709(cmsContext context) {
  const auto at = [](const Chromaticity& c) { return cmsCIExyY{c.x, c.y, 1}; };
  const cmsCIExyY white = at(kRec709.white);
  const cmsCIExyYTRIPLE primaries{at(kRec709.red), at(kRec709.green), at(kRec709.blue)};
  cmsToneCurve* const line = cmsBuildGamma(context, 1);
  const std::array<cmsToneCurve*, 3> curves{line, line, line};
  Profile profile(cmsCreateRGBProfileTHR(context, &white, &primaries, curves.data()));
  cmsFreeToneCurve(line);
  return profile;
}

} // namespace

struct IccTransform::Transform {
  std::string problem; // declared before the context, which writes it
  cmsContext context = cmsCreateContext(nullptr, &problem);
  cmsHTRANSFORM transform = nullptr;
  // A profile of three curves and a matrix is a sum over channels, for which tables are much faster. Built by
  // the first conversion, because a profile is often opened for a picture's header alone. Empty for other
  // profiles.
  mutable std::once_flag tabulating;
  mutable std::array<std::vector<Light>, 3> tables;

  Transform() = default;
  Transform(const Transform&) = delete;
  Transform& operator=(const Transform&) = delete;
  ~Transform() {
    if (transform) cmsDeleteTransform(transform);
    if (context) cmsDeleteContext(context);
  }
};

namespace {

// Contribution of one channel at each step of its value.
std::array<std::vector<Light>, 3> tabulated(cmsHTRANSFORM transform) {
  std::array<std::vector<Light>, 3> tables;
  Light black{};
  const Light zero{};
  cmsDoTransform(transform, zero.data(), black.data(), 1);
  for (size_t c = 0; c < 3; ++c) {
    std::vector<Light> stored(kSteps + 1);
    for (size_t i = 0; i <= kSteps; ++i) stored[i][c] = static_cast<float>(i) / kSteps;
    tables[c].resize(kSteps + 1);
    cmsDoTransform(transform, stored.data(), tables[c].data(), kSteps + 1);
    if (c == 0) continue;
    for (Light& light : tables[c])
      for (size_t k = 0; k < 3; ++k) light[k] -= black[k];
  }
  return tables;
}

bool isUnit(float value) { return value >= 0 && value <= 1; }

// Converts stored values in 0..1.
Light sumOf(const std::array<std::vector<Light>, 3>& tables, const float* stored) {
  Light sum{};
  for (size_t c = 0; c < 3; ++c) {
    const float place = stored[c] * kSteps;
    const size_t low = std::min(static_cast<size_t>(place), kSteps - 1);
    const float share = place - static_cast<float>(low);
    for (size_t k = 0; k < 3; ++k) sum[k] += (1 - share) * tables[c][low][k] + share * tables[c][low + 1][k];
  }
  return sum;
}

// Returns whether the sum over channels agrees with the profile over its whole cube.
bool addsUp(cmsHTRANSFORM transform, const std::array<std::vector<Light>, 3>& tables) {
  constexpr int kSide = 7;
  constexpr float kTolerance = 2e-5f;
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    const auto at = [](int place) { return (static_cast<float>(place % kSide) + 0.3f) / kSide; };
    const Light stored{at(i), at(i / kSide), at(i / kSide / kSide)}, sum = sumOf(tables, stored.data());
    Light light{};
    cmsDoTransform(transform, stored.data(), light.data(), 1);
    for (size_t k = 0; k < 3; ++k)
      if (!(std::abs(light[k] - sum[k]) <= kTolerance)) return false;
  }
  return true;
}

} // namespace

IccTransform::IccTransform(std::string_view bytes, int channels) : channels_(channels) {
  auto made = std::make_shared<Transform>();
  if (!made->context) throw Error("out of memory");
  cmsSetLogErrorHandlerTHR(made->context, keepFirst);
  const auto damaged = [&] {
    return Error("cannot be read (" + (made->problem.empty() ? "not an ICC profile" : made->problem) + ")");
  };
  if (bytes.size() > kLargestProfile)
    throw Error::mismatch("at most 2^26 bytes", std::to_string(bytes.size()));
  if (const size_t claimed = claimedSize(bytes); claimed > bytes.size()) // not checked by Little CMS
    throw Error::mismatch("the " + std::to_string(claimed) + " bytes that its header says",
                          std::to_string(bytes.size()));
  const Profile profile(
      cmsOpenProfileFromMemTHR(made->context, bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
  if (!profile) throw damaged();
  name_ = nameOf(profile.get());
  const cmsColorSpaceSignature wanted = channels == 3 ? cmsSigRgbData : cmsSigGrayData;
  if (const cmsColorSpaceSignature space = cmsGetColorSpace(profile.get()); space != wanted)
    throw Error::mismatch("one of colour space " + signatureText(wanted) + ", as the picture is",
                          signatureText(space) + " of '" + name_ + "'");
  const cmsProfileClassSignature kind = cmsGetDeviceClass(profile.get());
  if (kind != cmsSigInputClass && kind != cmsSigDisplayClass && kind != cmsSigOutputClass &&
      kind != cmsSigColorSpaceClass)
    throw Error::mismatch("a profile of a device or colour space", "class " + signatureText(kind));
  const Profile target = linearRec709(made->context);
  if (!target) throw damaged();
  made->transform = cmsCreateTransformTHR(
      made->context, profile.get(), channels == 3 ? TYPE_RGB_FLT : TYPE_GRAY_FLT, target.get(), TYPE_RGB_FLT,
      INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE | cmsFLAGS_NOOPTIMIZE);
  if (!made->transform) throw damaged();
  transform_ = std::move(made);
}

void IccTransform::toRec709(const float* stored, float* rgb, size_t pixels) const {
  const auto& tables = transform_->tables;
  if (channels_ == 3)
    std::call_once(transform_->tabulating, [&] {
      auto made = tabulated(transform_->transform);
      if (addsUp(transform_->transform, made)) transform_->tables = std::move(made);
    });
  if (!tables[0].empty()) {
    for (size_t i = 0; i < pixels; ++i, stored += 3, rgb += 3) {
      if (isUnit(stored[0]) && isUnit(stored[1]) && isUnit(stored[2]))
        std::ranges::copy(sumOf(tables, stored), rgb);
      else
        cmsDoTransform(transform_->transform, stored, rgb, 1);
    }
    return;
  }
  constexpr size_t kMost = size_t{1} << 20; // pixels per call, which counts in 32 bits
  for (size_t done = 0; done < pixels; done += kMost)
    cmsDoTransform(transform_->transform, stored + done * static_cast<size_t>(channels_), rgb + 3 * done,
                   static_cast<cmsUInt32Number>(std::min(kMost, pixels - done)));
}

} // namespace surflect::image
