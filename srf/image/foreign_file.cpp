#include "srf/image/foreign_file.h"

#include "srf/image/bmp_header.h"
#include "srf/image/foreign_color.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

namespace surflect::image {

namespace {

// Returns whether a fourth byte is alpha. If the header does not declare it, or it is 0 everywhere, it is
// alpha only if it varies: programs write alpha without declaring it, but cameras and screen captures leave
// the byte undefined.
bool isAlpha(const Image& image, bool declared) {
  const float first = image.values[3];
  bool varies = false;
  for (size_t i = 3; i < image.values.size() && !varies; i += 4) varies = image.values[i] != first;
  return varies || (declared && first > 0);
}

Image withoutAlpha(const Image& image) {
  Image opaque(image.width, image.height, 3);
  for (size_t i = 0; i < opaque.values.size(); ++i) opaque.values[i] = image.values[i / 3 * 4 + i % 3];
  return opaque;
}

// Drops the fourth channel unless it is alpha; does nothing if only the header was read.
void keepOnlyAlpha(Image& image, bool declared) {
  if (image.channels == 4 && !image.values.empty() && !isAlpha(image, declared)) image = withoutAlpha(image);
}

// [Truevision TGA 2.0, field 24] attribute types: 0 no alpha, 1 and 2 undefined, 3 straight, 4 premultiplied.
// Without an extension area the header's alpha bits declare alpha, which OpenImageIO then calls straight.
void settleTargaAlpha(Picture& picture, int type, bool calledStraight) {
  constexpr int kIgnored = 1, kRetained = 2, kPremultiplied = 4;
  picture.alphaPremultiplied = type == kPremultiplied;
  if (picture.image.channels == 4 && (type == kIgnored || type == kRetained)) {
    if (picture.image.values.empty())
      picture.image.channels = 3;
    else
      picture.image = withoutAlpha(picture.image);
  }
  keepOnlyAlpha(picture.image, calledStraight || type == kPremultiplied);
}

} // namespace

Picture completed(ForeignPicture read, const std::filesystem::path& path, std::string_view extension) {
  constexpr size_t kExifEnds = size_t{1} << 18; // EXIF's segment is an early one, of at most 2^16 bytes
  Picture picture{std::move(read.image), read.bits, read.alphaPremultiplied, {}, read.orientation};
  const int channels = picture.image.channels >= 3 ? 3 : 1;
  const bool isJpeg = extension == ".jpg" || extension == ".jpeg" || extension == ".jpe";
  if (!read.iccProfile.empty())
    picture.color =
        profileStatement(isJpeg ? "JPEG ICC profile" : "TIFF ICC profile", read.iccProfile, channels);
  else if (isJpeg)
    picture.color = exifColorStatement(readFileStart(path, kExifEnds));
  if (extension == ".webp") {
    const std::string file = readFile(path);
    if (const auto profile = webpProfile(file); !profile.empty())
      picture.color = profileStatement("WebP ICC profile", profile, channels);
  }
  if (extension == ".tga") settleTargaAlpha(picture, read.targaAlphaType, !read.alphaPremultiplied);
  if (extension == ".bmp") try {
      const BmpHeader header = bmpHeader(readFile(path));
      picture.color = header.color;
      picture.alphaPremultiplied = false;
      keepOnlyAlpha(picture.image, header.declaresAlpha);
    } catch (Error& e) {
      throw std::move(e).in(path);
    }
  return picture;
}

} // namespace surflect::image
