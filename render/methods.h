// All methods, and the renderer of any model.
#pragma once

#include "render/method/method.h"

#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace surflect::method {

// Surfels first.
std::span<const Method> methods();
// Throws Error that names the methods and the nearest one.
const Method& methodOf(std::string_view tag);
// The method that the tag "format" of a model's manifest.json selects; without a tag, surfels. Methods that
// share a format are opened alike: the first of them. Throws Error naming file and field, also for an unknown
// tag.
const Method& methodOfModel(const std::filesystem::path& model);

// Opens a model of any method with options for its frames. Throws Error as methodOfModel() and Method::open
// do; and Cancelled.
std::unique_ptr<Renderer> openRenderer(const std::filesystem::path& model, const Setting& setting = {},
                                       const Progress& progress = {});

// Opens a scene of several models, which must all be light field maps. Throws Error likewise, and where
// models do not fit together.
std::unique_ptr<Renderer> openScene(std::span<const scene::PlacedModel> objects, const Setting& setting = {},
                                    const Progress& progress = {});

} // namespace surflect::method
