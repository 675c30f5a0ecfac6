#include "tune.hpp"

#include <optional>
#include <string>
#include <utility>

#include "tune_parts.hpp"

namespace unflex::app {

Result<ExitCode> run_tune(const RunConfig& config, Console& console) {
  std::optional<std::string> printed;
  if (!config.input.empty()) {
    Result<std::string> text = printed_tower(config);
    if (!text) {
      return tl::unexpected(text.error());
    }
    printed = std::move(*text);
  }
  const bool is_pressure =
      printed ? tune::is_pressure_tower(*printed) : config.tune.asks_for_pressure;
  return is_pressure ? tune_pressure(config, printed, console)
                     : tune_axes(config, printed, console);
}

}  // namespace unflex::app
