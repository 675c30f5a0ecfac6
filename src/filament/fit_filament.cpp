#include "unflex/filament/fit_filament.hpp"

#include <istream>
#include <memory>
#include <utility>

#include "unflex/gcode/extrusion_mode.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::filament {

Result<FittedPrint> fit_filament(const TextStore& print, const std::string& name,
                                 const machine::Settings& settings,
                                 const filament::Profile& profile, bool is_marked,
                                 const std::function<Status(std::string_view)>& write) {
  constexpr std::size_t kBlock = 1U << 16U;
  const std::unique_ptr<std::istream> stream = print.read();
  if (!*stream) {
    return fail(ErrorKind::input, {name, 0}, "cannot be read");
  }
  gcode::LineReader reader(*stream, name);
  filament::Fitter fitter(
      {.interpreter = machine::interpreter_options(settings),
       .sliced_area_mm2 = filament::area_of_diameter_mm2(settings.extruder.filament_diameter_mm),
       .profile = profile,
       .start_mm = settings.extruder.filament_start_mm},
      name);
  gcode::ExtrusionModeCheck mode;
  std::string text;
  gcode::Line line;
  for (;;) {
    const Result<bool> more = reader.next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more && is_marked) {
      text += text.empty() || text.ends_with('\n') ? "" : "\n";
      text += fitter.mark();
    }
    if (!*more || text.size() > kBlock) {
      if (Status written = write(text); !written) {
        return tl::unexpected(written.error());
      }
      text.clear();
    }
    if (!*more) {
      break;
    }
    const Status fitted = fitter.fit(line, text).and_then([&] {
      return mode.add(fitter.event(), fitter.state(), name);
    });
    if (!fitted) {
      return tl::unexpected(fitted.error());
    }
  }
  FittedPrint result{fitter.totals(), {}};
  for (const Diagnostic& warning : fitter.warnings()) {
    result.warnings.push_back(to_string(warning));
  }
  return result;
}

}  // namespace unflex::filament
