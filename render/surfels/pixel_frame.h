// A frame of a model with a pixel grid: the photographs of its only view are blended pixel by pixel, and the
// relit picture is drawn on the squares of the grid.
//
//   deform corners -> squares on the screen -> weights of lights at corners -> relit picture -> draw
//
// Squares are cut at the camera. Where several lie behind each other, they are composited by alpha.//
// Weights of lights are linear between the corners of a square, and so are coefficients of blocks, which are
// linear in them. From the model's own camera each pixel of a frame is one of the photographs' pixels.
#pragma once

#include "render/surfels/frame.h"
#include "render/surfels/frame_work.h"

namespace surflect::surfels {

// Colour and AOVs of a frame; field.grid is set. Fills workspace.deformed and counts of workspace.stats.
// Throws Error as shade does, or for the AOV predicted_error, which such models lack; and Cancelled.
FrameLayers renderPixels(const weights::ReflectanceField& field, const LitScene& lit,
                         const FrameOptions& options, FrameWorkspace& workspace, StageClock& clock,
                         const Progress& progress);

} // namespace surflect::surfels
