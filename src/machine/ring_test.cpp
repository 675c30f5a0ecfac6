#include "unflex/machine/ring_test.hpp"

#include <fmt/core.h>

#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "test_place.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::machine {
namespace {

constexpr std::array kSpeeds_mm_s = {20.0, 50.0, 100.0};
constexpr double kRest_ms = 1000.0;
constexpr double kStroke_mm = 60.0;
// M956 is told how many samples to record. Few accelerometers give more than this.
constexpr double kSamplesPerSecond = 1600.0;

// The commands before and after a move whose stop is recorded.
using Around = std::pair<std::string, std::string>;

// nullopt if the firmware has none.
std::optional<Around> around(Firmware firmware, char axis, double speed_mm_s) {
  const FirmwareWriting& writing = spec_of(firmware).writing;
  if (writing.record_before.empty()) {
    return std::nullopt;
  }
  const std::string name = fmt::format("unflex_{}_{:.0f}", axis, speed_mm_s);
  const double samples = std::ceil(kSamplesPerSecond * (kStroke_mm / speed_mm_s + kRest_ms * 1e-3));
  const auto filled = [&](std::string_view form) {
    return fmt::format(fmt::runtime(form), fmt::arg("name", name), fmt::arg("samples", samples));
  };
  return Around{filled(writing.record_before), filled(writing.record_after)};
}

}  // namespace

Result<std::string> ring_test(const Settings& settings, char axis) {
  const bool is_x = axis == 'x';
  const Result<double> x_mm =
      begin_of(settings.printer.travel_mm.x, is_x ? kStroke_mm : 0.0, "printer.travel_x_mm");
  const Result<double> y_mm =
      begin_of(settings.printer.travel_mm.y, is_x ? 0.0 : kStroke_mm, "printer.travel_y_mm");
  if (!x_mm || !y_mm) {
    return tl::unexpected(x_mm ? y_mm.error() : x_mm.error());
  }
  const char word = static_cast<char>(std::toupper(static_cast<unsigned char>(axis)));
  const double from_mm = is_x ? *x_mm : *y_mm;
  std::string text = fmt::format(
      "; unflex identify --make-test {}: what still rings behind a compensated stop?\n"
      "; No heat, no filament. Fasten the accelerometer at the nozzle.\n"
      "G28\nG21\nG90\nG1 Z{:.2f} F600\nG1 X{:.3f} Y{:.3f} F3000\nG1 {}{:.3f} F3000\n",
      axis, kTestHeight_mm, *x_mm, *y_mm, word, from_mm + kStroke_mm);
  for (const double speed_mm_s : kSpeeds_mm_s) {
    const auto commands = around(settings.printer.firmware, axis, speed_mm_s);
    if (!commands) {
      return fail(
          ErrorKind::usage,
          "Marlin has no command that records an accelerometer, so there is no test to make");
    }
    text += fmt::format(
        "G1 {0}{1:.3f} F3000\nM400\nG4 P{2:.0f}\n{3}G1 {0}{4:.3f} F{5:.0f}\nM400\nG4 P{2:.0f}\n{6}",
        word, from_mm, kRest_ms, commands->first, from_mm + kStroke_mm, 60.0 * speed_mm_s,
        commands->second);
  }
  return text;
}

}  // namespace unflex::machine
