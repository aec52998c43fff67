#include "srf/image/foreign/foreign.h"

#include "srf/image/image.h"
#include "surfel/base/text.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string_view>

namespace surflect::image {

namespace {

// Limits of memory relative to the file's size. Photographs are never packed denser; a mask of one colour may
// be, and is granted the memory of a large one.
constexpr int64_t densest = 1 << 12;       // bytes of floats per byte of file
constexpr int64_t alwaysGranted = 1 << 29; // bytes, however small the file

// Index of the alpha channel, or -1. The library's GIF reader counts from one.
int alphaOf(const OIIO::ImageSpec& spec) {
  return spec.alpha_channel < spec.nchannels ? spec.alpha_channel : spec.channelindex("A");
}

// Channels to read: colour first, alpha last, 1 to 4 in all.
std::vector<int> wantedChannels(const OIIO::ImageSpec& spec) {
  const int alpha = alphaOf(spec);
  const int colors = spec.nchannels - (alpha >= 0 ? 1 : 0) >= 3 ? 3 : 1;
  std::vector<int> channels;
  for (int c = 0; c < spec.nchannels && static_cast<int>(channels.size()) < colors; ++c)
    if (c != alpha) channels.push_back(c);
  if (alpha >= 0) channels.push_back(alpha);
  return channels;
}

// Memory that a file of this size may use.
int64_t grantedBytes(int64_t fileBytes) { return std::max(alwaysGranted, densest * fileBytes); }

// Opens only the reader that the extension names. Otherwise others would be tried in turn, and some trust
// sizes in foreign data. Readers that check an upper limit are given ours.
std::unique_ptr<OIIO::ImageInput> opened(const char* path, int64_t granted) {
  // Ask for straight alpha; otherwise OpenImageIO premultiplies in encoded space.
  OIIO::ImageSpec wish;
  wish.attribute("oiio:UnassociatedAlpha", 1);
  // Ask for linear values of camera raw that are in one scale for all photographs: white balance and white
  // level of the camera, not of each picture. Sensor pixels stay where they are.
  wish.attribute("raw:ColorSpace", "sRGB-linear");
  wish.attribute("raw:use_camera_wb", 0);
  wish.attribute("raw:use_auto_wb", 0);
  wish.attribute("raw:auto_bright", 0);
  wish.attribute("raw:adjust_maximum_thr", 0.f);
  wish.attribute("raw:user_flip", 0);
  static std::mutex limiting; // guards settings of the whole process
  const std::lock_guard lock(limiting);
  OIIO::attribute("try_all_readers", 0);
  OIIO::attribute("limits:imagesize_MB", static_cast<int>(std::min<int64_t>(granted >> 20, 1 << 15)));
  return OIIO::ImageInput::open(path, &wish);
}

// Colour model that is not RGB or gray, which OpenImageIO would convert by rules of thumb or pass on; empty:
// RGB or gray.
std::string foreignColors(const OIIO::ImageSpec& spec) {
  // [TIFF 6.0] white is zero, black is zero, RGB, palette, YCbCr
  constexpr std::array known{0, 1, 2, 3, 6};
  const int tiff = spec.get_int_attribute("tiff:PhotometricInterpretation", 2);
  const std::string name(
      spec.get_string_attribute("tiff:ColorSpace", spec.get_string_attribute("jpeg:ColorSpace")));
  if (std::ranges::find(known, tiff) == known.end())
    return name.empty() ? "photometric interpretation " + std::to_string(tiff) : name;
  return name == "CMYK" || name == "YCCK" ? name : "";
}

std::string profileIn(const OIIO::ImageSpec& spec) {
  const OIIO::ParamValue* profile = spec.find_attribute("ICCProfile");
  if (!profile) return "";
  return {static_cast<const char*>(profile->data()), static_cast<size_t>(profile->datasize())};
}

// Returns whether a complaint of the JPEG library, which has gone on decoding, leaves all pixels intact:
// phones write odd numbers into headers of scans, and cameras a few bytes between the last pixel and the end
// marker.
bool isHarmless(std::string_view complaint) {
  constexpr unsigned kFewBytes = 64;
  if (complaint.find("Invalid SOS parameters") != complaint.npos) return true;
  unsigned bytes = 0, marker = 0;
  const size_t at = complaint.find("Corrupt JPEG data: ");
  return at != complaint.npos &&
         std::sscanf(complaint.data() + at, "Corrupt JPEG data: %u extraneous bytes before marker %x", &bytes,
                     &marker) == 2 &&
         marker == 0xd9 && bytes <= kFewBytes;
}

// Ignores EXIF orientation, because lens and poses refer to sensor pixels.
bool read(const char* path, ForeignExtent extent, ForeignPicture& picture, std::string& problem) {
  const auto fileBytes = static_cast<int64_t>(std::filesystem::file_size(path));
  const auto input = opened(path, grantedBytes(fileBytes));
  if (!input) {
    problem = OIIO::geterror();
    return false;
  }
  const OIIO::ImageSpec& spec = input->spec();
  // The library allocates 256 rows, however few there are, so the width alone has a limit too.
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1 ||
      std::max(spec.width, spec.height) > kMostSide || int64_t{spec.width} * spec.height > kMostPixels) {
    problem = "found " + sizeText(spec.width, spec.height) +
              ", expected a flat picture of at most 2^28 pixels, 65536 each way";
    return false;
  }
  if (const std::string colors = foreignColors(spec); !colors.empty()) {
    problem = "found colours of " + colors + ", expected RGB or gray; convert the picture";
    return false;
  }
  const std::vector<int> channels = wantedChannels(spec);
  picture.image.width = spec.width;
  picture.image.height = spec.height;
  picture.image.channels = static_cast<int>(channels.size());
  picture.bits = spec.format.is_floating_point() ? 0 : static_cast<int>(8 * spec.format.size());
  picture.orientation = spec.get_int_attribute("Orientation", 1);
  picture.alphaPremultiplied = spec.get_int_attribute("oiio:UnassociatedAlpha") == 0;
  picture.iccProfile = profileIn(spec);
  picture.targaAlphaType = spec.get_int_attribute("targa:alpha_type");
  if (extent == ForeignExtent::header) return true;

  const int64_t claimed = int64_t{spec.width} * spec.height * spec.nchannels * int64_t{sizeof(float)};
  if (claimed > grantedBytes(fileBytes)) {
    problem = "found " + std::to_string(fileBytes) + " bytes, expected at least " +
              std::to_string(claimed / densest) + " for so many pixels";
    return false;
  }
  const size_t pixels = static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height);
  const size_t stride = static_cast<size_t>(spec.nchannels);
  std::vector<float> all(pixels * stride);
  // Libraries fill up damaged pictures: what they complain of counts, not only whether they give up.
  const bool isRead = input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, all.data());
  if (const bool complains = input->has_error(); !isRead || complains) {
    problem = input->geterror();
    if (problem.empty()) problem = "the file ends before its picture";
    if (!isRead || !isHarmless(problem)) return false;
    problem.clear();
  }
  picture.image.values.resize(pixels * channels.size());
  for (size_t i = 0; i < pixels; ++i)
    for (size_t c = 0; c < channels.size(); ++c)
      picture.image.values[i * channels.size() + c] = all[i * stride + static_cast<size_t>(channels[c])];
  return true;
}

} // namespace

extern "C" bool surflectReadForeign(const char* path, ForeignExtent extent, ForeignPicture& picture,
                                    std::string& problem) {
  bool done = false;
  try {
    done = read(path, extent, picture, problem);
  } catch (const std::exception& e) {
    problem = e.what();
  }
  std::replace(problem.begin(), problem.end(), '\n', ' ');
  return done;
}

} // namespace surflect::image
