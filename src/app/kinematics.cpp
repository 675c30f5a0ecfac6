#include "kinematics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "inputs.hpp"
#include "print_work.hpp"

namespace unflex::app {
namespace {

constexpr std::array<char, 3> kLetters = {'A', 'B', 'C'};

// What was measured to 0.01 mm tells no more.
constexpr double kSmallest_mm = 0.001;

// Without the sign of a zero.
double rounded(double value, double digits) { return std::round(value * digits) / digits + 0.0; }

std::string range_text(const flow::JointUse& joint) {
  return joint.range_mm ? fmt::format(" of {:g} to {:g}", joint.range_mm->min, joint.range_mm->max)
                        : std::string{};
}

// The line of the residual that is furthest off in the row.
std::size_t worst_line(const kinematics::Fit& fit, const kinematics::Points& points,
                       std::size_t row) {
  const auto worst = std::ranges::max_element(
      fit.residuals_mm, {},
      [row](const kinematics::Joints& residual) { return std::abs(residual[row]); });
  return points.lines[static_cast<std::size_t>(worst - fit.residuals_mm.begin())];
}

Result<ExitCode> run_fit(const RunConfig& config, Console& console) {
  Result<Input> input = Input::open(config.kinematics.points);
  if (!input) {
    return tl::unexpected(input.error());
  }
  const Result<std::string> text = input->read_all();
  if (!text) {
    return tl::unexpected(text.error());
  }
  const Result<kinematics::Points> points = kinematics::parse_points(*text, input->name());
  if (!points) {
    return tl::unexpected(points.error());
  }
  Result<kinematics::Fit> fit = kinematics::fit(points->pairs);
  if (!fit) {
    return fail(fit.error().kind, {input->name(), 0}, fit.error().message);
  }
  const std::string rows = rows_text(*fit);
  const std::string told = config.quiet ? rows : rows + residuals_text(*fit, *points);
  console.note(told);
  return write_last(told).map([] { return ExitCode::done; });
}

// An error if the tool cannot follow the print. Its places are shown before.
Status fits(const RunConfig& config, const flow::PrintInJoints& print, Console& console) {
  if (print.missed_moves == 0) {
    return {};
  }
  std::vector<std::string> lines;
  for (const flow::Miss& miss : print.misses) {
    lines.push_back(fmt::format("{}:{}: {}", config.input, miss.line, miss.why));
  }
  console.lines(lines, print.missed_lines, "lines that the machine cannot follow");
  return fail(ErrorKind::input, {config.input, print.misses.front().line},
              fmt::format("{} where this machine cannot be; place the print elsewhere, or correct "
                          "the keys of kinematics if they are wrong",
                          print.missed_moves == 1 ? "1 move goes"
                                                  : fmt::format("{} moves go, from this line on,",
                                                                print.missed_moves)));
}

Result<ExitCode> run_on_joints(const RunConfig& config, Console& console) {
  Result<Workspace> space = open_workspace(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  const Result<flow::PrintInJoints> print = work_on_print(config, *space, flow::print_in_joints);
  if (!print) {
    return tl::unexpected(print.error());
  }
  // Guesses of resonances would be beside the point.
  std::vector<std::string> warnings;
  for (const Diagnostic& note : space->settings.notes) {
    warnings.push_back(to_string(note));
  }
  warnings.insert(warnings.end(), print->warnings.begin(), print->warnings.end());
  console.warnings(warnings);
  return print_summary(config, joints_text(*print, config.input, space->settings), console)
      .and_then([&] { return fits(config, *print, console); })
      .map([] { return ExitCode::done; });
}

}  // namespace

std::string joints_text(const flow::PrintInJoints& print, const std::string& input,
                        const machine::Settings& settings) {
  std::string text = input + "\n";
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "machine       {}, condition of J {:.3f}\n",
                 to_string(settings.kinematics.type), print.condition);
  for (const flow::JointUse& joint : print.joints) {
    fmt::format_to(out, "joint {:<8}{:.3f} to {:.3f}{} mm\n", joint.name, joint.min_mm,
                   joint.max_mm, range_text(joint));
    fmt::format_to(out, "              {:.1f} mm/s (line {}), {:.0f} mm/s² (line {}) at most\n",
                   joint.speed_mm_s.value, joint.speed_mm_s.line, joint.accel_mm_s2.value,
                   joint.accel_mm_s2.line);
  }
  fmt::format_to(out, "moves         {}, {} of them go where the machine cannot be\n", print.moves,
                 print.missed_moves);
  if (print.unknown_moves > 0) {
    fmt::format_to(out, "              {} more begin at a place that the file does not tell\n",
                   print.unknown_moves);
  }
  if (!print.has_reach) {
    text +=
        "reach         not known; kinematics.range_a_mm and so on tell it, and the legs of a "
        "tripteron\n";
  }
  return text;
}

std::string rows_text(const kinematics::Fit& fit) {
  std::string text = "kinematics.type = \"linear\"  # or \"tripteron\"\n";
  for (std::size_t i = 0; i < fit.rows.size(); ++i) {
    const auto& [x, y, z] = fit.rows[i];
    text += fmt::format("kinematics.joint_{} = [{:.6f}, {:.6f}, {:.6f}]\n", "abc"[i],
                        rounded(x, 1e6), rounded(y, 1e6), rounded(z, 1e6));
  }
  const auto& [a, b, c] = fit.offset_mm;
  return text + fmt::format("kinematics.offset_mm = [{:.4f}, {:.4f}, {:.4f}]\n", rounded(a, 1e4),
                            rounded(b, 1e4), rounded(c, 1e4));
}

std::string residuals_text(const kinematics::Fit& fit, const kinematics::Points& points) {
  std::string text;
  for (std::size_t i = 0; i < fit.rows.size(); ++i) {
    text += fmt::format("# residual of {}: {:.4f} mm RMS, {:.4f} mm at most (line {})\n",
                        kLetters[i], fit.rms_mm[i], fit.largest_mm[i], worst_line(fit, points, i));
  }
  const std::size_t worst = fit.worst_row;
  if (points.pairs.size() == kinematics::kFewestPairs) {
    return text + "# four places are met by any rails; measure more to see whether one is off\n";
  }
  if (fit.rms_mm[worst] < kSmallest_mm) {
    return text + "# no rail is off\n";
  }
  return text + fmt::format(
                    "# rail {} is off most; measure line {} again, and then look at that "
                    "rail and its leg\n",
                    kLetters[worst], worst_line(fit, points, worst));
}

Status check_kinematics(const RunConfig& config) {
  const bool has_points = !config.kinematics.points.empty();
  if (has_points == !config.input.empty()) {
    return fail(ErrorKind::usage,
                has_points ? "--fit reads places alone; leave out the print, or --fit"
                           : "what to look at? give a print, or --fit with measured places");
  }
  if (has_points && (config.printer_file || !config.overrides.empty())) {
    return fail(ErrorKind::usage,
                "--printer and --set are of a print; --fit finds what belongs there");
  }
  return {};
}

Result<ExitCode> run_kinematics(const RunConfig& config, Console& console) {
  return config.kinematics.points.empty() ? run_on_joints(config, console)
                                          : run_fit(config, console);
}

}  // namespace unflex::app
