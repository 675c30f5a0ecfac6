// Every failure gives one clear line on stderr and the right exit code, and nothing is written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "app/program.hpp"

namespace unflex::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Failure {
  std::string name;
  std::vector<std::string> arguments;
  int exit_code = 0;
  std::string message;  // the beginning of the line
};

void PrintTo(const Failure& failure, std::ostream* out) { *out << failure.name; }

class Failures : public ProgramTest, public ::testing::WithParamInterface<Failure> {
 protected:
  Failures() {
    write_file(path("in.gcode"), small_print());
    write_file(path("out.gcode"), "precious\n");
    write_file(path("good.toml"), "[limits]\nmax_accel_mm_s2 = 3000\n");
    write_file(path("bad.toml"), "[limits]\nmax_acel_mm_s2 = 1\n");
  }
};

TEST_P(Failures, AreOneLineAndLeaveEverythingAsItWas) {
  const Failure& failure = GetParam();
  const std::vector<std::string> before = names();
  const Outcome outcome = run(failure.arguments);
  EXPECT_EQ(outcome.exit_code, failure.exit_code);
  EXPECT_THAT(outcome.err, StartsWith(failure.message));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(names(), before);
  EXPECT_EQ(read_file(path("in.gcode")), small_print());
  EXPECT_EQ(read_file(path("out.gcode")), "precious\n");
  EXPECT_EQ(read_file(path("good.toml")), "[limits]\nmax_accel_mm_s2 = 3000\n");
}

INSTANTIATE_TEST_SUITE_P(
    OfUsage, Failures,
    ::testing::Values(
        Failure{"NoCommand", {}, 1, "unflex: a subcommand is required; run 'unflex --help'"},
        Failure{
            "UnknownCommand",
            {"frobnicate"},
            1,
            "unflex: unknown command 'frobnicate'; there are compensate, batch, verify, inspect, "
            "filament, printer, identify, tune, hotend, kinematics, translate, study"},
        Failure{"NoInput", {"compensate"}, 1, "unflex: IN is required; run 'unflex compensate"},
        Failure{"NoOutput", {"compensate", "in.gcode"}, 1, "unflex: where to write? give -o OUT"},
        Failure{"UnknownOption",
                {"compensate", "in.gcode", "-o", "out.gcode", "--frob"},
                1,
                "unflex: unknown option '--frob'; run 'unflex "},
        Failure{"OptionWithLineBreak",
                {"compensate", "in.gcode", "-o", "out.gcode", "--a\nb"},
                1,
                "unflex: unknown option '--a b'; run 'unflex "},
        Failure{"OutputIsThePrinter",
                {"compensate", "in.gcode", "-o", "good.toml", "--printer", "good.toml"},
                1,
                "good.toml: is the printer file too; give the output a name of its own"},
        Failure{"BothOutputs",
                {"compensate", "in.gcode", "-o", "out.gcode", "--in-place"},
                1,
                "unflex: give either --in-place or -o, not both"},
        Failure{"StdinInPlace",
                {"compensate", "-", "--in-place"},
                1,
                "unflex: --in-place needs a file, not stdin"},
        Failure{"OutputIsInput",
                {"compensate", "in.gcode", "-o", "./in.gcode"},
                1,
                "./in.gcode: is the input too"},
        Failure{"ReportIsOutput",
                {"compensate", "in.gcode", "-o", "new.json", "--report", "./new.json"},
                1,
                "./new.json: is read or written already"},
        Failure{"HtmlReport",
                {"inspect", "in.gcode", "--report", "r.html"},
                1,
                "unflex: --report r.html: the name must end in .json"},
        Failure{"CaseOfAPrint",
                {"study", "in.gcode", "--case", "ref"},
                1,
                "unflex: --case is of the corner; a print has none"},
        Failure{"ToleranceOfTheCorner",
                {"study", "--faster=20"},
                1,
                "unflex: --faster needs a print whose time it is"},
        Failure{"ToleranceOnMachines",
                {"study", "in.gcode", "--faster", "--machines", "m"},
                1,
                "unflex: give one of --machines, --map, --faster and --accel"},
        Failure{"AccelerationOfTheCorner",
                {"study", "--accel", "5000"},
                1,
                "unflex: --accel needs a print to compensate"},
        Failure{"ScaleWithoutAcceleration",
                {"study", "in.gcode", "--scale-m204"},
                1,
                "unflex: --scale-m204 and --keep-rms go with --accel"},
        Failure{"StrictWithoutTolerance",
                {"study", "in.gcode", "--at-all-times"},
                1,
                "unflex: --at-all-times says how strictly --faster is meant"},
        Failure{"ToleranceThatIsNone",
                {"study", "in.gcode", "--faster=20,0"},
                1,
                "unflex: --faster: '0' is not a number above 0"},
        Failure{"PictureOfAnotherStudy",
                {"study", "in.gcode", "--report", "r.svg"},
                1,
                "unflex: --report r.svg: the name must end in .json or .html"},
        Failure{"PrinterOfTheCorner",
                {"study", "--set", "limits.max_accel_mm_s2=3000"},
                1,
                "unflex: --printer and --set are of a print; the corner's cases have their own"},
        Failure{
            "UnknownCase", {"study", "--case", "9Z"}, 1, "unflex: --case 9Z: there are ref, 1A"},
        Failure{"ReportOfNoKind",
                {"compensate", "in.gcode", "-o", "out.gcode", "--report", "r.txt"},
                1,
                "unflex: --report r.txt: the name must end in .json or .html"},
        Failure{"TwoResultsOnStdout",
                {"compensate", "in.gcode", "-o", "-", "--report", "-"},
                1,
                "unflex: the output and the report cannot both go to stdout"},
        Failure{"NoWorkers",
                {"compensate", "in.gcode", "-o", "out.gcode", "-j", "0"},
                1,
                "unflex: --jobs: "},
        Failure{"WorkersInWords",
                {"compensate", "in.gcode", "-o", "out.gcode", "-j", "two"},
                1,
                "unflex: "},
        Failure{"DeviationNotANumber",
                {"compensate", "in.gcode", "-o", "out.gcode", "--max-deviation", "nan"},
                1,
                "unflex: --max-deviation: 'nan' is not a number above 0"},
        Failure{"NegativeDeviation",
                {"compensate", "in.gcode", "-o", "out.gcode", "--max-deviation=-1"},
                1,
                "unflex: --max-deviation: '-1' is not a number above 0"},
        Failure{"VerifyAgainstNothing",
                {"verify", "out.gcode"},
                1,
                "unflex: --against is required; run 'unflex verify --help'"},
        Failure{"ReportBesideStdout",
                {"compensate", "in.gcode", "-o", "-", "--report", ".html"},
                1,
                "unflex: --report .html: stdout has no file to stand beside; name one, as "
                "print.html\n"},
        Failure{"BatchOfAFile",
                {"batch", "in.gcode", "-o", "out"},
                2,
                "in.gcode: is not a folder; for one print there is unflex compensate\n"},
        Failure{"BatchBelowAFile",
                {"batch", ".", "-o", "out.gcode/x"},
                1,
                "out.gcode/x: cannot make the folder: Not a directory\n"},
        Failure{"BatchWithoutAName",
                {"batch", ".", "-o", ""},
                1,
                "unflex: the name of a folder is empty\n"},
        Failure{"BatchByAFolderOfPrinters",
                {"batch", ".", "-o", "out", "--printer", "."},
                1,
                ".: is read for every print; give --printer a file\n"},
        Failure{"NothingToIdentifyFrom",
                {"identify"},
                1,
                "unflex: what to identify from? give records, or --wave-spacing-mm and "
                "--speed-mm-s\n"},
        Failure{"HalfATower",
                {"identify", "--wave-spacing-mm", "2", "--axis", "x"},
                1,
                "unflex: a ringing tower needs both --wave-spacing-mm and --speed-mm-s\n"},
        Failure{"TowerWithoutAnAxis",
                {"identify", "--wave-spacing-mm", "2", "--speed-mm-s", "100"},
                1,
                "unflex: say with --axis which of x and y the ringing tower's wall shows\n"},
        Failure{"TowerThatGrows",
                {"identify", "--wave-spacing-mm", "2", "--speed-mm-s", "100", "--axis", "x",
                 "--decay", "0.5"},
                1,
                "unflex: the decay is how many times lower a wave is than the one before, above "
                "1\n"},
        Failure{"SweepBackwards",
                {"identify", "in.gcode", "--freq-start", "50", "--freq-end", "40"},
                1,
                "unflex: --freq-start must be below --freq-end\n"},
        Failure{"SecondOfATower",
                {"identify", "--second", "--wave-spacing-mm", "2", "--speed-mm-s", "100", "--axis",
                 "x"},
                1,
                "unflex: --second needs recordings; a ringing tower shows one mode only\n"},
        Failure{"PrinterOfRecords",
                {"identify", "in.gcode", "--printer", "p.toml"},
                1,
                "unflex: --printer and --set go with --second and --make-test\n"},
        Failure{"TestToNowhere",
                {"identify", "--make-test", "x"},
                1,
                "unflex: where to write the test? give -o OUT, or -o - for stdout\n"},
        Failure{"TestOfRecords",
                {"identify", "in.gcode", "--make-test", "x", "-o", "t.gcode"},
                1,
                "unflex: --make-test writes a test and takes no records; give them to identify "
                "--second once the printer has made them\n"},
        Failure{"NothingToTuneBy",
                {"hotend"},
                1,
                "unflex: what to tune by? give a log, --ku and --pu of a test, or --printer with a "
                "model in its [hotend]\n"},
        Failure{"GainWithoutPeriod",
                {"hotend", "--ku", "35"},
                1,
                "unflex: --ku and --pu are the gain and the period of one test; give both\n"},
        Failure{"LogAndTest",
                {"hotend", "in.gcode", "--ku", "35", "--pu", "30"},
                1,
                "unflex: give one of a log, --ku with --pu, and --printer or --set\n"},
        Failure{"PowerOfNoLog",
                {"hotend", "--ku", "35", "--pu", "30", "--power", "1"},
                1,
                "unflex: --power, --heater and --ambient are of a log; give that too\n"},
        Failure{"StepOfATest",
                {"hotend", "--ku", "35", "--pu", "30", "--target", "200"},
                1,
                "unflex: a test gives no model to simulate by; --target, --flow and "
                "--heater-watts need a log or --printer\n"},
        Failure{"RuleThatATestCannotFeed",
                {"hotend", "--ku", "35", "--pu", "30", "--rule", "cc"},
                1,
                "unflex: the rule 'cc' needs a model of the hotend, not only its ultimate cycle; "
                "give a log, or choose zn or tl\n"},
        Failure{"NegativeFlow",
                {"hotend", "in.gcode", "--flow", "-3", "--heater-watts", "40"},
                1,
                "unflex: --flow: '-3' is not a number above 0; run 'unflex hotend --help'\n"},
        Failure{"FlowWithoutAHeater",
                {"hotend", "in.gcode", "--flow", "3"},
                1,
                "unflex: --flow takes heat; say with --heater-watts what the heater gives at full "
                "power\n"},
        Failure{"PrinterWithoutAModel",
                {"hotend", "--printer", "good.toml"},
                1,
                "good.toml: hotend.gain_c is missing; unflex hotend with a log of a heating writes "
                "the [hotend] to put there\n"},
        Failure{"TargetThatIsTooHot",
                {"hotend", "--set", "hotend.gain_c=1", "--set", "hotend.time_constant_s=300",
                 "--set", "hotend.dead_time_s=5", "--target", "300"},
                1,
                "unflex: a step to 300 °C cannot be: without power it is 25 °C, at full power 280; "
                "give a --target between\n"},
        Failure{"VerifyStdinTwice",
                {"verify", "-", "--against", "-"},
                1,
                "unflex: only one of OUT and --against can be stdin"}),
    [](const auto& failure) { return failure.param.name; });

INSTANTIATE_TEST_SUITE_P(
    OfConfiguration, Failures,
    ::testing::Values(
        Failure{"UnknownKey",
                {"compensate", "in.gcode", "-o", "out.gcode", "--set", "emit.perod_ms=1"},
                1,
                "--set emit.perod_ms=1: unknown key 'emit.perod_ms', did you mean "
                "'emit.period_ms'?\n"},
        Failure{"UnknownKeyInFile",
                {"compensate", "in.gcode", "-o", "out.gcode", "--printer", "bad.toml"},
                1,
                "bad.toml:2: unknown key 'limits.max_acel_mm_s2', did you mean "
                "'limits.max_accel_mm_s2'?\n"},
        Failure{"ValueOutOfRange",
                {"compensate", "in.gcode", "-o", "out.gcode", "--set", "emit.period_ms=-1"},
                1,
                "--set emit.period_ms=-1: emit.period_ms is -1, but must be"},
        Failure{"PrinterFileMissing",
                {"inspect", "in.gcode", "--printer", "none.toml"},
                1,
                "none.toml: cannot read the printer file: No such file or directory\n"},
        Failure{"PrinterFileIsGcode",
                {"inspect", "in.gcode", "--printer", "in.gcode"},
                1,
                "in.gcode: is a print, not a printer file"}),
    [](const auto& failure) { return failure.param.name; });

INSTANTIATE_TEST_SUITE_P(
    OfInput, Failures,
    ::testing::Values(
        Failure{"Missing",
                {"compensate", "none.gcode", "-o", "out.gcode"},
                2,
                "none.gcode: cannot read: No such file or directory\n"},
        Failure{"MissingToInspect", {"inspect", "none.gcode"}, 2, "none.gcode: cannot read: "},
        Failure{"MissingToVerify",
                {"verify", "none.gcode", "--against", "in.gcode"},
                2,
                "none.gcode: cannot read: "},
        Failure{"MissingToVerifyAgainst",
                {"verify", "out.gcode", "--against", "none.gcode"},
                2,
                "none.gcode: cannot read: "},
        Failure{"Directory",
                {"compensate", ".", "-o", "out.gcode"},
                2,
                ".: is a directory, not a G-code file\n"},
        Failure{"LineBreakInName", {"inspect", "a\nb.gcode"}, 2, "a b.gcode: cannot read: "}),
    [](const auto& failure) { return failure.param.name; });

// Permissions do not stop the superuser, so these are targets that nobody can create.
INSTANTIATE_TEST_SUITE_P(
    OfOutput, Failures,
    ::testing::Values(Failure{"DirectoryMissing",
                              {"compensate", "in.gcode", "-o", "none/out.gcode"},
                              1,
                              "none/out.gcode: the directory none does not exist; create it\n"},
                      Failure{"ParentIsAFile",
                              {"compensate", "in.gcode", "-o", "out.gcode/x"},
                              1,
                              "out.gcode/x: cannot write: Not a directory\n"},
                      Failure{"TargetIsADirectory",
                              {"compensate", "in.gcode", "-o", "."},
                              1,
                              ".: is a directory; name a file in it\n"},
                      Failure{"NotWritable",
                              {"compensate", "in.gcode", "-o", "/proc/out.gcode"},
                              1,
                              "/proc/out.gcode: cannot write"},
                      Failure{
                          "ReportNotWritable",
                          {"compensate", "in.gcode", "-o", "out.gcode", "--report", "none/r.json"},
                          1,
                          "none/r.json: the directory none does not exist; create it\n"}),
    [](const auto& failure) { return failure.param.name; });

INSTANTIATE_TEST_SUITE_P(
    OfDevices, Failures,
    ::testing::Values(Failure{
        "Full",
        {"compensate", "in.gcode", "-o", "/dev/full"},
        4,
        "/dev/full: cannot write: No space left on device; make room there\n"}),
    [](const auto& failure) { return failure.param.name; });

TEST_F(ProgramTest, RefusesWhatIsNotGcode) {
  const std::string bytes(4096, '\0');
  write_file(path("in.gcode"), bytes);
  write_file(path("out.gcode"), "precious\n");
  const Outcome outcome = run({"compensate", "in.gcode", "-o", "out.gcode"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, StartsWith("in.gcode"));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_EQ(read_file(path("out.gcode")), "precious\n");
  EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode"));
}

TEST_F(ProgramTest, NeedsSomewhereToKeepStreams) {
  write_file(path("in.gcode"), small_print());
  ASSERT_EQ(::setenv("TMPDIR", "/nonexistent", 1), 0);
  const Outcome in = run({"inspect", "-"}, small_print());
  const Outcome report = run({"inspect", "in.gcode", "--report", "-"});
  ::unsetenv("TMPDIR");
  for (const Outcome& outcome : {in, report}) {
    EXPECT_EQ(outcome.exit_code, 4);
    EXPECT_THAT(outcome.err, HasSubstr("set TMPDIR to another directory"));
  }
}

}  // namespace
}  // namespace unflex::app
