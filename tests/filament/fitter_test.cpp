#include "unflex/filament/fitter.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace unflex::filament {
namespace {

// A hollow filament of 1.75 mm outside.
constexpr double kHollow_mm2 = 2.177;
constexpr double kFactor = 1.104861;

FitterOptions hollow(Firmware firmware = Firmware::klipper) {
  FitterOptions options;
  options.interpreter = gcode::default_options(firmware);
  options.sliced_area_mm2 = area_of_diameter_mm2(1.75);
  options.profile = Profile(kHollow_mm2);
  return options;
}

struct Fitted {
  std::string text;
  Totals totals;
  std::vector<Diagnostic> warnings;
  std::string error;
};

Fitted fit(const std::string& text, FitterOptions options = hollow()) {
  std::istringstream stream(text);
  gcode::LineReader reader(stream, "in.gcode");
  Fitter fitter(std::move(options), "in.gcode");
  Fitted result;
  gcode::Line line;
  for (;;) {
    const Result<bool> more = reader.next(line);
    if (!more || !*more) {
      break;
    }
    if (const Status fitted = fitter.fit(line, result.text); !fitted) {
      result.error = to_string(fitted.error());
      break;
    }
  }
  result.totals = fitter.totals();
  result.warnings = fitter.warnings();
  return result;
}

// Filament by what a move is for, as the printer takes it from the text.
struct Filament {
  double printing_mm = 0.0;
  double drawn_back_mm = 0.0;
  double brought_forward_mm = 0.0;
  double material_mm3 = 0.0;  // of moves that print
};

Filament filament_of(const std::string& text, const FitterOptions& options) {
  double at_mm = options.start_mm;
  std::istringstream stream(text);
  gcode::LineReader reader(stream, "out.gcode");
  gcode::Interpreter interpreter(options.interpreter);
  Filament sum;
  gcode::Line line;
  for (;;) {
    const Result<bool> more = reader.next(line);
    if (!more || !*more) {
      return sum;
    }
    for (const gcode::Segment& segment : interpreter.interpret(line).segments) {
      const double e_mm = segment.delta(gcode::E);
      if (segment.extruding()) {
        sum.material_mm3 += options.profile.volume_mm3(at_mm, at_mm + e_mm);
      }
      at_mm += e_mm;
      (segment.extruding() ? sum.printing_mm
       : e_mm < 0.0        ? sum.drawn_back_mm
                           : sum.brought_forward_mm) += e_mm;
    }
  }
}

TEST(FilamentFitter, PushesMoreWhereTheSectionHoldsLess) {
  EXPECT_EQ(fit("M83\nG1 X10 E0.33260\n").text, "M83\nG1 X10 E0.36748\n");
  // 1 mm of a line of 0.45 × 0.2 mm with rounded ends.
  const Fitted line = fit("M83\nG1 X100 E3.38488\n");
  EXPECT_EQ(line.text, "M83\nG1 X100 E3.73982\n");
  EXPECT_NEAR(line.totals.fitted_mm / line.totals.sliced_mm, kFactor, 5e-6);
  EXPECT_NEAR(line.totals.material_mm3, 100.0 * 0.0814159, 1e-4);
  EXPECT_EQ(line.totals.changed_lines, 1U);
  EXPECT_NEAR(line.totals.most, kFactor, 1e-6);
  EXPECT_EQ(line.totals.most, line.totals.least);
}

TEST(FilamentFitter, LeavesLengthsOfFilamentAlone) {
  const std::string text =
      "M83\nG1 E-0.8 F2100\nG1 X5 Y5\nG1 E.8\nG1 X7 E-.3 ; wipe\nG10\nG11\nG1 E5 F300\n";
  EXPECT_EQ(fit(text).text, text);
  EXPECT_EQ(fit(text).totals.changed_lines, 0U);
}

TEST(FilamentFitter, KeepsAbsoluteFilamentGoing) {
  const Fitted fitted = fit(
      "M82\nG92 E0\nG1 X10 E1\nG1 X20 E2\nG1 E1.2\nG0 X30\nG1 E2\nG1 X40 E3\nG92 E0\nG1 X50 E1\n");
  EXPECT_EQ(fitted.text,
            "M82\nG92 E0\nG1 X10 E1.10486\nG1 X20 E2.20972\nG1 E1.40972\nG0 X30\nG1 E2.20972\n"
            "G1 X40 E3.31458\nG92 E0\nG1 X50 E1.10486\n");
}

TEST(FilamentFitter, KeepsAPlaceOfFilamentThatDoesNotMove) {
  EXPECT_EQ(fit("M82\nG92 E0\nG1 X10 E1\nG1 X10 E1 ; infill\nG1 F3000 E1\nG1 E0.5\n").text,
            "M82\nG92 E0\nG1 X10 E1.10486\nG1 X10 E1.10486 ; infill\nG1 F3000 E1.10486\n"
            "G1 E0.60486\n");
}

// RepRapFirmware multiplies by M221 what is laid, and not what is drawn back.
TEST(FilamentFitter, LeavesLengthsAloneWhateverTheFlow) {
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    EXPECT_EQ(fit("M83\nM221 S95\nG1 X10 E1\nG1 E-.8\nG1 E.8\nG1 X20 E1\n", hollow(firmware)).text,
              "M83\nM221 S95\nG1 X10 E1.10486\nG1 E-.8\nG1 E.8\nG1 X20 E1.10486\n");
    EXPECT_EQ(
        fit("M82\nM221 S95\nG92 E0\nG1 X10 E1\nG1 E.2\nG1 E1\nG1 X20 E2\n", hollow(firmware)).text,
        "M82\nM221 S95\nG92 E0\nG1 X10 E1.10486\nG1 E0.30486\nG1 E1.10486\n"
        "G1 X20 E2.20972\n");
  }
}

TEST(FilamentFitter, TellsThePrinterWhatTheFileTakesEToBeBeforeAMacro) {
  EXPECT_EQ(fit("M82\nG92 E0\nG1 X10 E1\nMY_MACRO\nG1 X20 E2\n").text,
            "M82\nG92 E0\nG1 X10 E1.10486\nG92 E1\nMY_MACRO\nG1 X20 E2.10486\n");
  EXPECT_EQ(fit("M82\nG92 E0\nG1 X10 E1\nSAVE_GCODE_STATE NAME=a\nG1 X20 E2\n"
                "RESTORE_GCODE_STATE NAME=a\nG1 X30 E2\n")
                .text,
            "M82\nG92 E0\nG1 X10 E1.10486\nG92 E1\nSAVE_GCODE_STATE NAME=a\nG1 X20 E2.10486\n"
            "G92 E2\nRESTORE_GCODE_STATE NAME=a\nG1 X30 E2.10486\n");
  // Differences need no reading, until they are read as places again.
  EXPECT_EQ(fit("M83\nG1 X10 E1\nMY_MACRO\nG1 X20 E1\nM82\nG1 X30 E3\n").text,
            "M83\nG1 X10 E1.10486\nMY_MACRO\nG1 X20 E1.10486\nG92 E2\nM82\nG1 X30 E3.10486\n");
  // Labels of objects do not change E.
  EXPECT_EQ(fit("M82\nG92 E0\nG1 X10 E1\nEXCLUDE_OBJECT_END NAME=a\nG1 X20 E2\n").text,
            "M82\nG92 E0\nG1 X10 E1.10486\nEXCLUDE_OBJECT_END NAME=a\nG1 X20 E2.20972\n");
}

TEST(FilamentFitter, KeepsWhatElseALineSays) {
  EXPECT_EQ(fit("M83\r\nG1X1.5Y2e1F1200;TYPE:E9 (E2)\r\n").text,
            "M83\r\nG1X1.5Y2e1.10486F1200;TYPE:E9 (E2)\r\n");
  // A line number and a checksum.
  EXPECT_EQ(fit("M83\nN2 G1 X1 E1*55\n", hollow(Firmware::marlin)).text,
            "M83\nN2 G1 X1 E1.10486*34\n");
}

TEST(FilamentFitter, LaysTheSlicedVolumeByTheText) {
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    for (const bool is_absolute : {false, true}) {
      std::mt19937 random(11);
      std::uniform_int_distribution<int> filament(1, 90000);
      std::string text = is_absolute ? "M82\nG92 E0\n" : "M83\n";
      double e = 0.0;
      const auto add = [&](const std::string& words, double e_mm) {
        e += e_mm;
        text += fmt::format("G1 {}E{:.5f}\n", words, is_absolute ? e : e_mm);
      };
      for (int i = 0; i < 3000; ++i) {
        add(fmt::format("X{} Y{} ", i % 7, i % 11), 1e-5 * filament(random));
        if (i % 50 == 0) {
          add("", -0.8);
          text += fmt::format("G0 X{}\n", i % 13 + 20);
          add("", 0.8);
        }
        if (is_absolute && i % 400 == 0) {
          text += "G92 E0\n";
          e = 0.0;
        }
      }
      FitterOptions options = hollow(firmware);
      std::istringstream table("mm,area_mm2\n0,2.1\n200,2.3\n400,2.0\n900,2.405\n");
      options.profile = *Profile::read(table, "spool.csv");
      options.start_mm = 30.0;
      const Fitted fitted = fit(text, options);
      ASSERT_EQ(fitted.error, "");
      const Filament before = filament_of(text, options);
      const Filament after = filament_of(fitted.text, options);
      EXPECT_NEAR(after.drawn_back_mm, before.drawn_back_mm, 1e-9);
      EXPECT_NEAR(after.brought_forward_mm, before.brought_forward_mm, 1e-9);
      EXPECT_NEAR(after.printing_mm, fitted.totals.fitted_mm, 1e-6);
      EXPECT_NEAR(after.material_mm3 / (before.printing_mm * options.sliced_area_mm2), 1.0, 1e-5);
      EXPECT_NEAR(after.material_mm3, fitted.totals.material_mm3, 1e-6);
      EXPECT_NEAR(fitted.totals.end_mm,
                  30.0 + after.printing_mm + after.drawn_back_mm + after.brought_forward_mm, 1e-6);
      EXPECT_LT(fitted.totals.least, fitted.totals.most);
    }
  }
}

TEST(FilamentFitter, TakesAVolumeForTheSectionThatThePrinterDividesBy) {
  // The printer makes 1 mm³ a length of 1/3.97 mm.
  const Fitted fitted = fit("M200 D2.25\nM83\nG1 X10 E1\n", hollow(Firmware::marlin));
  ASSERT_EQ(fitted.warnings.size(), 1U);
  EXPECT_EQ(fitted.warnings[0].place.line, 1U);
  EXPECT_EQ(fitted.text, "M200 D2.25\nM83\nG1 X10 E1.8264\n");
  EXPECT_NEAR(area_of_diameter_mm2(2.25) / kHollow_mm2, 1.8264, 5e-6);
}

TEST(FilamentFitter, SaysWhichFilamentItCannotFit) {
  const Fitted fitted = fit("M83\nG1 X1 (E3) E1\n", hollow(Firmware::rrf));
  EXPECT_EQ(fitted.text, "M83\nG1 X1 (E3) E1\n");
  ASSERT_EQ(fitted.warnings.size(), 1U);
  EXPECT_EQ(to_string(fitted.warnings[0]),
            "in.gcode:2: warning: this line's motion is not understood, so its E stays as sliced");
}

TEST(FilamentFitter, NamesALineThatKlipperWouldRefuse) {
  FitterOptions options = hollow();
  options.interpreter.max_extrude_ratio = 0.27;
  options.interpreter.max_extrude_dab_mm = 0.1;
  EXPECT_EQ(fit("M83\nG1 X10 E2.4\n", options).text, "M83\nG1 X10 E2.65167\n");
  EXPECT_EQ(fit("M83\nG1 X10 Y0 E2\nG1 X20 E2.6\n", options).error,
            "in.gcode:3: needs more filament than Klipper lets a move take; raise Klipper's "
            "max_extrude_cross_section, and extruder.max_extrude_cross_section_mm2");
}

TEST(FilamentFitter, RefusesWhatWasFittedBefore) {
  Fitter fitter(hollow(), "in.gcode");
  std::string text;
  ASSERT_TRUE(fitter.fit({"G1 X1 E1\n", 1}, text));
  const Fitted again = fit(text + fitter.mark());
  EXPECT_EQ(again.error.substr(0, 60),
            "in.gcode:2: says that the print was fitted to its filament b");
}

}  // namespace
}  // namespace unflex::filament
