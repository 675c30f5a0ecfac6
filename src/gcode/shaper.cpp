// M593 of Marlin and RepRapFirmware. Klipper's SET_INPUT_SHAPER is in extended.cpp.
#include <algorithm>
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
  const bool for_x = command_.has('X') || !command_.has('Y');
  const bool for_y = command_.has('Y') || !command_.has('X');
  const std::optional<double> ratio = command_.value('D');
  if (ratio && *ratio >= 0.0 && *ratio <= 1.0) {
    state_.shaper.damping_ratio_x = for_x ? ratio : state_.shaper.damping_ratio_x;
    state_.shaper.damping_ratio_y = for_y ? ratio : state_.shaper.damping_ratio_y;
  }
  const std::optional<double> freq_hz = command_.value('F');
  if (!freq_hz || *freq_hz < 0.0) {
    return;
  }
  event.kind = EventKind::barrier;
  state_.shaper_unknown_x = state_.shaper_unknown_x && !for_x;
  state_.shaper_unknown_y = state_.shaper_unknown_y && !for_y;
  state_.shaper_touched_x = state_.shaper_touched_x && !for_x;
  state_.shaper_touched_y = state_.shaper_touched_y && !for_y;
  state_.shaper_freq_x_hz = for_x ? *freq_hz : state_.shaper_freq_x_hz;
  state_.shaper_freq_y_hz = for_y ? *freq_hz : state_.shaper_freq_y_hz;
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
  ShaperSettings& shaper = state_.shaper;
  const auto freq_hz = command_.value('F');
  const auto ratio = command_.value('S');
  const bool is_off = state_.shaper_freq_x_hz == 0.0;
  constexpr double kDefaultFreq_hz = 40.0;  // AxisShaper.h
  shaper.kept_freq_hz = freq_hz ? freq_hz : shaper.kept_freq_hz.value_or(kDefaultFreq_hz);
  if (ratio) {
    shaper.damping_ratio_x = shaper.damping_ratio_y = ratio;
  }
  if (has_type) {
    shaper.type_x = shaper.type_y = shaper_name(command_.arguments);
  } else if (is_off) {
    shaper.type_x = shaper.type_y = "zvd";
  }
  shaper.custom_words = shaper.type_x == "custom" ? std::string(command_.arguments) : "";
  state_.shaper_freq_x_hz = shaper.type_x == "none" ? 0.0 : *shaper.kept_freq_hz;
  state_.shaper_freq_y_hz = state_.shaper_freq_x_hz;
  state_.shaper_unknown_x = state_.shaper_unknown_y = false;
  state_.shaper_touched_x = state_.shaper_touched_y = false;
  note_shaper(event);
}

}  // namespace unflex::gcode
