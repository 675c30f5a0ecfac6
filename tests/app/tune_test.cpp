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

// A tower for the pressure is read into the printer file, and the next one is written.
TEST_F(Tune, ReadsAPressureTowerAndWritesTheNext) {
  write_file(path("p.toml"), std::string(kPrinter) + "[dynamics.x]\nfreq_hz = 45\n");
  // The first lines of a tower are enough to read it. So small a sum leaves few dead times to try.
  write_file(path("t1.gcode"),
             "; unflex tune: pressure parameter=sum bands=11 first=0.005 step=0.0002 sum=0.006 "
             "sum_error=0.001 dead_time=0.004 dead_time_error=0.005 rounds=1\n"
             "; unflex tune: center=110 110\n; unflex tune: start=G28\n");
  const Outcome read = run_as_typed({"tune", "t1.gcode", "--read", "pressure=5..7", "--printer",
                                     "p.toml", "-o", "t2.gcode", "--report", "t2.html"});
  ASSERT_EQ(read.exit_code, 0) << read.err;
  EXPECT_THAT(read.out,
              AllOf(HasSubstr("pressure advance 0.0020 s, dead time 4.0 ms; their sum 0.0060 s"),
                    HasSubstr("bands 1 to 15 try dead times -2 to 5 ms\n"),
                    HasSubstr("unflex tune t2.gcode --read pressure=FIRST..LAST --printer p.toml "
                              "-o NEXT\n"),
                    HasSubstr("p.toml: written\n")));
  EXPECT_THAT(read_file(path("p.toml")),
              AllOf(HasSubstr("[pressure]\nadvance_s = 0.00200"), HasSubstr("dead_time_ms = 4.00"),
                    HasSubstr("firmware = \"klipper\"  # mine\n")));
  EXPECT_THAT(
      read_file(path("t2.gcode")),
      AllOf(HasSubstr("; unflex tune: start=G28\n"), HasSubstr("; band 15 ends\n"),
            HasSubstr("SET_PRESSURE_ADVANCE ADVANCE=0.008000\n"), HasSubstr(";unflex run\n")));
  EXPECT_THAT(read_file(path("t2.html")),
              AllOf(HasSubstr("data:image/bmp;base64,"), HasSubstr("pressure=FIRST..LAST")));
  const Outcome wrong =
      run_as_typed({"tune", "t2.gcode", "--read", "x=5..7", "--printer", "p.toml"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("t2.gcode tries the pressure"));
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
      {{"tune", "part.gcode", "--read", "pressure=3..0"}, "pressure=12..19"},
      {{"tune", "part.gcode", "--pressure", "--read", "pressure=1..2"}, "for the first tower"},
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
