#include "unflex/flow/translate.hpp"

#include <istream>
#include <memory>

#include "translator.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/machine/kinematic_machine.hpp"

namespace unflex::flow {
namespace {

constexpr std::size_t kBlock_bytes = 1U << 16U;

TranslatorOptions options_of(const machine::Settings& settings) {
  constexpr double kMmPerUm = 1e-3;
  return {.interpreter = machine::interpreter_options(settings),
          .machine = machine::kinematic_machine(settings),
          .home_mm = settings.kinematics.home_mm,
          .tolerance_mm = kMmPerUm * settings.tolerance_um()};
}

}  // namespace

Result<TranslatedPrint> translate(const TextStore& print, const std::string& name,
                                  const machine::Settings& settings, Progress& progress,
                                  const std::function<Status(std::string_view)>& write) {
  const std::unique_ptr<std::istream> stream = print.read();
  if (!*stream) {
    return fail(ErrorKind::input, {name, 0}, "cannot be read");
  }
  const double all_bytes = static_cast<double>(print.bytes().value_or(0));
  gcode::LineReader reader(*stream, name);
  Translator translator(options_of(settings), name);
  std::string text;
  gcode::Line line;
  for (bool goes_on = true; goes_on;) {
    const Result<bool> more = reader.next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    goes_on = *more;
    const Status translated = goes_on ? translator.translate(line, text) : Status{};
    if (!translated) {
      return tl::unexpected(translated.error());
    }
    if (!goes_on) {
      translator.finish(text);
    }
    if (!goes_on || text.size() > kBlock_bytes) {
      if (Status written = write(text); !written) {
        return tl::unexpected(written.error());
      }
      text.clear();
      progress.update("translating", all_bytes > 0.0
                                         ? static_cast<double>(reader.bytes_read()) / all_bytes
                                         : -1.0);
      if (progress.cancelled()) {
        return fail(ErrorKind::internal, "cancelled");
      }
    }
  }
  TranslatedPrint result{.moves = translator.moves(), .lines = translator.lines(), .warnings = {}};
  for (const Diagnostic& warning : translator.warnings()) {
    result.warnings.push_back(to_string(warning));
  }
  return result;
}

}  // namespace unflex::flow
