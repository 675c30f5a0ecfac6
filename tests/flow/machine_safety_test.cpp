// Violations that verify finds in an emitted file spoilt by someone, or by a fault of unflex: every
// rule broken once for every firmware, and random edits.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/run/nozzle_motion.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::flow {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using testing::JobFolder;

// A fast wall, and a slow one where the nozzle hardly strays even without compensation.
constexpr const char* kPrint =
    "G28\nG90\nM83\nG1 X60 Y60 Z0.2 F6000\nG4 P500\nM106 S128\n"
    "G1 X100 E1.6 F7200\nM104 S210\nG1 Y100 E1.6\nM106 S200\nG1 X60 E1.6\nG1 Y60 E1.6\n"
    "G1 E-1 F1800\nG1 X80 Y80 F9000\nG1 E1 F1800\n"
    "M204 P800 T800\nG1 X90 E.4 F900\nM106 S90\nG1 X92 Y81 E.09\nM105\nG1 X92 Y90 E.36\nG1 X85 Y92 "
    "E.3\n"
    "M140 S0\nG4 P500\nM104 S0\nM84\n";

std::vector<std::string> overrides(Firmware firmware) {
  return {fmt::format("printer.firmware={}", to_string(firmware)),
          "printer.travel_x_mm=[0, 200]",
          "printer.travel_y_mm=[0, 200]",
          "printer.input_shaper_freq_x_hz=48",
          "printer.input_shaper_freq_y_hz=48",
          "solve.tail_ms=20"};
}

using Lines = std::vector<std::string>;

Lines lines_of(const std::string& text) {
  Lines lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin) + 1;
    lines.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return lines;
}

std::string text_of(const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += line;
  }
  return text;
}

// The number after a letter of the line, and the line with another number there.
double value(const std::string& line, char letter) {
  return std::stod(line.substr(line.find(letter) + 1));
}
bool has(const std::string& line, char letter) { return line.find(letter) != std::string::npos; }
std::string with(const std::string& line, char letter, double number) {
  if (!has(line, letter)) {
    return fmt::format("{} {}{:.5f}\n", line.substr(0, line.size() - 1), letter, number);
  }
  const std::size_t at = line.find(letter);
  const std::size_t end = line.find_first_of(" \n", at);
  return line.substr(0, at) + fmt::format("{}{:.5f}", letter, number) + line.substr(end);
}

class Emitted : public ::testing::TestWithParam<Firmware> {
 protected:
  Emitted() : folder_(kPrint, overrides(GetParam())), good_(good(GetParam())) {}

  // The compensated print, made once for each firmware.
  static const Lines& good(Firmware firmware) {
    static std::map<Firmware, Lines> made;
    Lines& lines = made[firmware];
    if (lines.empty()) {
      const JobFolder folder(kPrint, overrides(firmware));
      Job job = folder.job();
      job.engine = EngineChoice::banded;
      SilentProgress progress;
      const Result<report::Report> report = compensate(job, progress);
      EXPECT_TRUE(report) << to_string(report.error());
      EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
      EXPECT_EQ(report->runs.fallback, 0U) << testing::complaints(*report);
      lines = lines_of(folder.output());
    }
    return lines;
  }

  // The violations found in the lines, one per line.
  std::string found_in(const Lines& lines) const {
    folder_.set_output(text_of(lines));
    SilentProgress progress;
    const Result<report::Report> report = verify(folder_.job(), progress);
    EXPECT_TRUE(report) << to_string(report.error());
    return report ? testing::complaints(*report) : "";
  }

  // Indices of the lines of the n-th compensated run.
  [[nodiscard]] std::vector<std::size_t> run(int n) const {
    std::vector<std::size_t> moves;
    for (std::size_t i = 0; i < good_.size(); ++i) {
      n -= good_[i] == ";unflex run\n" ? 1 : 0;
      if (n == -1 && good_[i].starts_with("G1 ") && (has(good_[i], 'X') || has(good_[i], 'Y'))) {
        moves.push_back(i);
      }
    }
    return moves;
  }
  // The first line after `from` that begins so.
  [[nodiscard]] std::size_t line_like(const std::string& beginning, std::size_t from = 0) const {
    for (std::size_t i = from; i < good_.size(); ++i) {
      if (good_[i].starts_with(beginning)) {
        return i;
      }
    }
    ADD_FAILURE() << beginning;
    return 0;
  }

  static std::string at(std::size_t index, const std::string& message) {
    return fmt::format("out.gcode:{}: {}", index + 1, message);
  }

  JobFolder folder_;
  const Lines& good_;
};

TEST_P(Emitted, IsFaultless) { EXPECT_EQ(found_in(good_), ""); }

TEST_P(Emitted, WithAVertexOutsideTheTravel) {
  const std::size_t i = run(0)[40];
  Lines bad = good_;
  bad[i] = with(bad[i], 'X', -0.5);
  EXPECT_THAT(found_in(bad), HasSubstr(at(i, "X-0.5000")));
  EXPECT_THAT(found_in(bad), HasSubstr("is out of the travel by 0.5000 mm"));
}

TEST_P(Emitted, WithoutTheLimitsRestored) {
  const std::size_t end = line_like(";unflex end");
  Lines bad = good_;
  // What stands between the run's end and the next line of the sliced file.
  const std::string wanted = GetParam() == Firmware::klipper  ? "SET_VELOCITY_LIMIT"
                             : GetParam() == Firmware::marlin ? "M204"
                                                              : "M201";
  const std::size_t restoring = line_like(wanted, end);
  bad.erase(bad.begin() + static_cast<std::ptrdiff_t>(restoring));
  EXPECT_THAT(found_in(bad), HasSubstr("limits not restored: "));
  EXPECT_THAT(found_in(bad), HasSubstr(at(line_like("G1 E-1 F1800") - 1, "")));
}

TEST_P(Emitted, WithoutTheShaperRestored) {
  const std::string wanted = GetParam() == Firmware::klipper ? "SET_INPUT_SHAPER" : "M593";
  Lines bad = good_;
  while (!bad.back().starts_with(wanted)) {
    bad.pop_back();
  }
  bad.pop_back();
  for (const std::string& line : good_) {
    if (line == "M104 S0\n" || line == "M84\n") {
      bad.push_back(line);
    }
  }
  // Everything that stood after it is there, except the shaper.
  EXPECT_THAT(found_in(bad), HasSubstr("the printer's input shaper is not restored"));
}

TEST_P(Emitted, WithTheShaperOnInARun) {
  const std::string wanted = GetParam() == Firmware::klipper ? "SET_INPUT_SHAPER" : "M593";
  Lines bad = good_;
  std::erase_if(bad, [&](const std::string& line) { return line.starts_with(wanted); });
  EXPECT_THAT(found_in(bad), HasSubstr("the printer's input shaper is on in a compensated run"));
}

TEST_P(Emitted, WithFilamentInATail) {
  const std::vector<std::size_t> moves = run(0);
  Lines bad = good_;
  double left_mm = 0.1;
  for (const std::size_t i : moves) {
    if (left_mm > 0.0 && has(bad[i], 'E') && value(bad[i], 'E') > 0.025) {
      const double taken_mm = std::min(left_mm, 0.02);
      bad[i] = with(bad[i], 'E', value(bad[i], 'E') - taken_mm);
      left_mm -= taken_mm;
    }
  }
  bad[moves.back()] += "G1 Y60.15 F300\nG1 Y60 E.1 F300\n";
  EXPECT_THAT(found_in(bad), HasSubstr("0.10000 mm of filament in the tail of a run"));
}

TEST_P(Emitted, WithMoreFilament) {
  const std::size_t i = run(0)[30];
  Lines bad = good_;
  bad[i] = with(bad[i], 'E', value(bad[i], 'E') + (GetParam() == Firmware::marlin ? 0.02 : 2e-4));
  EXPECT_THAT(found_in(bad), HasSubstr("mm of filament instead of"));
}

TEST_P(Emitted, WithAJumpIntoARun) {
  const std::size_t first = run(2).front();
  Lines bad = good_;
  bad[first] = with(bad[first], 'X', (has(bad[first], 'X') ? value(bad[first], 'X') : 80.0) + 0.5);
  EXPECT_THAT(found_in(bad), AnyOf(HasSubstr(at(first, "the base is 0.5")),
                                   HasSubstr(at(first, "in this run the nozzle strays more"))));
}

TEST_P(Emitted, WithARunBesideItsPlan) {
  Lines bad = good_;
  for (const std::size_t i : run(2)) {
    if (has(bad[i], 'X')) {
      bad[i] = with(bad[i], 'X', value(bad[i], 'X') + 0.6);
    }
  }
  EXPECT_THAT(found_in(bad), HasSubstr(" mm away from the sliced path"));
  EXPECT_THAT(found_in(bad), HasSubstr("state before this line: X is "));
}

TEST_P(Emitted, WithALineTooFast) {
  const std::size_t i = run(0)[50];
  Lines bad = good_;
  bad[i] = with(bad[i], 'F', 6.0 * value(bad[i], 'F'));
  EXPECT_THAT(found_in(bad),
              AnyOf(HasSubstr(at(i, "base velocity")), HasSubstr(at(i, "base acceleration")),
                    HasSubstr(at(i + 1, "base acceleration")), HasSubstr(at(i, "the base is ")),
                    HasSubstr("the nozzle strays more")));
}

TEST_P(Emitted, WithLinesAboveTheBudget) {
  // Splits every line of half a wall.
  const int count = GetParam() == Firmware::klipper ? 30 : 6;
  const std::vector<std::size_t> moves = run(0);
  Lines bad = good_;
  double from_x = 60.0;
  double from_y = 60.0;
  for (std::size_t n = 0; n < moves.size() / 2; ++n) {
    const std::string& line = good_[moves[n]];
    const double x = has(line, 'X') ? value(line, 'X') : from_x;
    const double y = has(line, 'Y') ? value(line, 'Y') : from_y;
    std::string parts;
    for (int part = 1; part <= count; ++part) {
      parts += fmt::format("G1 X{:.4f} Y{:.4f} F{:.3f}\n", from_x + (x - from_x) * part / count,
                           from_y + (y - from_y) * part / count, value(line, 'F'));
    }
    bad[moves[n]] = parts;
    from_x = x;
    from_y = y;
  }
  EXPECT_THAT(found_in(bad), HasSubstr("lines per second are more than"));
}

TEST_P(Emitted, WithANozzleThatStrays) {
  // A bump of 0.15 mm, too smooth to break any limit.
  const std::vector<std::size_t> moves = run(2);
  Lines bad = good_;
  const std::size_t first = moves.size() / 8;
  const std::size_t count = moves.size() / 8;
  double y = 80.0;
  for (std::size_t n = 0; n < first + count; ++n) {
    const std::string& line = good_[moves[n]];
    y = has(line, 'Y') ? value(line, 'Y') : y;
    if (n >= first) {
      const double s =
          std::sin(std::acos(-1.0) * static_cast<double>(n - first) / static_cast<double>(count));
      bad[moves[n]] = with(line, 'Y', y + 0.15 * s * s);
    }
  }
  EXPECT_THAT(found_in(bad), HasSubstr("the nozzle strays more than in the sliced file"));
}

// ---- edits by chance ---------------------------------------------------------------------------

struct At {
  double x = 0.0;
  double y = 0.0;
};

// Where the nozzle is, sample by sample, when the text is printed.
std::vector<At> nozzle_path(const Lines& lines, const machine::Settings& settings) {
  const verify::Rules rules = run::verify_rules(settings);
  gcode::Interpreter interpreter(rules.interpreter);
  const auto planner = planner::make_planner(rules.limits, rules.fixed);
  for (const std::string& line : lines) {
    const gcode::Event event = interpreter.interpret({line, 0});
    planner->apply(event);
    for (const gcode::Segment& segment : event.segments) {
      planner->add(segment);
    }
    if (event.kind == gcode::EventKind::barrier) {
      planner->stop();
    }
  }
  planner->stop();
  std::vector<planner::PlannedMove> moves;
  planner->take(moves);
  std::vector<At> path;
  dynamics::NozzleXY nozzle = run::at_rest({60.0, 60.0, 0.2, 0.0}, rules.nozzle);
  for (std::size_t i = 1; i < moves.size(); ++i) {
    const int steps = std::max(1, static_cast<int>(std::ceil(moves[i].duration_s() / 5e-4)));
    for (int step = 0; step < steps; ++step) {
      const double h = moves[i].duration_s() / steps;
      run::advance(moves[i], h * step, h * (step + 1), rules.nozzle, nozzle);
      path.push_back({nozzle.x.position(), nozzle.y.position()});
    }
  }
  return path;
}

// The largest distance of a point of `path` from the path `from`.
double distance_mm(const std::vector<At>& path, const std::vector<At>& from) {
  constexpr std::size_t kNear = 80;
  double largest = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = i < kNear ? 0 : i - kNear; k < std::min(from.size(), i + kNear); ++k) {
      least = std::min(least, std::hypot(path[i].x - from[k].x, path[i].y - from[k].y));
    }
    largest = std::max(largest, least);
  }
  return largest;
}

TEST_P(Emitted, WithVerticesMovedByChance) {
  // Edits the slow wall, where the nozzle strays little. The last lines are left out: there the
  // plan has ended, so there is no path to measure from, and a swing below kBearableSwing_mm
  // passes.
  const std::vector<std::size_t> moves = run(2);
  const machine::Settings settings = testing::settings(overrides(GetParam()));
  const std::vector<At> good_path = nozzle_path(good_, settings);
  std::mt19937_64 random(7);
  int counted = 0;
  for (int edit = 0; edit < 40; ++edit) {
    const std::size_t i =
        moves[std::uniform_int_distribution<std::size_t>(1, moves.size() - 6)(random)];
    const char axis = std::uniform_int_distribution<int>(0, 1)(random) == 0 ? 'X' : 'Y';
    if (!has(good_[i], axis)) {
      continue;
    }
    const double by = std::uniform_real_distribution<double>(-1.0, 1.0)(random);
    Lines bad = good_;
    bad[i] = with(bad[i], axis, value(bad[i], axis) + by);
    if (distance_mm(nozzle_path(bad, settings), good_path) > 0.05) {
      ++counted;
      EXPECT_NE(found_in(bad), "") << i + 1 << ": " << bad[i] << " by " << by;
    }
  }
  EXPECT_GT(counted, 8);
}

TEST_P(Emitted, WithFilamentChangedByChance) {
  std::mt19937_64 random(8);
  for (int edit = 0; edit < 20; ++edit) {
    const std::vector<std::size_t> moves = run(2 * (edit % 2));
    const std::size_t i =
        moves[std::uniform_int_distribution<std::size_t>(1, moves.size() - 1)(random)];
    const double least = GetParam() == Firmware::marlin ? 0.0125 : 1.1e-4;
    const double by = std::uniform_real_distribution<double>(least, 0.03)(random);
    Lines bad = good_;
    bad[i] = with(bad[i], 'E', (has(bad[i], 'E') ? value(bad[i], 'E') : 0.0) + by);
    EXPECT_NE(found_in(bad), "") << i + 1 << ": " << bad[i];
  }
}

TEST_P(Emitted, WithoutOneOfItsMCodes) {
  for (const std::string& code : lines_of(kPrint)) {
    if (code.starts_with("M")) {
      Lines bad = good_;
      bad.erase(std::ranges::find(bad, code));
      EXPECT_NE(found_in(bad), "") << code;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Emitted,
                         ::testing::Values(Firmware::klipper, Firmware::marlin, Firmware::rrf),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

}  // namespace
}  // namespace unflex::flow
