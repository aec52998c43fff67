#include "tests/support/color_files.h"

#include <lcms2.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace surflect {

namespace {

std::string bigEndianBytes(uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

// Closes the profile.
std::string saved(cmsHPROFILE profile) {
  cmsMLU* name = cmsMLUalloc(nullptr, 1);
  cmsMLUsetASCII(name, "en", "US", "made by a test");
  cmsWriteTag(profile, cmsSigProfileDescriptionTag, name);
  cmsMLUfree(name);
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsCloseProfile(profile);
  return bytes;
}

} // namespace

std::string profileBytes(const image::Primaries& primaries, ProfileCurve kind) {
  const auto at = [](const image::Chromaticity& c) { return cmsCIExyY{c.x, c.y, 1}; };
  const cmsCIExyY white = at(primaries.white);
  const cmsCIExyYTRIPLE points{at(primaries.red), at(primaries.green), at(primaries.blue)};
  const std::array<double, 5> srgb{2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045}; // [IEC 61966-2-1]
  cmsToneCurve* const curve = kind == ProfileCurve::srgb
                                  ? cmsBuildParametricToneCurve(nullptr, 4, srgb.data())
                                  : cmsBuildGamma(nullptr, 1);
  const std::array<cmsToneCurve*, 3> curves{curve, curve, curve};
  const std::string bytes = saved(cmsCreateRGBProfile(&white, &points, curves.data()));
  cmsFreeToneCurve(curve);
  return bytes;
}

std::string grayProfileBytes(double gamma) {
  cmsToneCurve* const curve = cmsBuildGamma(nullptr, gamma);
  const std::string bytes = saved(cmsCreateGrayProfile(cmsD50_xyY(), curve));
  cmsFreeToneCurve(curve);
  return bytes;
}

std::string tableProfileBytes() {
  const cmsHPROFILE profile = cmsCreateProfilePlaceholder(nullptr);
  cmsSetProfileVersion(profile, 4.3);
  cmsSetDeviceClass(profile, cmsSigInputClass);
  cmsSetColorSpace(profile, cmsSigRgbData);
  cmsSetPCS(profile, cmsSigLabData);
  cmsWriteTag(profile, cmsSigMediaWhitePointTag, cmsD50_XYZ());
  cmsPipeline* const pipeline = cmsPipelineAlloc(nullptr, 3, 3);
  cmsStage* const table = cmsStageAllocCLut16bit(nullptr, 33, 3, 3, nullptr);
  const auto sample = [](const cmsUInt16Number in[], cmsUInt16Number out[], void*) {
    constexpr cmsUInt16Number kNoColor = 0x8080; // a* = b* = 0
    out[0] = std::min({in[0], in[1], in[2]});
    out[1] = out[2] = kNoColor;
    return TRUE;
  };
  cmsStageSampleCLut16bit(table, sample, nullptr, 0);
  cmsPipelineInsertStage(pipeline, cmsAT_BEGIN, table);
  for (const cmsStageLoc end : {cmsAT_BEGIN, cmsAT_END}) // which the tag must have; the identity
    cmsPipelineInsertStage(pipeline, end, cmsStageAllocToneCurves(nullptr, 3, nullptr));
  cmsWriteTag(profile, cmsSigAToB0Tag, pipeline);
  cmsPipelineFree(pipeline);
  return saved(profile);
}

std::string withChunk(std::string png, const std::string& name, const std::string& content) {
  constexpr size_t kHeaderEnds = 33;
  const std::string counted = name + content;
  const auto sum =
      ::crc32(0, reinterpret_cast<const Bytef*>(counted.data()), static_cast<uInt>(counted.size()));
  return png.insert(kHeaderEnds, bigEndianBytes(static_cast<uint32_t>(content.size())) + counted +
                                     bigEndianBytes(static_cast<uint32_t>(sum)));
}

std::string gamaContent(double gamma) {
  return bigEndianBytes(static_cast<uint32_t>(std::lround(1e5 * gamma)));
}

std::string chrmContent(const image::Primaries& primaries) {
  std::string content;
  for (const image::Chromaticity& c : {primaries.white, primaries.red, primaries.green, primaries.blue})
    content += gamaContent(c.x) + gamaContent(c.y);
  return content;
}

std::string iccpContent(const std::string& profile) {
  std::string packed(::compressBound(static_cast<uLong>(profile.size())), '\0');
  uLongf size = static_cast<uLongf>(packed.size());
  ::compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(profile.data()),
             static_cast<uLong>(profile.size()));
  return std::string("name\0\0", 6) + packed.substr(0, size);
}

} // namespace surflect
