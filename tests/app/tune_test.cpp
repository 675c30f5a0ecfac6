// Towers from the command line: what is written, what is read back, and what is refused.

#include <gmock/gmock.h>

#include "app/program.hpp"

namespace unflex::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kPrinter =
    "schema_version = 1\n"
    "[printer]\n"
    "firmware = \"klipper\"  # mine\n"
    "travel_x_mm = [0, 220]\n"
    "travel_y_mm = [0, 220]\n"
    "input_shaper_freq_x_hz = 0\n"
    "input_shaper_freq_y_hz = 0\n"
    "[dynamics.y]\n"
    "freq_hz = 50\n";

class Tune : public ProgramTest {
 protected:
  Tune() { write_file(path("p.toml"), kPrinter); }
};

TEST_F(Tune, WritesATowerReadsItAndWritesTheNext) {
  write_file(path("part.gcode"), small_print());
  const Outcome made = run_as_typed({"tune", "-o", "t1.gcode", "--printer", "p.toml", "--like",
                                     "part.gcode", "--report", "t1.html"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  // A slow machine takes more than a minute and is told how long it will take.
  EXPECT_THAT(made.err, ::testing::MatchesRegex("(unflex: compensating the tower.*\n)?"));
  EXPECT_THAT(made.out, AllOf(HasSubstr("x: bands 1 to 40 try frequencies 22 to 101.6 Hz\n"),
                              HasSubstr("--read x=FIRST..LAST --read y=FIRST..LAST --printer "
                                        "p.toml -o NEXT\n")));
  const std::string tower = read_file(path("t1.gcode"));
  EXPECT_THAT(tower, AllOf(HasSubstr("; unflex tune: start="), HasSubstr("; band 40 ends\n"),
                           HasSubstr(";unflex run\n")));
  EXPECT_THAT(read_file(path("t1.html")),
              AllOf(HasSubstr("data:image/bmp;base64,"), HasSubstr("--read y=FIRST..LAST")));

  const Outcome read = run_as_typed(
      {"tune", "t1.gcode", "--read", "x=19..22", "--printer", "p.toml", "-o", "t2.gcode"});
  ASSERT_EQ(read.exit_code, 0) << read.err;
  // 22 · 1.04¹⁸ and 22 · 1.04²¹ Hz, and what lies between them.
  EXPECT_THAT(read.out,
              AllOf(HasSubstr("x: 47.11 Hz ± 2.0 %"), HasSubstr("p.toml: written\n"),
                    HasSubstr("x: bands 1 to 35 try damping ratios"), HasSubstr("y: bands 1 to ")));
  EXPECT_THAT(read_file(path("p.toml")),
              AllOf(HasSubstr("firmware = \"klipper\"  # mine\n"), HasSubstr("freq_hz = 50\n"),
                    HasSubstr("[dynamics.x]\nfreq_hz = 47.10"), HasSubstr("by unflex tune\n")));
  // The next tower begins as the first did.
  EXPECT_THAT(read_file(path("t2.gcode")), HasSubstr("; unflex tune: start="));
}

// M201 of a stock Ender-3. The tower of another acceleration is compensated within its own limits.
TEST_F(Tune, RaisesTheLimitsOfASlowPrinterForItsTower) {
  write_file(path("slow.toml"),
             "schema_version = 1\n[printer]\nfirmware = \"marlin\"\ntravel_x_mm = [0, 220]\n"
             "travel_y_mm = [0, 220]\n[limits]\nmax_x_accel_mm_s2 = 500\nmax_y_accel_mm_s2 = 500\n"
             "print_accel_mm_s2 = 500\ntravel_accel_mm_s2 = 1000\n");
  const std::vector<std::string> slow = {"tune", "-o",        "t.gcode",  "--nozzle-temp",
                                         "210",  "--printer", "slow.toml"};
  const Outcome refused = run_as_typed(slow);
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("at 500 mm/s² no waves can be seen in the walls; the tower "
                                     "needs 750 mm/s²: give --accel 750"));
}

TEST_F(Tune, TellsTheLinesIfThereIsNoPrinterFile) {
  // The first lines of a tower are enough to read it.
  const std::string trial =
      " parameter=freq_hz bands=40 first=22 step=1.04 freq_hz=0 freq_error=0 damping_ratio=0.08 "
      "damping_error=0.07 rounds=0 wave_hz=70 wave_accel=2500 waves=1\n";
  write_file(path("t1.gcode"), "; unflex tune: axis=x" + trial + "; unflex tune: axis=y" + trial +
                                   "; unflex tune: center=110 110\n; unflex tune: start=G28\n");
  const Outcome read =
      run_as_typed({"tune", "t1.gcode", "--read", "x=19..22", "--set", "printer.firmware=klipper"});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_THAT(read.out, AllOf(HasSubstr("x: 47.11 Hz ± 2.0 %"),
                              HasSubstr("dynamics.x.freq_hz = 47.10"), Not(HasSubstr("y: "))));
  const Outcome wrong =
      run_as_typed({"tune", "t1.gcode", "--read", "x=19..42", "--set", "printer.firmware=klipper"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("the bands 1 to 40"));
}

TEST_F(Tune, RefusesWhatMakesNoSense) {
  write_file(path("part.gcode"), small_print());
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"tune"}, "where to write the tower?"},
      {{"tune", "-o", "t.gcode"}, "--like"},
      {{"tune", "part.gcode"}, "--read"},
      {{"tune", "--read", "x=1..2", "-o", "t.gcode"}, "give its file too"},
      {{"tune", "part.gcode", "--read", "z=1..2"}, "x=12..19"},
      {{"tune", "part.gcode", "--read", "x=1..b"}, "x=12..19"},
      {{"tune", "part.gcode", "--read", "x=2..3", "--printer", "p.toml"}, "is no tower"},
      {{"tune", "-o", "t.gcode", "--nozzle-temp", "210", "--report", "t.json"}, ".html"},
      {{"tune", "-o", "t.gcode", "--nozzle-temp", "210", "--printer", "p.toml", "--set",
        "printer.travel_x_mm=[0, 50]"},
       "the tower needs"},
      {{"tune", "-o", "t.gcode", "--nozzle-temp", "210", "--printer", "p.toml", "--set",
        "dynamics.x.mode=[{freq_hz = 40, damping_ratio = 0.05, gain = 0.6}, {freq_hz = 60, "
        "damping_ratio = 0.05, gain = 0.4}]"},
       "several modes"},
  };
  for (const auto& [arguments, message] : cases) {
    const Outcome outcome = run_as_typed(arguments);
    EXPECT_THAT(outcome.exit_code, ::testing::AnyOf(1, 2)) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(message));
    EXPECT_EQ(names(), (std::vector<std::string>{"p.toml", "part.gcode"}));
  }
  EXPECT_EQ(read_file(path("p.toml")), kPrinter);
}

}  // namespace
}  // namespace unflex::app
