#include "srf/image/image_file.h"

#include "srf/image/exr.h"
#include "srf/image/foreign/foreign.h"
#include "srf/image/foreign_file.h"
#include "srf/image/png.h"
#include "srf/image/radiance.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <dlfcn.h>
#include <set>
#include <string>
#include <unistd.h>

namespace surflect::image {

namespace {

std::string lowerExtension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

} // namespace

// Loads the module from lib/ beside the program's bin/, else from the build folder, else from where it is
// installed.
void* foreignDoor(const char* symbol) {
  constexpr const char* module = "libsurflect_foreign.so";
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  const std::array places{program.parent_path().parent_path() / "lib" / module,
                          std::filesystem::path(SURFLECT_BUILT_MODULES) / module,
                          std::filesystem::path(SURFLECT_INSTALLED_MODULES) / module};
  for (const auto& place : places) {
    if (!std::filesystem::exists(place, ignored)) continue;
    // Never unloaded: its libraries are many, and not all of them survive unloading.
    void* library = ::dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* door = library ? ::dlsym(library, symbol) : nullptr;
    if (!door) throw Error(std::string("cannot load (") + ::dlerror() + ")").in(place);
    return door;
  }
  throw Error(
      "is missing: it reads all pictures but .exr, .png and .hdr, and OpenColorIO; rebuild, or convert "
      "to .exr or .png")
      .in(places[0]);
}

namespace {

// Formats of photographs whose readers have been tested with damaged files (tests/fuzz). Other readers of
// OpenImageIO trust sizes in damaged headers, or search them without end.
constexpr std::array<std::string_view, 11> foreignExtensions = {
    ".jpg", ".jpeg", ".jpe", ".tif", ".tiff", ".bmp", ".tga", ".ppm", ".pgm", ".pnm", ".webp"};
// Camera raw, which LibRaw reads. Not tested with damaged files.
constexpr std::array<std::string_view, 11> rawExtensions = {".3fr", ".arw", ".cr2", ".cr3", ".dng", ".nef",
                                                            ".orf", ".pef", ".raf", ".rw2", ".srw"};

// Throws Error for pictures that are cut off or have holes, which decoders fill up.
void requireWhole(const std::filesystem::path& path, std::string_view extension) {
  std::string damage;
  if (extension == ".jpg" || extension == ".jpeg" || extension == ".jpe") damage = jpegDamage(readFile(path));
  if (extension == ".webp") damage = webpDamage(readFile(path));
  if (!damage.empty()) throw Error("cannot read (" + damage + ")").in(path);
}

Picture readForeignPicture(const std::filesystem::path& path, ForeignExtent extent) {
  if (!isPictureName(path))
    throw Error::mismatch(
        "a picture of type .exr, .png, .jpg, .tif, .hdr, .bmp, .tga, .ppm, .webp or camera raw",
        "'" + path.extension().string() + "'")
        .in(path);
  ::close(openForReading(path)); // throws with the reason
  static auto* const readForeign = reinterpret_cast<ReadForeign*>(foreignDoor(readForeignSymbol));
  ForeignPicture picture;
  std::string problem;
  if (!readForeign(path.c_str(), extent, picture, problem))
    throw Error("cannot read (" + problem + ")").in(path);
  if (extent == ForeignExtent::pixels) requireWhole(path, lowerExtension(path));
  return completed(std::move(picture), path, lowerExtension(path));
}

Picture readExrPicture(const std::filesystem::path& path) {
  const ExrFile file(path);
  ChannelSet channels = colorChannels(file, "");
  if (const auto alpha = alphaChannel(file, "")) channels.push_back(*alpha);
  return {file.read(channels), 0, true, file.colorStatement()};
}

Picture readRadiancePicture(const std::filesystem::path& path) {
  RadiancePicture picture = readRadiance(path);
  return {std::move(picture.image), 0, false, std::move(picture.header.color)};
}

RadianceHeader readRadianceHeader(const std::filesystem::path& path) try {
  constexpr size_t kMostBytes = size_t{1} << 16;
  return radianceHeader(readFileStart(path, kMostBytes));
} catch (Error& e) {
  throw std::move(e).in(path);
}

} // namespace

PictureFormat formatOf(const std::filesystem::path& path) {
  const std::string extension = lowerExtension(path);
  if (extension == ".exr") return PictureFormat::exr;
  if (extension == ".hdr" || extension == ".rgbe") return PictureFormat::radiance;
  return extension == ".png" ? PictureFormat::png : PictureFormat::foreign;
}

bool isPictureName(const std::filesystem::path& path) {
  return formatOf(path) != PictureFormat::foreign ||
         std::ranges::find(foreignExtensions, lowerExtension(path)) != foreignExtensions.end() ||
         isRawName(path);
}

bool isRawName(const std::filesystem::path& path) {
  return std::ranges::find(rawExtensions, lowerExtension(path)) != rawExtensions.end();
}

void removeDevelopedRaw(std::vector<std::filesystem::path>& pictures) {
  const auto withoutExtension = [](std::filesystem::path path) { return path.replace_extension(); };
  std::set<std::filesystem::path> developed;
  for (const auto& picture : pictures)
    if (!isRawName(picture)) developed.insert(withoutExtension(picture));
  std::erase_if(pictures, [&](const std::filesystem::path& picture) {
    return isRawName(picture) && developed.contains(withoutExtension(picture));
  });
}

Picture readPicture(const std::filesystem::path& path) {
  const PictureFormat format = formatOf(path);
  if (format == PictureFormat::exr) return readExrPicture(path);
  if (format == PictureFormat::radiance) return readRadiancePicture(path);
  if (format == PictureFormat::png) {
    PngPicture png = readPng(path);
    return {std::move(png.image), png.bitDepth, false, std::move(png.color)};
  }
  return readForeignPicture(path, ForeignExtent::pixels);
}

PictureHeader readPictureHeader(const std::filesystem::path& path) {
  switch (formatOf(path)) {
  case PictureFormat::exr: {
    const ExrFile file(path);
    return {{file.width(), file.height()}, alphaChannel(file, "").has_value(), 1, 0, file.colorStatement()};
  }
  case PictureFormat::radiance: {
    RadianceHeader header = readRadianceHeader(path);
    return {{header.width, header.height}, false, 1, 0, std::move(header.color)};
  }
  case PictureFormat::png: {
    PngHeader header = readPngHeader(path);
    return {{header.width, header.height}, header.hasAlpha, 1, header.bitDepth, std::move(header.color)};
  }
  case PictureFormat::foreign:
    break;
  }
  Picture picture = readForeignPicture(path, ForeignExtent::header);
  const std::string extension = lowerExtension(path);
  const bool pixelsTellAlpha = extension == ".bmp" || extension == ".tga";
  if (pixelsTellAlpha && picture.hasAlpha()) picture = readForeignPicture(path, ForeignExtent::pixels);
  return {{picture.image.width, picture.image.height},
          picture.hasAlpha(),
          picture.orientation,
          picture.bits,
          std::move(picture.color)};
}

void decodePicture(const std::filesystem::path& path) {
  if (formatOf(path) == PictureFormat::exr)
    ExrFile(path).decode();
  else
    readPicture(path);
}

PictureSize readPictureSize(const std::filesystem::path& path) {
  if (formatOf(path) != PictureFormat::foreign) return readPictureHeader(path).size;
  const Picture picture = readForeignPicture(path, ForeignExtent::header);
  return {picture.image.width, picture.image.height};
}

} // namespace surflect::image
