// Figures of docs/gallery.md that `surflect render` cannot make; scripts/gallery calls them.
#pragma once

#include <filesystem>
#include <istream>

namespace surflect::bench {

// Composes pictures with labels above them, as described by JSON on `layout`:
//
//   { "out": "figure.png", "columns": 3, "cells": [
//     { "file": "frame.0001.exr", "label": "(a) at rest",
//       "layer": "color", "stretch", "camera_blend" or "light_blend",   // of a film; PNGs are unchanged
//       "white": "a name",                // cells of one name share an exposure; default: all share one
//       "crop": [x, y, width, height],    // pixels
//       "zoom": 2,                        // magnification
//       "dots": [[x, y, radius, r, g, b, depth]] } ] }   // lamps: pixels of the film, and its depth
//
// Films stand on `"background": [r, g, b]`, sRGB. Throws Error.
void composePanels(std::istream& layout);

// Relights a reflectance image by an environment [Weyrich 2005, Fig. 2]: the photographs of one camera, each
// multiplied by the part of the environment nearest to its light, and their sum. Writes environment.png,
// lights.png (the environment at the resolution of the lights), captured-K.exr and weighted-K.exr of the five
// lights that contribute most, and sum.exr into the folder. z is up in the world and in the environment.
// Throws Error.
void relightReflectanceImage(const std::filesystem::path& capture, const std::string& camera,
                             const std::filesystem::path& environment, const std::filesystem::path& folder);

// Compares a rendering with the photograph by the same camera under the same light. Writes truth.exr and
// difference.exr, channel by channel, into the folder. Throws Error.
void writeTruthAndDifference(const std::filesystem::path& capture, const std::string& camera,
                             const std::string& light, const std::filesystem::path& rendering,
                             const std::filesystem::path& folder);

// Draws a square grid of surfels, stretched one to five [Weyrich 2005, Fig. 8]. Writes circular-reduced.exr,
// elliptical-reduced.exr, circular.exr and elliptical.exr into the folder.
void drawSplats(const std::filesystem::path& folder);

} // namespace surflect::bench
