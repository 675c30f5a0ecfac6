#include "printer_keys.hpp"

#include <fmt/format.h>

#include <iterator>

#include "results.hpp"
#include "unflex/machine/keys.hpp"

namespace unflex::app {

std::string keys_text() {
  std::string text;
  for (const machine::KeyDescription& key : machine::describe_keys()) {
    fmt::format_to(std::back_inserter(text), "{}{}{}{}{}\n    {}; default: {}\n", key.name,
                   key.range.empty() ? "" : "  ", key.range, key.unit.empty() ? "" : "  in ",
                   key.unit, key.meaning, key.default_value);
  }
  return text;
}

Result<ExitCode> run_printer_keys() {
  return write_last(keys_text()).map([] { return ExitCode::done; });
}

}  // namespace unflex::app
