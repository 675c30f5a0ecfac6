#include "command_options.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "unflex/core/number.hpp"

namespace unflex::app {

CLI::Validator positive() {
  return {[](std::string& text) {
            const std::optional<double> value = parse_real(text);
            return value && *value > 0.0 ? std::string{}
                                         : fmt::format("'{}' is not a number above 0", text);
          },
          ""};
}

CLI::Validator temperature(double most) {
  return {[most](std::string& text) {
            constexpr double kLeast_c = -50.0;
            const std::optional<double> value = parse_number(text);
            return value && *value >= kLeast_c && *value <= most
                       ? std::string{}
                       : fmt::format("'{}' is not a temperature from {} to {} °C", text, kLeast_c,
                                     most);
          },
          ""};
}

CLI::Validator counting_number(unsigned most) {
  return {[most](std::string& text) {
            const std::optional<double> value = parse_number(text);
            const bool good = value && *value >= 1.0 && *value <= static_cast<double>(most) &&
                              *value == std::floor(*value);
            return good ? std::string{}
                        : fmt::format("'{}' is not a whole number from 1 to {}", text, most);
          },
          ""};
}

double number_of(const std::string& option, const std::string& text) {
  const std::optional<double> value = parse_real(text);
  if (!value) {
    throw CLI::ConversionError(text, option);
  }
  return *value;
}

CLI::Option* add_number(CLI::App& command, const std::string& name,
                        std::function<void(double)> take, const std::string& help) {
  return command.add_option_function<std::string>(
      name,
      [take = std::move(take), name](const std::string& text) { take(number_of(name, text)); },
      help);
}

void add_overrides(CLI::App& command, RunConfig& config) {
  // One value for each --set: more would swallow the input's name.
  command.add_option("--set", config.overrides, "Override a key of the printer file; repeatable")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
}

void add_settings(CLI::App& command, RunConfig& config) {
  command
      .add_option("--printer", config.printer_file,
                  "The printer: TOML, Klipper's printer.cfg, Marlin's M503, RRF's config.g")
      ->type_name("FILE");
  add_overrides(command, config);
}

void add_common_options(CLI::App& command, RunConfig& config, const char* report,
                        const char* quiet) {
  add_settings(command, config);
  command.add_option("--report", config.report, report)->type_name("FILE");
  command.add_flag("-q,--quiet", config.quiet, quiet);
}

void add_jobs(CLI::App& command, RunConfig& config) {
  command
      .add_option("-j,--jobs", config.solve.workers,
                  "How many to compute at once, 1 to 256, all processors by default")
      ->type_name("N")
      ->check(counting_number(kMaxWorkers));
}

}  // namespace unflex::app
