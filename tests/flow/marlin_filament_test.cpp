// The filament that Marlin's extruder lays, counted in whole steps as its planner counts them.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;

constexpr double kStepsPerMm = 93.0;
constexpr int kSquares = 3;
constexpr double kFilamentPerMm = 0.0333;

// What planner.cpp makes of E: Planner::buffer_segment rounds the reading to whole steps, and
// _populate_block scales the difference by M221 and M200 and rounds it again. Shares no code with
// unflex's own interpreters.
class Extruder {
 public:
  void read(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      read_line(line.substr(0, line.find(';')));
    }
  }
  [[nodiscard]] double laid_mm() const { return static_cast<double>(laid_steps_) / kStepsPerMm; }

 private:
  void read_line(const std::string& line) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    double e = std::nan("");
    double s = std::nan("");
    double d = std::nan("");
    for (std::string word; words >> word;) {
      const double value = std::strtod(word.c_str() + 1, nullptr);
      (word[0] == 'E' ? e : word[0] == 'S' ? s : word[0] == 'D' ? d : unread_) = value;
    }
    if (command == "M82" || command == "M83") {
      relative_ = command == "M83";
    } else if (command == "M221") {
      flow_ = s / 100.0;
    } else if (command == "M200") {
      area_mm2_ = d > 0.0 ? std::numbers::pi * d * d / 4.0 : 1.0;
    } else if (command == "G92" && !std::isnan(e)) {
      reading_ = e;
      at_steps_ = std::lround(e * kStepsPerMm);
    } else if ((command == "G0" || command == "G1") && !std::isnan(e)) {
      reading_ = relative_ ? reading_ + e : e;
      const long to_steps = std::lround(reading_ * kStepsPerMm);
      const double steps = static_cast<double>(to_steps - at_steps_) * flow_ / area_mm2_;
      const auto whole = static_cast<long>(std::abs(steps) + 0.5);
      laid_steps_ += steps < 0.0 ? -whole : whole;
      at_steps_ = to_steps;
    }
  }

  bool relative_ = false;
  double flow_ = 1.0;
  double area_mm2_ = 1.0;  // of the filament, if E is a volume
  double reading_ = 0.0;
  double unread_ = 0.0;
  long at_steps_ = 0;
  long laid_steps_ = 0;
};

double laid_mm(const std::string& text) {
  Extruder extruder;
  extruder.read(text);
  return extruder.laid_mm();
}

// Three squares of 30 mm with a retraction between them. `e_per_mm`: E of a millimetre of path.
std::string squares(bool relative, double e_per_mm) {
  std::string text =
      fmt::format("G28\nG90\n{}\nG92 E0\nG1 X100 Y100 Z0.2 F6000\n", relative ? "M83" : "M82");
  double reading = 0.0;
  const auto e = [&](double change) {
    reading = relative ? change : reading + change;
    return fmt::format("E{:.5f}", reading);
  };
  for (int square = 0; square < kSquares; ++square) {
    const double x = 100.0 + 0.4 * square;
    text += fmt::format("G1 X{} Y100 F9000\nG1 {} F2400\nG1 F2400\n", x, e(0.8));
    for (const auto& [to_x, to_y] :
         std::vector<std::pair<double, double>>{{30, 0}, {30, 30}, {0, 30}, {0, 0}}) {
      text += fmt::format("G1 X{} Y{} {}\n", x + to_x, 100.0 + to_y, e(30.0 * e_per_mm));
    }
    text += fmt::format("G1 {} F2400\n", e(-0.8));
  }
  return text + "M84\n";
}

std::string compensated(const std::string& text) {
  const JobFolder folder(text, {"printer.firmware=marlin", "printer.e_steps_per_mm=93"});
  SilentProgress progress;
  const Result<report::Report> made = compensate(folder.job(), progress);
  EXPECT_TRUE(made) << to_string(made.error());
  EXPECT_TRUE(made && made->runs.compensated > 0U && made->runs.fallback == 0U);
  EXPECT_TRUE(made && made->violation_count == 0U) << testing::complaints(*made);
  return folder.output();
}

struct Scale {
  const char* line;
  double filament_per_e;
};

TEST(MarlinFilament, IsWhatTheFileAsksForWhateverScalesIt) {
  constexpr double kArea_mm2 = 2.405282;  // of filament of 1.75 mm
  constexpr double kAsked_mm = kSquares * 120.0 * kFilamentPerMm;
  for (const bool relative : {true, false}) {
    for (const Scale& scale :
         {Scale{"", 1.0}, Scale{"M221 S95\n", 0.95}, Scale{"M221 S108\n", 1.08},
          Scale{"M200 D1.75\n", 1.0 / kArea_mm2}}) {
      const bool is_volume = scale.filament_per_e < 0.5;
      const std::string text =
          scale.line + squares(relative, kFilamentPerMm / (is_volume ? scale.filament_per_e : 1.0));
      const double asked_mm = kAsked_mm * (is_volume ? 1.0 : scale.filament_per_e);
      // Rounding the sliced lines themselves makes a step or two.
      EXPECT_NEAR(laid_mm(compensated(text)), asked_mm, 3.0 / kStepsPerMm)
          << scale.line << (relative ? "relative" : "absolute");
    }
  }
}

// The factor that the file has set holds for its own lines, and for whatever comes after them.
TEST(MarlinFilament, IsScaledByTheFileOutsideOfRuns) {
  const std::string text = compensated("M221 S95\n" + squares(true, kFilamentPerMm));
  const std::size_t retraction = text.rfind("G1 E-0.8");
  ASSERT_NE(retraction, std::string::npos);
  EXPECT_EQ(text.substr(text.rfind("M221", retraction), 9), "M221 S95\n");
  EXPECT_EQ(text.rfind("M221 S100"), text.rfind("M221 S100", retraction));
}

}  // namespace
}  // namespace unflex::flow
