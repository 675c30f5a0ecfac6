// From TOML text to members. The only file that sees the TOML library is toml_reader.cpp.
#pragma once

#include <string>
#include <string_view>

#include "draft.hpp"

namespace unflex::machine {

// The beginning of the place of an override.
inline constexpr std::string_view kOverrideMark = "--set ";

// Reads a printer file into the draft; `name` is its name in messages.
[[nodiscard]] Status read_toml(std::string_view text, const std::string& name, Draft& draft);

// Applies an override "key=value". The value is TOML; a bare word is a string, and numbers may be
// written as in G-code (".5").
[[nodiscard]] Status apply_override(const std::string& text, Draft& draft);

}  // namespace unflex::machine
