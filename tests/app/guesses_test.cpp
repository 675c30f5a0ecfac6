// Nothing is compensated by a guess, and what measures by one says so.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/program.hpp"

namespace unflex::app {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* kNothing = "[limits]\nmax_accel_mm_s2 = 4000\n";
constexpr const char* kOnlyX = "[limits]\nmax_accel_mm_s2 = 4000\n[dynamics.x]\nfreq_hz = 52\n";

class Guess : public ProgramTest {
 protected:
  Guess() { write_file(path("in.gcode"), small_print()); }

  void expect_refusal(const Outcome& outcome, const std::string& begin) {
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, StartsWith(begin));
    EXPECT_THAT(outcome.err, Not(HasSubstr("\n.")));
    EXPECT_FALSE(std::filesystem::exists(path("out.gcode")));
  }
};

TEST_F(Guess, IsNotCompensated) {
  expect_refusal(run_as_typed({"compensate", "in.gcode", "-o", "out.gcode"}),
                 "unflex: the resonance along X and Y is not given");
  write_file(path("p.toml"), kNothing);
  expect_refusal(run_as_typed({"compensate", "in.gcode", "-o", "out.gcode", "--printer", "p.toml"}),
                 "p.toml: the resonance along X and Y is not given");
  write_file(path("p.toml"), kOnlyX);
  const Outcome half =
      run_as_typed({"compensate", "in.gcode", "-o", "out.gcode", "--printer", "p.toml"});
  expect_refusal(half, "p.toml: the resonance along Y is not given, and 45 Hz is assumed");
  EXPECT_THAT(half.err, EndsWith("or give --set dynamics.y.freq_hz=...\n"));
  EXPECT_THAT(half.err, HasSubstr("unflex identify"));
  EXPECT_THAT(half.err, HasSubstr("unflex printer init"));
  EXPECT_EQ(run_as_typed({"compensate", "in.gcode", "-o", "out.gcode", "--printer", "p.toml",
                          "--set", "dynamics.y.freq_hz=45"})
                .exit_code,
            0);
}

TEST_F(Guess, LeavesThePrintThatItWouldReplace) {
  EXPECT_EQ(run_as_typed({"compensate", "in.gcode", "--in-place"}).exit_code, 1);
  EXPECT_EQ(read_file(path("in.gcode")), small_print());
}

TEST_F(Guess, IsSaidOnceByABatch) {
  std::filesystem::create_directory(path("in"));
  write_file(path("in/a.gcode"), small_print());
  write_file(path("in/b.gcode"), small_print());
  const Outcome outcome = run_as_typed({"batch", "in", "-o", "out"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, StartsWith("unflex: the resonance along X and Y is not given"));
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1);
  EXPECT_FALSE(std::filesystem::exists(path("out")));
}

// The settings have the same values, but nobody stands for them any more.
TEST_F(Guess, IsNotWhatABatchTakesForUnchanged) {
  std::filesystem::create_directory(path("in"));
  write_file(path("in/a.gcode"), "; gcode_flavor = marlin2\n" + small_print());
  const std::vector<std::string> batch = {"batch", "in", "-o", "out"};
  std::vector<std::string> told = batch;
  told.insert(told.end(), {"--set", "printer.firmware=klipper"});
  EXPECT_EQ(run(told).exit_code, 0);
  const Outcome again = run(batch);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr("in/a.gcode:1: sliced for marlin, but taken to be run by"));
}

TEST_F(Guess, OfTheFirmwareIsNotCompensated) {
  for (const char* comment : {"; gcode_flavor = marlin2\n", ";FLAVOR:Marlin\n"}) {
    write_file(path("in.gcode"), comment + small_print());
    const Outcome outcome = run({"compensate", "in.gcode", "-o", "out.gcode"});
    expect_refusal(outcome, "in.gcode:1: sliced for marlin, but taken to be run by klipper");
    EXPECT_THAT(outcome.err, HasSubstr("--set printer.firmware=marlin or klipper"));
  }
  write_file(path("in.gcode"), "; gcode_flavor = klipper\n" + small_print());
  EXPECT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode"}).exit_code, 0);
}

TEST_F(Guess, IsToldByAllThatMeasureByIt) {
  const std::string told = "unflex: warning: the resonance along X and Y is not given, and 45 Hz";
  ASSERT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode"}).exit_code, 0);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"verify", "out.gcode", "--against", "in.gcode"},
        std::vector<std::string>{"inspect", "in.gcode"},
        std::vector<std::string>{"study", "in.gcode"}}) {
    std::vector<std::string> to_json = words;
    to_json.insert(to_json.end(), {"--report", "r.json"});
    const Outcome outcome = run_as_typed(to_json);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(told)) << words[0];
    const auto report = nlohmann::json::parse(read_file(path("r.json")));
    ASSERT_FALSE(report["warnings"].empty()) << words[0];
    EXPECT_THAT(report["warnings"][0].get<std::string>(), StartsWith(told)) << words[0];
    if (words[0] != "inspect") {
      to_json.back() = "r.html";
      EXPECT_EQ(run_as_typed(to_json).exit_code, 0);
      EXPECT_THAT(read_file(path("r.html")), HasSubstr("the resonance along X and Y is not given"));
    }
  }
}

TEST_F(Guess, OfTheShaperIsNotMade) {
  const Outcome unknown = run({"compensate", "in.gcode", "-o", "out.gcode"});
  EXPECT_EQ(unknown.exit_code, 0) << unknown.err;
  EXPECT_THAT(unknown.out, HasSubstr("type SET_INPUT_SHAPER SHAPER_FREQ_X=... SHAPER_FREQ_Y=..."));
  const std::string text = read_file(path("out.gcode"));
  EXPECT_THAT(text, HasSubstr("\nSET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0\n"));
  EXPECT_THAT(text, Not(HasSubstr("SHAPER_FREQ_X=45")));
  EXPECT_THAT(text, EndsWith("SET_INPUT_SHAPER SHAPER_FREQ_X=... SHAPER_FREQ_Y=...\n"));

  const Outcome known =
      run({"compensate", "in.gcode", "-o", "out.gcode", "--set",
           "printer.input_shaper_freq_x_hz=63.4", "--set", "printer.input_shaper_freq_y_hz=0"});
  EXPECT_THAT(known.out, Not(HasSubstr("SET_INPUT_SHAPER")));
  EXPECT_THAT(read_file(path("out.gcode")),
              AllOf(HasSubstr("\nSET_INPUT_SHAPER SHAPER_FREQ_X=63.4\n"),
                    Not(HasSubstr("SHAPER_FREQ_Y=6")), Not(HasSubstr(";unflex: "))));
}

}  // namespace
}  // namespace unflex::app
