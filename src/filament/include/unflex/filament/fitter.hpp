// A print whose E suits a filament that is not a full cylinder.
//
// Slicers compute E for a full section of the diameter they are told. Where the section holds less,
// moves that print push more of it. Retractions are lengths of filament, so they stay.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/filament/profile.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::filament {

struct FitterOptions {
  gcode::InterpreterOptions interpreter;
  double sliced_area_mm2 = 0.0;  // the section that the print was sliced for
  Profile profile{1.0};          // the section that there is
  double start_mm = 0.0;         // where the print begins on the filament
};

struct Totals {
  std::size_t changed_lines = 0;
  // Filament of moves that print, as sliced and as written.
  double sliced_mm = 0.0;
  double fitted_mm = 0.0;
  double material_mm3 = 0.0;  // what they lay
  // The largest and the least factor of E.
  double most = 0.0;
  double least = 0.0;
  double end_mm = 0.0;  // where the print ends on the filament
};

class Fitter {
 public:
  Fitter(FitterOptions options, std::string name);

  // Appends the replacement of the line: the line itself, or the line with another E. Before some
  // lines comes a G92, so that E reads in the printer what the file expects. Lines come in the
  // order of the file. Errors are of kind input: the line was fitted before, Klipper would refuse
  // it, or its E cannot be replaced.
  [[nodiscard]] Status fit(const gcode::Line& line, std::string& text);

  // The meaning of the last line in the sliced file, and the state after it.
  [[nodiscard]] const gcode::Event& event() const { return event_; }
  [[nodiscard]] const gcode::ModalState& state() const { return sliced_.state(); }
  [[nodiscard]] const Totals& totals() const { return totals_; }
  [[nodiscard]] const std::vector<Diagnostic>& warnings() const { return warnings_; }

  // A comment for the end of a file, by which a fitted file is known again.
  [[nodiscard]] std::string mark() const;

 private:
  [[nodiscard]] Status fit_move(const gcode::Command& command, const gcode::ModalState& before,
                                std::string& text);
  // The filament that a move that prints needs.
  [[nodiscard]] double needed_mm(double sliced_mm, const gcode::ModalState& before) const;
  void tell_reading(const gcode::ModalState& state, const gcode::Line& line, std::string& text);
  [[nodiscard]] Status check(std::string_view written, const gcode::Event& sliced);
  [[nodiscard]] tl::unexpected<Error> wrong(const gcode::Line& line, std::string what) const;

  FitterOptions options_;
  std::string name_;
  gcode::Interpreter sliced_;
  gcode::Interpreter written_;
  gcode::Event event_;
  Totals totals_;
  std::vector<Diagnostic> warnings_;
  double at_mm_;  // along the filament
  // Both are in the unit of E's words: E in the printer minus E in the file, and the remainder that
  // rounding has left.
  double ahead_ = 0.0;
  double left_ = 0.0;
  bool told_of_volume_ = false;
};

}  // namespace unflex::filament
