// From the words of the command line to a configuration.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unflex/app/run_config.hpp"

namespace unflex::app {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

RunConfig read(const std::vector<std::string>& arguments) {
  const Result<CommandLine> line = parse_command_line(arguments);
  EXPECT_TRUE(line) << to_string(line.error());
  return line && line->config ? *line->config : RunConfig{};
}

TEST(CommandLine, OfCompensateIsRead) {
  const RunConfig config =
      read({"compensate", "--set", "emit.period_ms=0.5", "in.gcode", "-o", "out.gcode", "--set",
            "printer.travel_x_mm=[0,250]", "--printer", "p.toml", "--report", "r.json",
            "--max-deviation", "1e-2", "-j", "3", "--quiet"});
  EXPECT_EQ(config.command, Command::compensate);
  EXPECT_EQ(config.input, "in.gcode");
  EXPECT_EQ(config.output, "out.gcode");
  EXPECT_FALSE(config.in_place);
  EXPECT_THAT(config.overrides, ElementsAre("emit.period_ms=0.5", "printer.travel_x_mm=[0,250]"));
  EXPECT_EQ(config.printer_file, "p.toml");
  EXPECT_EQ(config.report, "r.json");
  EXPECT_EQ(config.max_deviation_mm, 0.01);
  EXPECT_EQ(config.solve.workers, 3U);
  EXPECT_TRUE(config.quiet);
}

TEST(CommandLine, InPlaceMakesTheInputTheOutput) {
  const RunConfig config = read({"compensate", "--in-place", "in.gcode"});
  EXPECT_TRUE(config.in_place);
  EXPECT_EQ(config.output, "in.gcode");
  EXPECT_GE(config.solve.workers, 1U);
}

TEST(CommandLine, TakesDashesAsStreams) {
  const RunConfig config = read({"compensate", "-", "-o", "-"});
  EXPECT_EQ(config.input, "-");
  EXPECT_EQ(config.output, "-");
}

TEST(CommandLine, TakesNamesWithBracketsSpacesAndDashes) {
  EXPECT_EQ(read({"inspect", "[a, b].gcode"}).input, "[a, b].gcode");
  EXPECT_EQ(read({"inspect", "--", "-a.gcode"}).input, "-a.gcode");
  EXPECT_EQ(read({"compensate", "in", "-o", "{x}.gcode"}).output, "{x}.gcode");
}

TEST(CommandLine, OfVerifyKeepsTheTwoFilesApart) {
  const RunConfig config = read({"verify", "out.gcode", "--against", "in.gcode"});
  EXPECT_EQ(config.command, Command::verify);
  EXPECT_EQ(config.input, "in.gcode");
  EXPECT_EQ(config.output, "out.gcode");
}

TEST(CommandLine, OfInspectHasNoOutput) {
  const RunConfig config = read({"inspect", "in.gcode"});
  EXPECT_EQ(config.command, Command::inspect);
  EXPECT_EQ(config.output, "");
  EXPECT_FALSE(parse_command_line({"inspect", "in.gcode", "-o", "x"}));
}

TEST(CommandLine, HelpAndVersionAreTexts) {
  EXPECT_EQ(parse_command_line({"--version"})->text,
            std::string("unflex ") + std::string(version()) + "\n");
  EXPECT_THAT(parse_command_line({"--help"})->text, ::testing::HasSubstr("inspect"));
  EXPECT_THAT(parse_command_line({"verify", "--help"})->text, ::testing::HasSubstr("--against"));
}

// The message with which the command line is refused.
std::string refusal(const std::vector<std::string>& arguments) {
  const Result<CommandLine> line = parse_command_line(arguments);
  return line ? "no error" : line.error().message;
}

TEST(CommandLine, SuggestsTheOptionThatWasMeant) {
  EXPECT_EQ(refusal({"compensate", "x.gcode", "--ouput", "y"}),
            "unknown option '--ouput', did you mean '--output'? run 'unflex compensate --help'");
  EXPECT_EQ(refusal({"printer", "init", "--form=printer.cfg", "-o", "y"}),
            "unknown option '--form', did you mean '--from'? run 'unflex printer init --help'");
  // Not that --against is missing.
  EXPECT_THAT(refusal({"verify", "out.gcode", "--agianst", "in.gcode"}),
              HasSubstr("did you mean '--against'?"));
  EXPECT_EQ(refusal({"inspect", "x.gcode", "-Q"}),
            "unknown option '-Q'; run 'unflex inspect --help'");
  EXPECT_EQ(refusal({"--versoin"}),
            "unknown option '--versoin', did you mean '--version'? run 'unflex --help'");
  EXPECT_EQ(refusal({"inspect", "a", "--", "--strct"}),
            "the following argument was not expected: --strct; run 'unflex inspect --help'");
}

TEST(CommandLine, SaysHowAValueIsWritten) {
  EXPECT_EQ(refusal({"compensate", "--faster", "20", "in.gcode", "-o", "y"}),
            "--faster takes its tolerance behind an equals sign: --faster=20");
  EXPECT_EQ(refusal({"compensate", "in.gcode", "--faster", "12.5", "-o", "y"}),
            "--faster takes its tolerance behind an equals sign: --faster=12.5");
  EXPECT_EQ(refusal({"compensate", "--faster", "in.gcode", "-o", "y"}), "no error");
  EXPECT_EQ(refusal({"compensate", "in.gcode", "--output=", "--printer", "p.toml"}),
            "--output= has no value; write it right behind, as in --output=VALUE");
  EXPECT_THAT(refusal({"compensate", "in.gcode", "-o", "y", "--faster=0"}),
              HasSubstr("a tolerance above 0 µm is needed; without --faster the timing stays"));
}

TEST(CommandLine, SuggestsTheCommandThatWasMeant) {
  EXPECT_THAT(refusal({"compenstae", "x.gcode"}),
              StartsWith("unknown command 'compenstae', did you mean 'compensate'? there are "));
  EXPECT_THAT(refusal({"printer", "int"}),
              StartsWith("unknown command 'int', did you mean 'init'? there are init, "));
  EXPECT_THAT(refusal({"frobnicate"}), StartsWith("unknown command 'frobnicate'; there are "));
}

TEST(CommandLine, TellsWhatAnOptionTakes) {
  EXPECT_THAT(refusal({"compensate", "a", "-o", "b", "--engine", "1"}),
              StartsWith("--engine: '1' is none of auto, banded, ipopt;"));
  EXPECT_EQ(read({"compensate", "a", "-o", "b", "--engine", "ipopt"}).solve.engine,
            flow::EngineChoice::ipopt);
  EXPECT_TRUE(read({"compensate", "a", "-o", "b", "--check-solver"}).solve.check);
  EXPECT_THAT(refusal({"compensate", "a", "-o", "b", "--engine", "ipopt", "--check-solver"}),
              StartsWith("--check-solver: it is Ipopt that checks; leave out --engine ipopt"));
  EXPECT_EQ(read({"identify", "a.csv", "--axis", "Y"}).identify.axis, identify::Axis::y);
  for (const char* jobs : {"0", "257", "1.5", "many"}) {
    EXPECT_EQ(refusal({"compensate", "a", "-o", "b", "-j", jobs}),
              std::string("--jobs: '") + jobs +
                  "' is not a whole number from 1 to 256; run 'unflex compensate --help'");
  }
  EXPECT_EQ(read({"compensate", "a", "-o", "b", "-j", "256"}).solve.workers, 256U);
}

TEST(CommandLine, HelpHasNoNoiseOfTheLibrary) {
  const std::vector<std::vector<std::string>> commands = {{"compensate"},
                                                          {"batch"},
                                                          {"verify"},
                                                          {"inspect"},
                                                          {"study"},
                                                          {"tune"},
                                                          {"hotend"},
                                                          {"identify"},
                                                          {"printer", "init"},
                                                          {"printer"},
                                                          {},
                                                          {"printer", "macros"},
                                                          {"printer", "line-test"}};
  for (std::vector<std::string> command : commands) {
    command.emplace_back("--help");
    const std::string help = parse_command_line(command)->text;
    for (const char* noise : {"{", "->", " in [", "UINT", "FLOAT", "TEXT", "ENUM"}) {
      EXPECT_THAT(help, Not(HasSubstr(noise)));
    }
  }
  const std::string help = parse_command_line({"compensate", "--help"})->text;
  EXPECT_THAT(help, HasSubstr("--engine auto|banded|ipopt  What solves"));
  EXPECT_THAT(help, HasSubstr("1 to 256"));
}

TEST(CommandLine, OffersAPageWhereThereIsOne) {
  EXPECT_THAT(parse_command_line({"verify", "--help"})->text, HasSubstr("FILE.html"));
  const std::string of_inspect = parse_command_line({"inspect", "--help"})->text;
  EXPECT_THAT(of_inspect, HasSubstr("FILE.json"));
  EXPECT_THAT(of_inspect, Not(HasSubstr("html")));
}

TEST(CommandLine, TakesAnEndingForTheNameOfAReportWhereItStandsForOne) {
  EXPECT_EQ(read({"compensate", "in.gcode", "-o", "out.gcode", "--report", ".json"}).report,
            ".json");
  const std::vector<std::string> verify = {"verify", "out.gcode", "--against", "in.gcode",
                                           "--report"};
  const std::vector<std::string> inspect = {"inspect", "in.gcode", "--report"};
  const std::vector<std::string> study = {"study", "--report"};
  const std::vector<std::string> identify = {"identify", "a.csv", "--report"};
  const std::vector<std::string> hotend = {"hotend", "a.csv", "--report"};
  const std::vector<std::string> batch = {"batch", "prints", "-o", "made", "--summary"};
  for (std::vector<std::string> arguments : {verify, inspect, study, identify, hotend, batch}) {
    arguments.emplace_back(".json");
    EXPECT_THAT(refusal(arguments),
                EndsWith(" .json: is an ending without a name; give it one, as report.json"));
    arguments.back() = "folder/.json";
    EXPECT_EQ(refusal(arguments), "no error");
  }
  for (std::vector<std::string> arguments : {verify, study, identify, hotend}) {
    arguments.emplace_back(".html");
    EXPECT_THAT(refusal(arguments), EndsWith("as report.html"));
  }
}

}  // namespace
}  // namespace unflex::app
