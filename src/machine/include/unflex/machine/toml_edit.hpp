// Values in a printer file changed, and everything else in it left as it is.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "unflex/core/error.hpp"

namespace unflex::machine {

struct TomlEdit {
  std::string key;     // "dynamics.x.freq_hz"
  std::string value;   // as TOML writes it
  std::string remark;  // becomes the comment behind the value
};

// The text of a TOML printer file with these values. A key that the file does not give goes into
// its section, which is added at the end if there is none. `name` stands for the file in messages.
// An error of kind usage if the file is not TOML, or if it gives the value in a way that cannot be
// changed in place; then it tells the lines to write by hand.
[[nodiscard]] Result<std::string> with_values(std::string_view text, const std::string& name,
                                              std::span<const TomlEdit> edits);

}  // namespace unflex::machine
