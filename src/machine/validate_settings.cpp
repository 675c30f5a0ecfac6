#include <fmt/core.h>

#include <string>

#include "key_values.hpp"
#include "toml_reader.hpp"
#include "tool_keys.hpp"
#include "unflex/machine/machine.hpp"
#include "validate.hpp"

namespace unflex::machine {

// Each value is read again as if a printer file held it, since reading checks what it may be.
Status Settings::validate() const {
  Draft own;
  own.settings = *this;
  own.places.resize(key_table().size());
  Draft again;
  again.places.resize(key_table().size());
  for (const Key& key : key_table()) {
    const std::optional<std::string> value = key.converted ? std::nullopt : own_value(key, own);
    if (!value) {
      continue;
    }
    if (const Status read = apply_override(fmt::format("{}={}", key.name, *value), again); !read) {
      return fail(ErrorKind::usage, read.error().message);
    }
  }
  for (const ToolSettings& tool : tools) {
    for (const auto& [key, value] : rows_of(tool)) {
      if (const Status read = apply_override(fmt::format("{}={}", key, value), again); !read) {
        return fail(ErrorKind::usage, read.error().message);
      }
    }
  }
  return resolve_dynamics(own).and_then([&] { return check_consistency(own); }).and_then([&] {
    return check_tools(own);
  });
}

}  // namespace unflex::machine
