// Inputs other than a proper sliced print. Each either passes through with its meaning kept, or
// causes a message of one line with its place and what to do. docs/cli.md has the table.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/program.hpp"

namespace unflex::app {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kStart = "G28\nG90\nM83\nG1 X100 Y100 Z0.2 F6000\n";
const std::string kGood =
    "G1 X104 E.2 F3600\nG1 Y104 E.2\nG1 E-1 F1800\nG1 X100 F9000\nG1 E1 F1800\n"
    "G1 Y100 E.2 F3600\n";

// Puts the lines into the middle of a print, from line 11 on.
std::string among(const std::string& lines) { return kStart + kGood + lines + "\n" + kGood; }

std::string utf16(const std::string& text) {
  std::string result = "\xff\xfe";
  for (const char c : text) {
    result += c;
    result += '\0';
  }
  return result;
}

std::string with_returns_alone(std::string text) {
  std::ranges::replace(text, '\n', '\r');
  return text;
}

std::string repeated(const std::string& line, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) {
    text += line;
  }
  return text;
}

// unflex's answer to a file: nothing, a warning, or an error, after which there is no output.
struct Answer {
  enum Kind { passes, warns, fails } kind = passes;
  std::string text;        // the message without the file's name
  bool unchanged = false;  // the lines warned of are in the output, unchanged
};

Answer passes() { return {}; }
Answer warns(std::string text) { return {Answer::warns, std::move(text), true}; }
// A warning about lines whose meaning both the printer and unflex know.
Answer remarks(std::string text) { return {Answer::warns, std::move(text), false}; }
Answer fails(std::string text) { return {Answer::fails, std::move(text)}; }

struct Bad {
  std::string name;
  std::string text;
  Answer klipper;
  Answer marlin;
  Answer rrf;
  std::vector<std::string> lines_kept;  // the output has these lines unchanged
  bool travel = false;                  // the settings give the printer's travel
};

void PrintTo(const Bad& bad, std::ostream* out) { *out << bad.name; }

Bad all(std::string name, std::string text, const Answer& answer,
        std::vector<std::string> lines_kept = {}) {
  return {std::move(name), std::move(text), answer, answer, answer, std::move(lines_kept), false};
}

// A bad line among good ones.
Bad line(std::string name, const std::string& text, const Answer& klipper, const Answer& marlin,
         const Answer& rrf) {
  return {std::move(name), among(text), klipper, marlin, rrf, {text + "\n"}, false};
}
Bad line(std::string name, const std::string& text, const Answer& answer) {
  return line(std::move(name), text, answer, answer, answer);
}

class BadInput : public ProgramTest, public ::testing::WithParamInterface<Bad> {
 protected:
  static std::vector<std::string> with_options(std::vector<std::string> arguments,
                                               const std::string& firmware) {
    std::vector<std::string> options = {"--quiet", "--set", "printer.firmware=" + firmware, "--set",
                                        "kinematics.type=cartesian"};
    // A known travel prevents the warning about an unknown one.
    if (GetParam().travel) {
      options.insert(options.end(), {"--set", "printer.travel_x_mm=[0, 250]", "--set",
                                     "printer.travel_y_mm=[0, 210]"});
    }
    arguments.insert(arguments.end(), options.begin(), options.end());
    return arguments;
  }

  static std::string lines_of(const std::string& err, auto&& chosen) {
    std::string result;
    for (std::size_t begin = 0; begin < err.size();) {
      const std::size_t end = err.find('\n', begin) + 1;
      const std::string text = err.substr(begin, end - begin);
      result += chosen(text) ? text : "";
      begin = end;
    }
    return result;
  }

  // The warnings about the file.
  static std::string about_file(const std::string& err) {
    return lines_of(err, [](const std::string& text) { return text.starts_with("in.gcode"); });
  }

  // The warnings that come from reading the file. inspect gives only these, because it compensates
  // nothing.
  static std::string from_reading(const std::string& about_file) {
    return lines_of(about_file, [](const std::string& text) {
      return text.find("of the extruded path is compensated") == std::string::npos;
    });
  }

  void expect_answer(const std::string& firmware, const Answer& answer) {
    SCOPED_TRACE(firmware);
    write_file(path("in.gcode"), GetParam().text);
    const Outcome inspected = run(with_options({"inspect", "in.gcode"}, firmware));
    const Outcome done = run(with_options(
        {"compensate", "in.gcode", "-o", "out.gcode", "--engine", "banded"}, firmware));
    EXPECT_EQ(read_file(path("in.gcode")), GetParam().text);
    const std::string said = about_file(done.err);
    EXPECT_EQ(about_file(inspected.err), from_reading(said));
    if (answer.kind == Answer::fails) {
      EXPECT_EQ(done.exit_code, 2);
      EXPECT_EQ(inspected.exit_code, 2);
      EXPECT_THAT(said, StartsWith("in.gcode" + answer.text));
      EXPECT_EQ(std::ranges::count(done.err, '\n'), 1) << done.err;
      EXPECT_FALSE(std::filesystem::exists(path("out.gcode")));
      return;
    }
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(inspected.exit_code, 0) << inspected.err;
    if (answer.kind == Answer::passes) {
      EXPECT_THAT(said, IsEmpty());
    } else {
      EXPECT_THAT(said, StartsWith("in.gcode" + answer.text));
    }
    const std::string output = read_file(path("out.gcode"));
    for (const std::string& kept : GetParam().lines_kept) {
      EXPECT_TRUE(!answer.unchanged || output.find(kept) != std::string::npos) << kept;
    }
    const Outcome verified =
        run(with_options({"verify", "out.gcode", "--against", "in.gcode"}, firmware));
    EXPECT_EQ(verified.exit_code, 0) << verified.err;
    std::filesystem::remove(path("out.gcode"));
    expect_strict(firmware, answer);
  }

  // With --strict a warning becomes an error, and nothing is written.
  void expect_strict(const std::string& firmware, const Answer& answer) {
    if (answer.kind != Answer::warns) {
      return;
    }
    const Outcome strict = run(with_options(
        {"compensate", "in.gcode", "-o", "out.gcode", "--strict", "--engine", "banded"}, firmware));
    EXPECT_EQ(strict.exit_code, 2);
    EXPECT_THAT(strict.err, Not(HasSubstr("warning")));
    EXPECT_EQ(names(), std::vector<std::string>{"in.gcode"});
  }
};

TEST_P(BadInput, IsKeptOrToldOf) {
  expect_answer("klipper", GetParam().klipper);
  expect_answer("marlin", GetParam().marlin);
  expect_answer("rrf", GetParam().rrf);
}

const Answer kNoNumber = warns(":11: warning: a motion word has no number: passed through");
const Answer kNoCentre = warns(":11: warning: an arc without a centre: passed through");
const Answer kTwice = warns(":11: warning: two commands in one line, or a word given twice");
const Answer kJoined = warns(":11: warning: letters without a number between them");
const Answer kExponent = warns(":11: warning: an E right behind a number");
const Answer kLowerCase = warns(":11: warning: lower case, which Marlin reads only if");
Answer cannot_read(const std::string& what) {
  return warns(":11: warning: cannot read '" + what + "': passed through unchanged");
}

INSTANTIATE_TEST_SUITE_P(
    Whole, BadInput,
    ::testing::Values(
        all("Empty", "", fails(": there is no G-code command in it; give a file as the slicer")),
        all("CommentsAlone", "; a\n; b\n", fails(": there is no G-code command in it")),
        all("Binary",
            std::string("\x7f"
                        "ELF\x02\x01\0\0\n\xff\n",
                        11),
            fails(":1: not a text file (NUL byte); pass G-code as plain text")),
        all("BytesAboveAscii", repeated("\x80\x9f\xc3\n", 50),
            fails(": there is no G-code command in it")),
        all("Utf16", utf16(among("G1 X1")), fails(":1: the text is UTF-16; save it as UTF-8")),
        all("NulByte", among(std::string("G1 X1\0 Y2", 9)), fails(":11: not a text file (NUL")),
        all("LineOfMoreThanAMegabyte", among("; " + std::string(1100000, 'x')),
            fails(":11: line longer than 1 MiB")),
        all("LineOfAlmostAMegabyte", among("; " + std::string(1000000, 'x')), passes(), {"; xxxx"}),
        all("MoveOfAlmostAMegabyte", among("G1 X101" + std::string(1000000, ' ') + "E.1"),
            passes()),
        all("ByteOrderMark", "\xef\xbb\xbf" + among("G4 P1"),
            warns(":1: warning: a byte order mark, which printers take for part of the command"),
            {"\xef\xbb\xbfG28\n"}),
        Bad{"ReturnsAlone",
            with_returns_alone(among("G4 P1")),
            warns(":1: warning: a carriage return without a line feed ends no line"),
            warns(":1: warning: a carriage return without a line feed, which ends the line for"),
            warns(":1: warning: a carriage return without a line feed ends no line"),
            {with_returns_alone(among("G4 P1"))}},
        all("NoLastLineEnd", kStart + kGood + "G1 X104 E.2", passes()),
        all("TruncatedInAWord", kStart + kGood + "G1 X104.1 E",
            warns(":11: warning: a motion word has no number"), {"\nG1 X104.1 E"}),
        all("TruncatedInACommand", kStart + kGood + "G", warns(":11: warning: 'G' without a num"),
            {"\nG"}),
        all("TruncatedToAnotherCommand", kStart + kGood + "M20", passes(), {"\nM20"}),
        all("MotionBeforeHoming", "G90\nM83\n" + kGood + kStart + kGood,
            warns(": warning: only 7.1 % of the extruded path is compensated (208 mm: start unk")),
        all("MovesOfLengthZero", kStart + kGood + repeated("G1 X100 Y100\n", 100000) + kGood,
            passes()),
        Bad{"OutOfTheTravel",
            among("G1 X500 E.2\nG1 X100 E.2"),
            warns(":11: warning: 1 move leaves the printer's travel of X0..250 Y0..210, "
                  "first in line 11, as far as X500: "),
            warns(":11: warning: 1 move leaves the printer's travel of X0..250 Y0..210, "
                  "first in line 11, as far as X500: "),
            warns(":11: warning: 1 move leaves the printer's travel of X0..250 Y0..210, "
                  "first in line 11, as far as X500: "),
            {},
            true}),
    [](const auto& tested) { return tested.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Number, BadInput,
    ::testing::Values(
        line("Missing", "G1 X E.2", kNoNumber), line("OfSpeedMissing", "G1 X104 F", kNoNumber),
        line("WithTwoPoints", "G1 X1.2.3 E.2", cannot_read("X1.2.3")),
        line("WithTwoSigns", "G1 X--4 E.2", cannot_read("X--4")),
        line("WithACommaInside", "G1 X102,5 E0,2", cannot_read(",5")),
        line("NaN", "G1 Xnan", kJoined, kLowerCase, kTwice),
        line("Infinity", "G1 Xinf E.2", kJoined, kLowerCase, kNoNumber),
        line("MinusInfinity", "G1 X-inf", cannot_read("X-inf")),
        // Klipper reads this as X1 E400.
        line("OfFourHundredDigits", "G1 X1e400",
             warns(":11: warning: 400 mm of filament in 99 mm of path"), kLowerCase, kExponent),
        line("OfCommandTooLarge", "G99999999999 X1", cannot_read("G99999999999")),
        line("BeyondAnyMachine", "G1 X9999999999 E.2",
             warns(":11: warning: the move leads further than any machine reaches")),
        line("OfSpeedZero", "G1 X102 E.1 F0",
             warns(":11: warning: F must be above zero, or Klipper refuses the line"), passes(),
             warns(":11: warning: F must be above zero, or the printer creeps")),
        line("OfSpeedNegative", "G1 X102 E.1 F-100",
             warns(":11: warning: F must be above zero, or Klipper refuses the line"), passes(),
             warns(":11: warning: F must be above zero, or the printer creeps")),
        line("OfSpeedNextToZero", "G1 X150 E.2 F0.0001", fails(":11: this move would take "),
             fails(":11: this move would take "), passes()),
        line("OfALifetime", "G1 X999999999", fails(":11: this move would take "))),
    [](const auto& tested) { return tested.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Arc, BadInput,
    ::testing::Values(
        line("WithoutCentre", "G2 X104 Y104 E.2", kNoCentre),
        line("AroundItsStart", "G2 X104 Y104 I0 J0", kNoCentre),
        line("OfRadiusZero", "G2 X104 Y104 R0 E.2",
             warns(":11: warning: an arc with R, which Klipper refuses"), kNoCentre, kNoCentre),
        line("OfTooSmallARadius", "G2 X110 Y110 R1 E.2",
             warns(":11: warning: an arc with R, which Klipper refuses"), passes(),
             warns(":11: warning: an arc whose radius is too small to reach its end")),
        line("ThatEndsOffItsCircle", "G2 X110 Y100 I1 J0 E.2",
             remarks(":11: warning: the arc's end is 8.00 mm off its circle")),
        line("InRelativeMode", "G91\nG2 X4 Y4 I4 J0 E.2\nG90\nM83",
             remarks(":12: warning: an arc in relative mode (G91), which Klipper refuses"),
             passes(), passes())),
    [](const auto& tested) { return tested.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Line, BadInput,
    ::testing::Values(
        line("WithAWordTwice", "G1 X101 X104 E.2",
             remarks(":11: warning: a word is given twice, and the last one counts"),
             remarks(":11: warning: a word is given twice, and the last one counts"), kTwice),
        line("OfTwoCommands", "G1 X102 E.1 M106 S255",
             remarks(":11: warning: the second command in the line counts for nothing"),
             remarks(":11: warning: the second command in the line counts for nothing"), kTwice),
        line("WithAWrongChecksum", "N3 G1 X102 E.1*99",
             warns(":11: warning: the checksum is 99 but should be 26")),
        line("WithNestedParentheses", "G1 X102 (a (b) c) E.1", cannot_read(")")),
        line("WithOpenParentheses", "G1 X102 (open E.1",
             warns(":11: warning: parentheses, which are no comment to Klipper"),
             warns(":11: warning: a comment in parentheses, which Marlin reads only if"),
             warns(":11: warning: parentheses, which are a comment to RepRapFirmware")),
        line("WithAnOpenQuote", "SET_X A=\"open", warns(":11: warning: a quote is not closed")),
        line("WithAnOpenQuoteInAText", "M117 \"open", passes()),
        line("OfATemplate", "G1 X{params.X} E.2", cannot_read("{params.X}"),
             cannot_read("{params.X}"), passes()),
        line("OfATemplatesLogic", "{% if printer.x %}", cannot_read("{%"), cannot_read("{%"),
             passes()),
        line("WithAnExpression", "G1 X{move.axes[0].max} E.2", cannot_read("{move.axes[0].max}"),
             cannot_read("{move.axes[0].max}"), passes()),
        line("ThatSetsAVariable", "set global.x = 3",
             warns(":11: warning: 'global.x' is not of the form KEY=VALUE"),
             warns(":11: warning: 'global.x' is not of the form KEY=VALUE"), passes()),
        line("ThatMovesTheZero", "G1 X102 E.1\nG92 X0 Y0\nG1 X2 E.1\nG92 X104 Y100", passes()),
        line("ThatFlipsModes", "G91\nG1 X1 E.05\nG90\nM82\nG92 E0\nG1 X102 E.1\nM83", passes()),
        line("WithAReturnInside", "G1 X101\rG1 X102",
             remarks(":11: warning: a carriage return without a line feed ends no line"),
             warns(":11: warning: a carriage return without a line feed, which ends the line"),
             warns(":11: warning: a carriage return without a line feed ends no line"))),
    [](const auto& tested) { return tested.param.name; });

class Strict : public ProgramTest {};

TEST_F(Strict, LetsAFlawlessPrintPass) {
  const std::vector<std::string> known = {"--quiet", "--strict",
                                          "--set",   "printer.travel_x_mm=[0, 250]",
                                          "--set",   "printer.travel_y_mm=[0, 210]",
                                          "--set",   "dynamics.x.freq_hz=45",
                                          "--set",   "dynamics.y.freq_hz=45",
                                          "--set",   "dynamics.x.damping_ratio=0.06",
                                          "--set",   "dynamics.y.damping_ratio=0.06"};
  write_file(path("in.gcode"), small_print());
  std::vector<std::string> arguments = {"compensate", "in.gcode", "-o", "out.gcode"};
  arguments.insert(arguments.end(), known.begin(), known.end());
  const Outcome done = run(arguments);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  arguments = {"verify", "out.gcode", "--against", "in.gcode"};
  arguments.insert(arguments.end(), known.begin(), known.end());
  EXPECT_EQ(run(arguments).exit_code, 0);
}

TEST_F(Strict, MakesErrorsOfInspectsWarnings) {
  write_file(path("in.gcode"), among("G1 X E.2"));
  const Outcome strict = run({"inspect", "in.gcode", "--strict", "--report", "r.json"});
  EXPECT_EQ(strict.exit_code, 2);
  EXPECT_EQ(strict.out, "");
  EXPECT_THAT(strict.err, HasSubstr("in.gcode:11: a motion word has no number"));
  EXPECT_THAT(strict.err, Not(HasSubstr("warning")));
  EXPECT_EQ(names(), std::vector<std::string>{"in.gcode"});
}

// A print that was sliced for a larger bed.
class OffTheBed : public ProgramTest {
 protected:
  OffTheBed() {
    write_file(path("in.gcode"),
               squares(5) + "G1 X1.1.2\nG1 X50.25 Y20 F3000\nG1 X20\nG1 Y-4 E0.1\nG1 E-1\n");
  }

  std::vector<std::string> with_travel(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--quiet", "--set", "printer.travel_x_mm=[0, 30]", "--set",
                                       "printer.travel_y_mm=[0, 30.5]"});
    return arguments;
  }

  const std::string about_ =
      "17 moves leave the printer's travel of X0..30 Y0..30.5, first in line 5, as far as X50.25 "
      "Y40: the printer refuses such moves or cuts them off; slice for this printer's bed, or "
      "correct printer.travel_x_mm and printer.travel_y_mm if they are wrong";
};

TEST_F(OffTheBed, BringsOneWarning) {
  for (const std::string workers : {"1", "3"}) {
    const Outcome done = run(with_travel(
        {"compensate", "in.gcode", "-o", "out.gcode", "--report", "r.json", "-j", workers}));
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_THAT(done.err, HasSubstr("in.gcode:5: warning: " + about_ + "\n"));
    const auto warnings = nlohmann::json::parse(read_file(path("r.json")))["warnings"];
    // In the order of the file's lines.
    EXPECT_EQ(warnings[0], "in.gcode:5: warning: " + about_) << warnings.dump();
    EXPECT_THAT(warnings[1], HasSubstr("'X1.1.2'"));
    EXPECT_EQ(std::ranges::count_if(warnings,
                                    [](const std::string& text) {
                                      return text.find("the printer's travel") != std::string::npos;
                                    }),
              1);
  }
  EXPECT_THAT(run(with_travel({"inspect", "in.gcode"})).err,
              HasSubstr("in.gcode:5: warning: " + about_ + "\n"));
}

TEST_F(OffTheBed, IsAnErrorWhenStrict) {
  const Outcome strict =
      run(with_travel({"compensate", "in.gcode", "-o", "out.gcode", "--strict"}));
  EXPECT_EQ(strict.exit_code, 2);
  EXPECT_THAT(strict.err, HasSubstr("in.gcode:5: " + about_ + "\n"));
  EXPECT_EQ(names(), std::vector<std::string>{"in.gcode"});
}

TEST_F(OffTheBed, IsToldThoughThereAreTooManyWarnings) {
  std::string lines;
  for (int i = 0; i < 1500; ++i) {
    lines += "G1 X1.1.2\n";
  }
  write_file(path("in.gcode"), among(lines + "G1 X110.002\nG1 X100"));
  const Outcome outcome =
      run({"inspect", "in.gcode", "--quiet", "--set", "printer.travel_x_mm=[0, 110]"});
  EXPECT_THAT(outcome.err,
              HasSubstr("in.gcode:1511: warning: 1 move leaves the printer's "
                        "travel of X0..110, first in line 1511, as far as X110.002: "));
  EXPECT_THAT(outcome.err, HasSubstr("in.gcode: warning: 500 more warnings are not listed\n"));
}

TEST_F(OffTheBed, IsMeasuredAgainstAKnownTravelOnly) {
  const Outcome outcome =
      run({"inspect", "in.gcode", "--quiet", "--set", "printer.travel_x_mm=[0, 30]"});
  EXPECT_THAT(outcome.err,
              HasSubstr("warning: 11 moves leave the printer's travel of X0..30, first "
                        "in line 5, as far as X50.25: "));
}

TEST_F(Strict, TellsOfAStreamThatItMustNotBePrinted) {
  write_file(path("in.gcode"), among("G1 X E.2"));
  const Outcome strict = run({"compensate", "in.gcode", "-o", "-", "--strict"});
  EXPECT_EQ(strict.exit_code, 2);
  EXPECT_THAT(strict.out, HasSubstr("G28"));
  EXPECT_THAT(strict.err, EndsWith("unflex: --strict lets none of this pass; what was passed on "
                                   "must not be printed\n"));
}

TEST_F(Strict, CountsWarningsItDoesNotKeep) {
  std::string lines;
  for (int i = 0; i < 1500; ++i) {
    lines += "G1 X1.1.2\n";
  }
  write_file(path("in.gcode"), among(lines));
  EXPECT_THAT(run({"inspect", "in.gcode"}).err,
              HasSubstr("in.gcode: warning: 500 more warnings are not listed\n"));
}

TEST_F(Strict, WarningsOfAKindAreShownThreeTimes) {
  std::string lines;
  for (int i = 0; i < 516; ++i) {
    lines += fmt::format("G1 X{}.1.2\n", i);
  }
  write_file(path("in.gcode"), among(lines));
  const Outcome outcome = run({"inspect", "in.gcode"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("in.gcode:13: warning: cannot read 'X2.1.2'"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("in.gcode:14: ")));
  EXPECT_THAT(outcome.err, HasSubstr("unflex: … and 513 more like it\n"));
}

}  // namespace
}  // namespace unflex::app
