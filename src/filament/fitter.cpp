#include "unflex/filament/fitter.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

#include "unflex/core/number.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::filament {
namespace {

using gcode::E;

constexpr int kDecimals = 5;
// A smaller difference does not show in the written text.
constexpr double kNothing = 1e-9;

std::string number_text(double value) {
  std::string text;
  append_scaled(text, to_scaled(value, kDecimals), kDecimals);
  return text;
}

double rounded(double value) {
  return static_cast<double>(to_scaled(value, kDecimals)) / power_of_ten(kDecimals);
}

// Where the value of the last E word stands. Comments and what is in parentheses are no words.
std::optional<std::pair<std::size_t, std::size_t>> value_of_e(std::string_view content) {
  std::optional<std::pair<std::size_t, std::size_t>> found;
  int depth = 0;
  for (std::size_t i = 0; i < content.size() && content[i] != ';' && content[i] != '*'; ++i) {
    if (content[i] == '(') {
      ++depth;
    } else if (content[i] == ')') {
      --depth;
    } else if (depth == 0 && (content[i] == 'E' || content[i] == 'e')) {
      const std::size_t begin = content.find_first_not_of(" \t", i + 1);
      if (begin == std::string_view::npos) {
        continue;
      }
      const std::size_t end =
          std::min(content.find_first_not_of("+-.0123456789", begin), content.size());
      if (end > begin) {
        found = {begin, end};
        i = end - 1;
      }
    }
  }
  return found;
}

// The sum that the line's text ends with, behind an asterisk.
int checksum_of(std::string_view text) {
  unsigned char sum = 0;
  for (const char c : text) {
    sum = static_cast<unsigned char>(sum ^ static_cast<unsigned char>(c));
  }
  return sum;
}

bool is_move(const gcode::Command& command) {
  return command.kind == gcode::CommandKind::traditional && command.letter == 'G' &&
         command.number <= 3;
}

// Whether the line labels an object, which a printer may leave out. Its E goes on all the same.
bool is_label(const gcode::Command& command) {
  return command.name.starts_with("EXCLUDE_OBJECT") || command.is('M', 486) ||
         command.kind == gcode::CommandKind::none;
}

double filament_of(const gcode::Event& event) {
  double sum_mm = 0.0;
  for (const gcode::Segment& segment : event.segments) {
    sum_mm += segment.delta(E);
  }
  return sum_mm;
}

// The reading of E, in the unit of its words.
double reading_of(const gcode::ModalState& state) {
  return (state.position_mm[E] - state.base_mm[E]) / state.filament_per_e_mm();
}

bool has_too_much(const gcode::Event& event) {
  return std::ranges::any_of(event.segments, &gcode::Segment::too_much_filament);
}

}  // namespace

Fitter::Fitter(FitterOptions options, std::string name)
    : options_(std::move(options)),
      name_(std::move(name)),
      sliced_(options_.interpreter),
      written_(options_.interpreter),
      at_mm_(options_.start_mm) {
  totals_.end_mm = at_mm_;
}

tl::unexpected<Error> Fitter::wrong(const gcode::Line& line, std::string what) const {
  return fail(ErrorKind::input, {name_, line.number}, std::move(what));
}

std::string Fitter::mark() const {
  return fmt::format("{} {} mm of moves that print became {} mm\n", kFilamentMark,
                     number_text(totals_.sliced_mm), number_text(totals_.fitted_mm));
}

Status Fitter::fit(const gcode::Line& line, std::string& text) {
  if (line.content().starts_with(kFilamentMark)) {
    return wrong(line,
                 "says that the print was fitted to its filament before; take the sliced "
                 "file, or extruder.filament_area_mm2 and filament_profile out of the "
                 "printer file");
  }
  const gcode::ModalState before = sliced_.state();
  event_.reset();
  event_.line = line;
  sliced_.interpret(event_);
  const gcode::ModalState& after = sliced_.state();
  if (after.volumetric && !told_of_volume_) {
    told_of_volume_ = true;
    warnings_.push_back({{name_, line.number},
                         "E is a volume here, which the printer divides by the section of its own "
                         "M200 D; do not set that to the section that there is as well"});
  }
  const std::size_t begin = text.size();
  const gcode::Command command = gcode::parse(line.content());
  const bool moves = event_.kind == gcode::EventKind::move;
  const bool may_read_e =
      (event_.kind == gcode::EventKind::border && !is_label(command)) ||
      (event_.kind == gcode::EventKind::barrier && event_.position_lost && before.e_is_absolute());
  const bool begins_to_read_e = after.e_is_absolute() && !before.e_is_absolute();
  if (!moves && std::abs(ahead_) > kNothing && !command.is('G', 92) &&
      (may_read_e || begins_to_read_e)) {
    tell_reading(before, line, text);
  }
  // A line whose E is what it was before moves nothing, and still tells a place.
  const bool has_place = event_.kind == gcode::EventKind::passive && is_move(command);
  if ((moves || has_place) && command.value('E')) {
    if (Status fitted = fit_move(command, before, text); !fitted) {
      return fitted;
    }
  } else {
    at_mm_ += filament_of(event_);
    text += line.text;
    if (event_.kind == gcode::EventKind::barrier && is_move(command) && command.has('E')) {
      warnings_.push_back(
          {{name_, line.number}, "this line's motion is not understood, so its E stays as sliced"});
    }
    // A line that says what E reads says it to the printer too.
    if (!moves && (command.is('G', 92) || after.e_reading() != before.e_reading())) {
      ahead_ = 0.0;
    }
  }
  totals_.end_mm = at_mm_;
  return check(std::string_view(text).substr(begin), event_);
}

void Fitter::tell_reading(const gcode::ModalState& state, const gcode::Line& line,
                          std::string& text) {
  const std::string_view ending = std::string_view(line.text).substr(line.content().size());
  text += fmt::format("G92 E{}{}", number_text(reading_of(state)), ending.empty() ? "\n" : ending);
  ahead_ = 0.0;
}

double Fitter::needed_mm(double sliced_mm, const gcode::ModalState& before) const {
  const double area_mm2 = before.volumetric ? area_of_diameter_mm2(before.filament_diameter_mm)
                                            : options_.sliced_area_mm2;
  return options_.profile.length_mm(at_mm_, sliced_mm * area_mm2);
}

Status Fitter::fit_move(const gcode::Command& command, const gcode::ModalState& before,
                        std::string& text) {
  const gcode::Line& line = event_.line;
  const double sliced_mm = filament_of(event_);
  const bool prints = std::ranges::any_of(event_.segments, &gcode::Segment::extruding);
  const double word = *command.value('E');
  const double reading = before.e_is_absolute() ? reading_of(before) : 0.0;
  // M221 does not hold for all moves on all firmwares, so the word tells how far E goes.
  const double sliced = word - reading;
  const double factor = prints ? needed_mm(sliced_mm, before) / sliced_mm : 1.0;
  const double from = before.e_is_absolute() ? reading + ahead_ : 0.0;
  const double wanted = from + factor * sliced + (prints ? left_ : 0.0);
  const double written = rounded(wanted);
  const double written_mm =
      std::abs(sliced) > kNothing ? sliced_mm * ((written - from) / sliced) : 0.0;
  if (prints) {
    left_ = wanted - written;
    totals_.most = totals_.sliced_mm > 0.0 ? std::max(totals_.most, factor) : factor;
    totals_.least = totals_.sliced_mm > 0.0 ? std::min(totals_.least, factor) : factor;
    totals_.sliced_mm += sliced_mm;
    totals_.fitted_mm += written_mm;
    totals_.material_mm3 += options_.profile.volume_mm3(at_mm_, at_mm_ + written_mm);
  }
  at_mm_ += written_mm;
  ahead_ += written - from - sliced;
  if (std::abs(written - word) < kNothing) {
    text += line.text;
    return {};
  }
  const std::string_view content = line.content();
  const auto place = value_of_e(content);
  if (!place || parse_number(content.substr(place->first, place->second - place->first)) != word) {
    return wrong(line, "has an E that cannot be replaced; write it as E1.25");
  }
  std::string changed(content.substr(0, place->first));
  changed += number_text(written);
  const std::size_t star = content.find('*', place->second);
  if (command.checksum && star != std::string_view::npos) {
    changed += content.substr(place->second, star - place->second);
    changed += fmt::format("*{}", checksum_of(changed));
  } else {
    changed += content.substr(place->second);
  }
  text += changed;
  text += std::string_view(line.text).substr(content.size());
  ++totals_.changed_lines;
  return {};
}

Status Fitter::check(std::string_view written, const gcode::Event& sliced) {
  for (std::size_t at = 0; at < written.size();) {
    const std::size_t end = std::min(written.find('\n', at), written.size() - 1) + 1;
    gcode::Line line;
    line.text = written.substr(at, end - at);
    line.number = sliced.line.number;
    const gcode::Event event = written_.interpret(line);
    if (has_too_much(event) && !has_too_much(sliced)) {
      return wrong(line,
                   "needs more filament than Klipper lets a move take; raise Klipper's "
                   "max_extrude_cross_section, and extruder.max_extrude_cross_section_mm2");
    }
    at = end;
  }
  return {};
}

}  // namespace unflex::filament
