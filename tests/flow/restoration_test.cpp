// Wherever the printer can leave a compensated run, its own limits and its input shaper hold again.
//
// These tests have their own reader, which knows only which word of which command sets what. It
// shares nothing with unflex's own reading of its output.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;

// The values in force; the key is the command and word that sets each.
using Regime = std::map<std::string, std::string>;

// The regime of a printer while it reads a text.
class Reader {
 public:
  Reader(Firmware firmware, Regime regime) : firmware_(firmware), regime_(std::move(regime)) {}

  void read(std::string line) {
    line = line.substr(0, line.find(';'));
    std::istringstream stream(line);
    std::string command;
    stream >> command;
    std::vector<std::string> words;
    for (std::string word; stream >> word;) {
      words.push_back(word);
    }
    if (firmware_ == Firmware::klipper) {
      klipper(command, words);
    } else if (command == "M201" || command == "M203") {
      set(command, words);
    } else if (command == "M204") {
      for (const std::string& word : words) {
        for (const char kind : word[0] == 'S' ? std::string("PT") : word.substr(0, 1)) {
          regime_[fmt::format("M204 {}", kind)] = number(word.substr(1));
        }
      }
    } else if (command == "M205" && firmware_ == Firmware::marlin) {
      set(command, words);
    } else if (command == "M566") {
      set(command, words);
    } else if (command == "M205") {
      for (const std::string& word : words) {
        regime_["M566 " + word.substr(0, 1)] = number(word.substr(1), 60.0);
      }
    } else if (command == "M593") {
      firmware_ == Firmware::marlin ? marlin_shaper(words) : rrf_shaper(words);
    } else if (command == "M900" || command == "M572") {
      set(command, words);
    }
  }

  // The regime without the frequency of a shaper that is off, which does not matter.
  [[nodiscard]] Regime regime() const {
    Regime result = regime_;
    if (result["M593 P"] == "\"none\"") {
      result.erase("M593 F");
    }
    return result;
  }

 private:
  static std::string number(const std::string& text, double factor = 1.0) {
    return fmt::format("{:.9g}", std::stod(text) * factor);
  }

  void set(const std::string& command, const std::vector<std::string>& words) {
    for (const std::string& word : words) {
      regime_[command + " " + word[0]] = number(word.substr(1));
    }
  }

  void klipper(const std::string& command, const std::vector<std::string>& words) {
    if (command == "SET_VELOCITY_LIMIT" || command == "SET_INPUT_SHAPER" ||
        command == "SET_PRESSURE_ADVANCE") {
      for (const std::string& word : words) {
        const std::size_t equals = word.find('=');
        const std::string value = word.substr(equals + 1);
        regime_[word.substr(0, equals)] = std::isdigit(value[0]) ? number(value) : value;
      }
    } else if (command == "M204") {
      regime_["ACCEL"] = number(words.at(0).substr(1));
    }
  }

  void marlin_shaper(const std::vector<std::string>& words) {
    const bool one = words.at(0) == "X" || words.at(0) == "Y";
    for (const std::string axis : {"X", "Y"}) {
      for (const std::string& word : words) {
        if ((!one || words[0] == axis) && word.size() > 1) {
          regime_["M593 " + axis + word[0]] = number(word.substr(1));
        }
      }
    }
  }

  void rrf_shaper(const std::vector<std::string>& words) {
    bool typed = false;
    for (const std::string& word : words) {
      typed = typed || word[0] == 'P';
      regime_[std::string("M593 ") + word[0]] =
          word[0] == 'P' ? word.substr(1) : number(word.substr(1));
    }
    if (!typed && regime_["M593 P"] == "\"none\"") {
      regime_["M593 P"] = "\"zvd\"";
    }
  }

  Firmware firmware_;
  Regime regime_;
};

constexpr std::string_view kPoint = ";point ";

// At these points the machine only stands still. Its shaper and its pressure advance may stay as in
// a run, because each switch is a stop.
bool stays_where_it_is(const std::string& point) {
  return point.starts_with("EXCLUDE_OBJECT_") || point.starts_with("M486") ||
         point.starts_with(";printing object") || point.starts_with(";stop printing object");
}

bool is_of_shaper(const std::string& word) {
  return word.starts_with("SHAPER_") || word.starts_with("M593");
}

bool is_of_pressure(const std::string& word) {
  return word == "ADVANCE" || word == "SMOOTH_TIME" || word.starts_with("M900") ||
         word.starts_with("M572");
}

bool shaper_is_off(const Regime& regime) {
  for (const char* word : {"SHAPER_FREQ_X", "SHAPER_FREQ_Y", "M593 XF", "M593 YF"}) {
    const auto found = regime.find(word);
    if (found != regime.end() && found->second != "0") {
      return false;
    }
  }
  const auto type = regime.find("M593 P");
  return type == regime.end() || type->second.empty() || type->second == "\"none\"";
}

// The regime before each marked point, and at the end.
std::vector<std::pair<std::string, Regime>> regimes(const std::string& text, Reader reader) {
  std::vector<std::pair<std::string, Regime>> result;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (line.find(kPoint) != std::string::npos) {
      result.emplace_back(line, reader.regime());
    }
    reader.read(line);
  }
  result.emplace_back("end of file", reader.regime());
  return result;
}

struct Printer {
  std::string name;
  Firmware firmware = Firmware::klipper;
  Regime own;  // the regime when the print begins
  std::vector<std::string> settings;
  std::vector<std::string> points;   // lines at which the print may leave its run
  std::vector<std::string> changes;  // changes of limits and shaper, as slicers write them
};

void PrintTo(const Printer& printer, std::ostream* out) { *out << printer.name; }

// Blocks of moves, each with a point between two extruding moves, and changes before the run, in
// it, and before and after the point. Every second block does not name Z, so after a point that
// lost the position, nothing of the block can be rewritten.
std::string print_of(const Printer& printer) {
  std::string text = "G28\nG90\nM83\nM220 S100\n";
  std::size_t next = 0;
  const auto change = [&] { return printer.changes[next++ % printer.changes.size()] + "\n"; };
  for (std::size_t i = 0; i < printer.points.size(); ++i) {
    const double x = 100.0 + static_cast<double>(i);
    text += i % 4 == 3 ? "" : change();
    text += fmt::format("G1 X{} Y100 Z0.2 F6000\nG1 X{} E.1 F4000\n", x, x + 3);
    text += i % 3 == 0 ? change() : "";
    text += "G1 Y103 E.1\n";
    text += i % 3 == 1 || i % 5 == 0 ? change() : "";
    text += fmt::format("{}{}{}\n", printer.points[i], kPoint, i);
    text += i % 3 == 2 ? change() : "";
    text += fmt::format("G1 X{} Y103{} E.1\nG1 Y100 E.1\n", x, i % 2 == 0 ? " Z0.2" : "");
    text += change();
    text += fmt::format("G1 X{} Y101 E.1\n", x + 3);
  }
  return text;
}

class Restoration : public ::testing::TestWithParam<Printer> {
 protected:
  static void expect_restored(const Printer& printer, const std::string& input) {
    const JobFolder folder(input, printer.settings);
    SilentProgress progress;
    const Result<report::Report> report = compensate(folder.job(), progress);
    ASSERT_TRUE(report) << to_string(report.error());
    EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
    // Some of such short runs are no better compensated, and are kept.
    EXPECT_GE(2 * report->runs.compensated, report->runs.total) << testing::complaints(*report);
    EXPECT_NEAR(report->measured.compensated.extrusion_mm,
                report->measured.uncompensated.extrusion_mm, 1e-3);
    const Reader reader(printer.firmware, printer.own);
    const auto wanted = regimes(input, reader);
    const std::string output = folder.output();
    const auto found = regimes(output, reader);
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      EXPECT_EQ(found[i].first, wanted[i].first);
      Regime have = found[i].second;
      Regime want = wanted[i].second;
      if (stays_where_it_is(found[i].first)) {
        const bool is_off = shaper_is_off(have);
        const auto may_stay = [&](const auto& word) {
          return is_of_pressure(word.first) || (is_off && is_of_shaper(word.first));
        };
        std::erase_if(have, may_stay);
        std::erase_if(want, may_stay);
      }
      EXPECT_EQ(have, want) << "before " << wanted[i].first;
    }
    expect_no_point_in_a_run(output);
  }

  static void expect_no_point_in_a_run(const std::string& output) {
    bool in_run = false;
    std::istringstream stream(output);
    for (std::string line; std::getline(stream, line);) {
      in_run = line == ";unflex run" || (in_run && line != ";unflex end");
      EXPECT_FALSE(in_run && line.find(kPoint) != std::string::npos) << line;
      // RepRapFirmware's M220 and M221 treat filament alone differently from filament that is laid,
      // and a line of filament alone would stop the machine.
      EXPECT_FALSE(in_run && line.starts_with("G1 E")) << line;
    }
    EXPECT_FALSE(in_run);
  }
};

TEST_P(Restoration, HoldsAtEachPointAtWhichThePrinterMayLeaveTheRun) {
  expect_restored(GetParam(), print_of(GetParam()));
}

// The file sets no limits, so the configured ones are restored.
TEST_P(Restoration, HoldsWhereTheFileSetsNothing) {
  Printer printer = GetParam();
  printer.changes = {"M117 nothing"};
  for (std::size_t i = printer.points.size(); i-- > 0;) {
    if (i % 4 != 0) {
      printer.points.erase(printer.points.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  expect_restored(printer, print_of(printer));
}

TEST_P(Restoration, HoldsAtTheEndOfAFileThatEndsInARun) {
  const Printer& printer = GetParam();
  std::string input = "G90\nM83\nG1 X100 Y100 Z0.2 F6000\nG1 X103 E.1\n";
  for (const std::string& change : printer.changes) {
    input += change + "\nG1 X103 Y103 E.1\nG1 X103 Y100 E.1\n";
  }
  expect_restored(printer, input + "G1 Y103 E.1");
  expect_restored(printer, input + "G1 Y103 E.1\n" + printer.changes.front());
}

// One change at a time, because each may hide what another does.
TEST_P(Restoration, HoldsAfterEachChangeAlone) {
  const Printer& printer = GetParam();
  for (const std::string& change : printer.changes) {
    expect_restored(printer,
                    fmt::format("G90\nM83\nG1 X100 Y100 Z0.2 F6000\nG1 X103 E.1\n{}\nG1 Y103 E.1\n"
                                "{}{}0\nG1 X100 Y103 Z0.2 E.1\nG1 X100 Y100 E.1\n",
                                change, printer.points.front(), kPoint));
  }
}

const Printer kKlipper = {
    .name = "Klipper",
    .firmware = Firmware::klipper,
    .own = {{"VELOCITY", "300"},
            {"ACCEL", "5000"},
            {"SQUARE_CORNER_VELOCITY", "5"},
            {"MINIMUM_CRUISE_RATIO", "0.5"},
            {"ACCEL_TO_DECEL", "2500"},
            {"SHAPER_FREQ_X", "45"},
            {"SHAPER_FREQ_Y", "45"},
            {"SMOOTH_TIME", "0.04"}},
    .settings = {},
    .points = {"PAUSE",
               "M0",
               "M1",
               "M25",
               "M226",
               "M600",
               "M601",
               "T0",
               "T1",
               "T0",
               "EXCLUDE_OBJECT_START NAME=a",
               "EXCLUDE_OBJECT_END NAME=a",
               "EXCLUDE_OBJECT_START NAME=b",
               "EXCLUDE_OBJECT_END NAME=b",
               "M486 S1",
               "M486 S-1",
               "SOME_MACRO",
               "SOME_MACRO SPEED=100",
               "_TIMELAPSE_NEW_FRAME",
               "CANCEL_PRINT",
               "PRINT_END",
               "G28",
               "G29",
               "M84",
               "M999",
               "@pause",
               "RESTORE_GCODE_STATE NAME=none MOVE=1",
               "SET_GCODE_OFFSET Z=0.1 MOVE=1",
               "SDCARD_RESET_FILE",
               "ACTIVATE_EXTRUDER EXTRUDER=extruder1"},
    .changes = {"M204 S1500", "SET_VELOCITY_LIMIT ACCEL=2500 SQUARE_CORNER_VELOCITY=6",
                "SET_VELOCITY_LIMIT VELOCITY=200", "M204 P1000 T1000",
                "SET_VELOCITY_LIMIT MINIMUM_CRUISE_RATIO=0.2",
                "SET_VELOCITY_LIMIT ACCEL=3000 ACCEL_TO_DECEL=1200",
                "SET_VELOCITY_LIMIT ACCEL=4000", "SET_INPUT_SHAPER SHAPER_FREQ_X=50",
                "SET_INPUT_SHAPER SHAPER_TYPE_Y=ei",
                "SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=33",
                "SET_PRESSURE_ADVANCE ADVANCE=0.03", "SET_PRESSURE_ADVANCE ADVANCE=0.05",
                "SET_INPUT_SHAPER SHAPER_FREQ_X=41.5 SHAPER_TYPE=mzv"}};

const Regime kMarlinLimits = {
    {"M201 X", "5000"}, {"M201 Y", "5000"}, {"M201 Z", "100"},   {"M201 E", "10000"},
    {"M203 X", "300"},  {"M203 Y", "300"},  {"M203 Z", "5"},     {"M203 E", "25"},
    {"M204 P", "5000"}, {"M204 R", "5000"}, {"M204 T", "5000"},  {"M205 J", "0.013"},
    {"M205 S", "0"},    {"M205 T", "0"},    {"M205 B", "20000"}, {"M593 XF", "40"},
    {"M593 YF", "38"},
};

const std::vector<std::string> kMarlinPoints = {
    "M0",     "M1 S5",  "M25",   "M24",     "M125",    "M226 P3",  "M600",    "M601",
    "M701",   "T0",     "T1",    "T0",      "M486 S0", "M486 S-1", "M486 P1", "SOME_MACRO",
    "@pause", "M999",   "M524",  "M808 L2", "G28",     "G29",      "G12",     "G27",
    "M84",    "M900.1", "G92.1", "PAUSE",   "M7000",   "M112",     "M402",    "G1 U3"};

const Printer kMarlin = {
    .name = "Marlin",
    .firmware = Firmware::marlin,
    .own = kMarlinLimits,
    // On moves of 3 mm with jerk a motor needs that much to do better than the sliced file.
    .settings = {"printer.firmware=marlin", "printer.input_shaper_freq_x_hz=40",
                 "printer.input_shaper_freq_y_hz=38", "base.max_accel_mm_s2=20000"},
    .points = kMarlinPoints,
    .changes = {"M204 S1500", "M204 P800 T1200 R900", "M201 X2000 Y1800", "M201 Z150 E4000",
                "M203 X150 Y140 Z8 E20", "M205 J0.02", "M205 S0.5 T1 B10000", "M205 X8 Y7",
                "M900 K0.05", "M593 F35", "M593 X F0", "M593 Y F31 D0.1", "M593 X F44", "M900 K0"}};

Printer classic_marlin() {
  Printer printer = kMarlin;
  printer.name = "MarlinWithJerk";
  printer.settings.emplace_back("printer.classic_jerk=true");
  printer.own.insert({{"M205 X", "10"}, {"M205 Y", "10"}, {"M205 Z", "0.3"}, {"M205 E", "5"}});
  printer.changes = {"M205 X8 Y7", "M205 Z0.4 E4", "M204 S1500", "M205 X12"};
  return printer;
}

const Printer kRrf = {
    .name = "RepRapFirmware",
    .firmware = Firmware::rrf,
    .own = {{"M201 X", "5000"},
            {"M201 Y", "5000"},
            {"M201 Z", "200"},
            {"M201 E", "500"},
            {"M203 X", "18000"},
            {"M203 Y", "18000"},
            {"M203 Z", "1200"},
            {"M203 E", "6000"},
            {"M203 I", "30"},
            {"M204 P", "50000"},
            {"M204 T", "50000"},
            {"M566 X", "900"},
            {"M566 Y", "900"},
            {"M566 Z", "600"},
            {"M566 E", "300"},
            {"M566 P", "0"},
            {"M593 P", "\"mzv\""},
            {"M593 F", "40"}},
    .settings = {"printer.firmware=rrf", "printer.input_shaper_freq_x_hz=40",
                 "printer.input_shaper_type=mzv"},
    .points = {"M0",
               "M1",
               "M25",
               "M24",
               "M226",
               "M600",
               "M601",
               "T0",
               "T1",
               "T0 P0",
               "T-1",
               "M486 S0",
               "M486 S-1",
               ";printing object a",
               ";stop printing object a",
               "M98 P\"macro.g\"",
               "M291 P\"wait\" S3",
               "M7000",
               "SOME_MACRO",
               "@pause",
               "M999",
               "G28",
               "G29",
               "G32",
               "M84",
               "M582 T1",
               "M112",
               "if job.layer = 2",
               "abort \"no\"",
               "G1 H1 X5",
               "M701 S\"pla\""},
    .changes = {"M204 P1500 T2500", "M204 S1800", "M201 X2000 Y1800", "M201 Z150 E400",
                "M203 X9000 Y8400 Z600 E3000", "M203 I24", "M566 X480 Y420", "M566 Z30 E240 P1",
                "M205 X9 Y8", "M566 P0", "M572 D0 S0.05", "M593 L0.2", "M593 F35", "M593 P\"none\"",
                "M593 P\"ei2\" F31 S0.1", "M593 P\"zvdd\"", "M572 D0 S0"}};

INSTANTIATE_TEST_SUITE_P(Of, Restoration,
                         ::testing::Values(kKlipper, kMarlin, classic_marlin(), kRrf),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace unflex::flow
