// Colour statements of files, made for tests: ICC profiles, and chunks of PNG.
#pragma once

#include "srf/image/color.h"

#include <string>

namespace surflect {

enum class ProfileCurve { srgb, linear };

// Profile of a matrix and three equal curves; called "made by a test".
std::string profileBytes(const image::Primaries& primaries, ProfileCurve kind);
std::string grayProfileBytes(double gamma);
// Profile of a table, not a matrix: RGB is a grey of the CIE lightness 100 min(R, G, B).
std::string tableProfileBytes();

// The file with one chunk more, right after its header.
std::string withChunk(std::string png, const std::string& name, const std::string& content);

// Contents of the chunks that have these names.
std::string gamaContent(double gamma);
std::string chrmContent(const image::Primaries& primaries);
std::string iccpContent(const std::string& profile);

} // namespace surflect
