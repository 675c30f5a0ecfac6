// klippy/kinematics/generic_cartesian.py, kinematic_stepper.py: parse_carriages_string().
#include "generic_cartesian.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>

#include "text_lines.hpp"
#include "unflex/core/number.hpp"

namespace unflex::machine {
namespace {

constexpr std::string_view kStepper = "stepper ";
constexpr std::string_view kCarriage = "carriage ";

int axis_of_name(std::string_view name) {
  constexpr std::string_view kAxes = "xyz";
  return name.size() == 1 && kAxes.find(name) != std::string_view::npos
             ? static_cast<int>(kAxes.find(name))
             : -1;
}

// Axes of carriages by their names.
std::map<std::string, int, std::less<>> carriages_of(const KlipperConfig& config) {
  std::map<std::string, int, std::less<>> axes;
  for (const auto& [name, section] : config.sections) {
    if (name.starts_with(kCarriage)) {
      axes[name.substr(kCarriage.size())] = axis_of_carriage(name, section);
    }
  }
  // A further carriage runs along the axis of the one that it names.
  for (const std::string_view kind : {"dual_carriage ", "extra_carriage "}) {
    for (const auto& [name, section] : config.sections) {
      const KlipperOption* const primary = section.find("primary_carriage");
      if (!name.starts_with(kind)) {
        continue;
      }
      const auto known = primary != nullptr ? axes.find(primary->text) : axes.end();
      axes[name.substr(kind.size())] =
          known != axes.end() ? known->second : axis_of_carriage(name, section);
    }
  }
  return axes;
}

tl::unexpected<Error> refuse(const SourcePlace& place, std::string message) {
  return fail(ErrorKind::usage, place, std::move(message));
}

// One "+0.5*carriage" of a sum.
struct Term {
  double factor = 1.0;
  std::string_view carriage;
};

std::optional<Term> term_of(std::string_view text) {
  Term term;
  const std::size_t star = text.find('*');
  if (star != std::string_view::npos) {
    std::string_view factor = trimmed(text.substr(0, star));
    factor.remove_prefix(factor.starts_with('+') ? 1 : 0);
    const std::optional<double> number = parse_number(factor);
    if (!number) {
      return std::nullopt;
    }
    term.factor = *number;
    term.carriage = trimmed(text.substr(star + 1));
    return term;
  }
  text = trimmed(text);
  term.factor = text.starts_with('-') ? -1.0 : 1.0;
  text.remove_prefix(text.starts_with('-') || text.starts_with('+') ? 1 : 0);
  term.carriage = trimmed(text);
  return term;
}

// The terms of "carriage_x-2*carriage_y".
std::vector<std::string_view> split_terms(std::string_view text) {
  std::vector<std::string_view> terms;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find_first_of("+-", begin + 1), text.size());
    terms.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return terms;
}

Result<Motors::Row> row_of(const std::string& section, const KlipperOption& moves,
                           const std::map<std::string, int, std::less<>>& carriages,
                           const std::string& maybe_elsewhere) {
  Motors::Row row{};
  for (const std::string_view text : split_terms(trimmed(moves.text))) {
    const std::optional<Term> term = term_of(text);
    if (!term) {
      return refuse(moves.place, fmt::format("[{}] moves '{}', of which '{}' is no number times a "
                                             "carriage; Klipper would refuse it too",
                                             section, moves.text, text));
    }
    const auto found = carriages.find(term->carriage);
    const int axis = found != carriages.end() ? found->second : axis_of_name(term->carriage);
    if (axis < 0) {
      return refuse(moves.place,
                    fmt::format("[{}] moves the carriage '{}', and no section tells its axis{}",
                                section, term->carriage, maybe_elsewhere));
    }
    double& share = row[static_cast<std::size_t>(axis)];
    if (share != 0.0) {
      return refuse(moves.place,
                    fmt::format("[{}] moves '{}', which names two carriages of {}; Klipper would "
                                "refuse it too",
                                section, moves.text, "XYZ"[axis]));
    }
    share = term->factor;
  }
  return row;
}

// Whether one motor turns as the other, or the other way round.
bool is_same(const Motors::Row& a, const Motors::Row& b) {
  const Motors::Row turned{-b[0], -b[1], -b[2]};
  return a == b || a == turned;
}

}  // namespace

int axis_of_carriage(const std::string& section_name, const KlipperSection& section) {
  const KlipperOption* const axis = section.find("axis");
  return axis_of_name(axis != nullptr
                          ? std::string_view(axis->text)
                          : std::string_view(section_name).substr(section_name.find(' ') + 1));
}

Result<std::vector<GenericMotor>> generic_motors(const KlipperConfig& config,
                                                 const std::string& maybe_elsewhere) {
  const auto carriages = carriages_of(config);
  std::vector<GenericMotor> motors;
  for (const auto& [name, section] : config.sections) {
    const KlipperOption* const moves =
        name.starts_with(kStepper) ? section.find("carriages") : nullptr;
    if (moves == nullptr) {
      continue;
    }
    const Result<Motors::Row> row = row_of(name, *moves, carriages, maybe_elsewhere);
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (std::ranges::none_of(motors,
                             [&](const GenericMotor& other) { return is_same(other.row, *row); })) {
      motors.push_back({name, moves->place, *row});
    }
  }
  return motors;
}

Kinematics kinematics_of(const std::vector<GenericMotor>& motors) {
  const auto has = [&](const Motors::Row& row) {
    return std::ranges::any_of(motors,
                               [&](const GenericMotor& motor) { return is_same(motor.row, row); });
  };
  const bool own = std::ranges::all_of(motors, [](const GenericMotor& motor) {
    return is_same(motor.row, {1.0, 0.0, 0.0}) || is_same(motor.row, {0.0, 1.0, 0.0}) ||
           is_same(motor.row, {0.0, 0.0, 1.0});
  });
  if (own) {
    return Kinematics::cartesian;
  }
  const bool crossed =
      motors.size() == 3 && has({1.0, 1.0, 0.0}) && has({1.0, -1.0, 0.0}) && has({0.0, 0.0, 1.0});
  return crossed ? Kinematics::corexy : Kinematics::linear;
}

}  // namespace unflex::machine
