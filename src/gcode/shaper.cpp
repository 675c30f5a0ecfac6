// M593 of Marlin and RepRapFirmware. Klipper's SET_INPUT_SHAPER is in extended.cpp.
#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "characters.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// The text of P, in quotes or not, in lower case. Characters that RepRapFirmware ignores in a name
// are left out (StringParser::GetReducedString).
std::string shaper_name(std::string_view arguments) {
  std::string name;
  const std::size_t at = arguments.find_first_of("Pp");
  if (at == std::string_view::npos) {
    return name;
  }
  arguments.remove_prefix(at + 1);
  const bool quoted = !arguments.empty() && arguments.front() == '"';
  if (quoted) {
    arguments.remove_prefix(1);
  }
  arguments = arguments.substr(0, arguments.find(quoted ? '"' : ' '));
  for (const char c : arguments) {
    if (is_letter(c) || is_digit(c)) {
      name.push_back(static_cast<char>(is_letter(c) ? to_upper(c) - 'A' + 'a' : c));
    }
  }
  return name;
}

}  // namespace

// feature/input_shaping/M593.cpp; a new frequency waits for the end of all motion
// (stepper.cpp, set_shaping_frequency). With neither X nor Y it is for both.
void Interpreter::marlin_shaper(Event& event) {
  const Axes<bool> named{command_.has('X'), command_.has('Y')};
  const Axes<bool> is_meant = any_axis(std::identity{}, named) ? named : on_all_axes(true);
  const std::optional<double> ratio = command_.value('D');
  if (ratio && *ratio >= 0.0 && *ratio <= 1.0) {
    for_each_axis(
        [&](bool is_set, std::optional<double>& value) { value = is_set ? ratio : value; },
        is_meant, state_.shaper.settings.damping_ratio);
  }
  const std::optional<double> freq_hz = command_.value('F');
  if (!freq_hz || *freq_hz < 0.0) {
    return;
  }
  event.kind = EventKind::barrier;
  for_each_axis(
      [&](bool is_set, bool& unknown, bool& touched, double& value_hz) {
        if (is_set) {
          unknown = touched = false;
          value_hz = *freq_hz;
        }
      },
      is_meant, state_.shaper.unknown, state_.shaper_touched, state_.shaper.freq_hz);
  note_shaper(event);
}

// Movement/AxisShaper.cpp, AxisShaper::Configure. There is one shaper for both axes. All words but
// L wait for the end of all motion. Without a type, a shaper that is off becomes "zvd", even if L
// stands alone. So L must not stand in a run, where the shaper is off.
void Interpreter::rrf_shaper(Event& event) {
  const bool has_type = command_.has('P');
  const bool sets = has_type || command_.value('F') || command_.value('S') || command_.value('L');
  if (!sets) {
    return;
  }
  event.kind = EventKind::barrier;
  ShaperSettings& shaper = state_.shaper.settings;
  const auto freq_hz = command_.value('F');
  const auto ratio = command_.value('S');
  const bool is_off = state_.shaper.freq_hz.x == 0.0;
  constexpr double kDefaultFreq_hz = 40.0;  // AxisShaper.h
  shaper.kept_freq_hz = freq_hz ? freq_hz : shaper.kept_freq_hz.value_or(kDefaultFreq_hz);
  if (ratio) {
    shaper.damping_ratio = on_all_axes(ratio);
  }
  if (has_type) {
    shaper.type = on_all_axes(shaper_name(command_.arguments));
  } else if (is_off) {
    shaper.type = on_all_axes<std::string>("zvd");
  }
  shaper.custom_words = shaper.type.x == "custom" ? std::string(command_.arguments) : "";
  state_.shaper.freq_hz = on_all_axes(shaper.type.x == "none" ? 0.0 : *shaper.kept_freq_hz);
  state_.shaper.unknown = state_.shaper_touched = on_all_axes(false);
  note_shaper(event);
}

}  // namespace unflex::gcode
