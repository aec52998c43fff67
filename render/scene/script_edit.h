// A script's values as JSON, and its text with other values: what an editor needs that keeps comments.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace surflect::scene {

// JSON object with the keys and values of a script. Each table of [[light]] and [[warp]] has its place in
// the text, 0, 1, .., as the key "#". Throws Error where the text is not TOML; dates become text.
std::string scriptValues(std::string_view text, const std::filesystem::path& path);

// Text whose values are those of a JSON object as scriptValues() writes it: only the values that differ are
// replaced, so that comments, order and layout of the others survive. Tables of `light` and `warp` that lack
// a "#" are new; those whose place is missing are removed with the comment right above them; an empty list is
// as none. `path` is the script's, for messages. Throws Error for text that is not such JSON, or is deeper
// than kDeepestToml, and where the text's layout does not let a value be replaced.
std::string withValues(std::string_view text, const std::filesystem::path& path, std::string_view values);

} // namespace surflect::scene
