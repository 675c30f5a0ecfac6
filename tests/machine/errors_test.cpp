// Mistakes are named with their place and a remedy.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;

struct Mistake {
  std::string name;
  std::string text;
  std::vector<std::string> overrides;
  std::string message;  // the whole message
};

void PrintTo(const Mistake& mistake, std::ostream* out) { *out << mistake.name; }

class Mistakes : public ::testing::TestWithParam<Mistake> {};

TEST_P(Mistakes, AreUsageErrorsWithTheirPlace) {
  const Mistake& mistake = GetParam();
  const Result<Settings> settings = parse(mistake.text, "printer.toml", mistake.overrides);
  ASSERT_FALSE(settings);
  EXPECT_EQ(settings.error().kind, ErrorKind::usage);
  EXPECT_EQ(to_string(settings.error()), mistake.message);
}

INSTANTIATE_TEST_SUITE_P(
    InTheFile, Mistakes,
    ::testing::Values(
        Mistake{"UnknownKey",
                "schema_version = 1\n\n[limits]\nmax_acel_mm_s2 = 1\n",
                {},
                "printer.toml:4: unknown key 'limits.max_acel_mm_s2', did you mean "
                "'limits.max_accel_mm_s2'?"},
        Mistake{"KeyWithoutUnit",
                "[limits]\nmax_accel = 1\n",
                {},
                "printer.toml:2: unknown key 'limits.max_accel', did you mean "
                "'limits.max_accel_mm_s2'?"},
        Mistake{"KeyInWrongSection",
                "[base]\nperiod_ms = 1\n",
                {},
                "printer.toml:2: unknown key 'base.period_ms', did you mean 'emit.period_ms'?"},
        Mistake{"KeyLikeNoOther",
                "[base]\nxyzzy = 1\n",
                {},
                "printer.toml:2: unknown key 'base.xyzzy'"},
        Mistake{"UnknownSection",
                "\n[limit]\nmax_accel_mm_s2 = 1\n",
                {},
                "printer.toml:2: unknown section 'limit', did you mean 'limits'?"},
        Mistake{"EmptyUnknownSection",
                "[dynamics.z]\n",
                {},
                "printer.toml:1: unknown section 'dynamics.z', did you mean 'dynamics.x'?"},
        Mistake{
            "SectionAsKey", "limits = 5\n", {}, "printer.toml:1: 'limits' is a section, not a key"},
        Mistake{"TopmostMistakeFirst",
                "[verify]\nbad = 1\n[emit]\nworse = 1\n",
                {},
                "printer.toml:2: unknown key 'verify.bad'"},
        Mistake{"TextForNumber",
                "[emit]\nperiod_ms = \"1\"\n",
                {},
                "printer.toml:2: emit.period_ms must be a number, not the text \"1\""},
        Mistake{"NumberForSwitch",
                "[printer]\nfirmware_retraction = 1\n",
                {},
                "printer.toml:2: printer.firmware_retraction must be true or false, not a number"},
        Mistake{"WordThatIsNone",
                "[printer]\ninput_shaper_type = \"custom\"\n",
                {},
                "printer.toml:2: printer.input_shaper_type must be one of \"auto\", \"zv\", "
                "\"mzv\", \"zvd\", \"zvdd\", \"zvddd\", \"ei\", \"2hump_ei\", \"3hump_ei\", "
                "\"ei2\", \"ei3\", not the text \"custom\""},
        Mistake{"HalfACircleSegment",
                "[printer]\nmin_circle_segments = 0.5\n",
                {},
                "printer.toml:2: printer.min_circle_segments is 0.5, but must be ≥ 1, ≤ 1000"},
        Mistake{"BrokenCorrectionInterval",
                "[printer]\narc_correction_interval = 1.5\n",
                {},
                "printer.toml:2: printer.arc_correction_interval is 1.5, but must be a whole "
                "number"},
        Mistake{"ArcSegmentsOfNoLength",
                "[printer]\nmin_arc_segment_mm = 2\n",
                {},
                "printer.toml:2: printer.min_arc_segment_mm is 2, but must not exceed "
                "printer.max_arc_segment_mm, 1"},
        Mistake{"JunctionDeviationThatCannotBeSetBack",
                "[limits]\njunction_deviation_mm = 0.4\n",
                {},
                "printer.toml:2: limits.junction_deviation_mm is 0.4, but must be ≥ 0.01, ≤ 0.3"},
        Mistake{"TwoShapersOfOne",
                "[printer]\nfirmware = \"rrf\"\ninput_shaper_freq_y_hz = 40\n",
                {},
                "printer.toml:3: printer.input_shaper_freq_y_hz is 40, but RepRapFirmware has one "
                "input shaper for both axes; set printer.input_shaper_freq_x_hz, now 0, alone"},
        Mistake{"ShaperThatIsTooSlow",
                "[printer]\nfirmware = \"rrf\"\ninput_shaper_freq_x_hz = 5\n",
                {},
                "printer.toml:3: printer.input_shaper_freq_x_hz is 5, but must be 0 for none or "
                "5.73 to 1000, what RepRapFirmware takes"},
        Mistake{
            "FilamentThatKlipperDoesNotLeaveOut",
            "[printer]\nunretract_extra_length_mm = -0.5\n",
            {},
            "printer.toml:2: printer.unretract_extra_length_mm is -0.5, but must be at least 0"},
        Mistake{"TravelInWords",
                "[printer]\ntravel_x_mm = [0, \"far\"]\n",
                {},
                "printer.toml:2: printer.travel_x_mm must be two numbers, as in [0, 250]"},
        Mistake{"NotANumber",
                "[emit]\nperiod_ms = nan\n",
                {},
                "printer.toml:2: emit.period_ms must be a finite number"},
        Mistake{"Infinity",
                "[limits]\nmax_accel_mm_s2 = inf\n",
                {},
                "printer.toml:2: limits.max_accel_mm_s2 must be a finite number"},
        Mistake{"OutOfRange",
                "[limits]\nminimum_cruise_ratio = 1\n",
                {},
                "printer.toml:2: limits.minimum_cruise_ratio is 1, but must be ≥ 0, < 1"},
        Mistake{"Negative",
                "[limits]\nmax_velocity_mm_s = -300\n",
                {},
                "printer.toml:2: limits.max_velocity_mm_s is -300, but must be > 0"},
        Mistake{"ReversedTravel",
                "[printer]\ntravel_x_mm = [250, 0]\n",
                {},
                "printer.toml:2: printer.travel_x_mm is [250, 0], but the first number must be "
                "the smaller"},
        Mistake{"TravelOfThree",
                "[printer]\ntravel_x_mm = [0, 1, 2]\n",
                {},
                "printer.toml:2: printer.travel_x_mm must be two numbers, as in [0, 250]"},
        Mistake{"UnknownFirmware",
                "[printer]\nfirmware = \"kliper\"\n",
                {},
                "printer.toml:2: printer.firmware must be one of \"klipper\", \"marlin\", "
                "\"rrf\", not the text \"kliper\""},
        Mistake{"NotAWholeNumber",
                "[printer]\nfirmware = \"marlin\"\nqueue_length = 16.5\n",
                {},
                "printer.toml:3: printer.queue_length is 16.5, but must be a whole number"},
        Mistake{"SchemaOfALaterVersion",
                "schema_version = 2\n",
                {},
                "printer.toml:1: schema_version must be 1, the only one this version of unflex "
                "reads"}),
    [](const auto& mistake) { return mistake.param.name; });

INSTANTIATE_TEST_SUITE_P(
    InOverrides, Mistakes,
    ::testing::Values(
        Mistake{"UnknownKey",
                "",
                {"emit.perod_ms=1"},
                "--set emit.perod_ms=1: unknown key 'emit.perod_ms', did you mean "
                "'emit.period_ms'?"},
        Mistake{"KeyWithoutSection",
                "",
                {"period_ms=1"},
                "--set period_ms=1: unknown key 'period_ms', did you mean 'emit.period_ms'?"},
        Mistake{"NoEquals",
                "",
                {"emit.period_ms"},
                "--set emit.period_ms: must have the form key=value"},
        Mistake{"NoKey", "", {"=3"}, "--set =3: must have the form key=value"},
        Mistake{"NoValue",
                "",
                {"emit.period_ms="},
                "--set emit.period_ms=: emit.period_ms needs a value"},
        Mistake{"BareWord",
                "",
                {"emit.period_ms=fast"},
                "--set emit.period_ms=fast: emit.period_ms must be a number, not the text "
                "\"fast\""},
        Mistake{"Table",
                "",
                {"emit.period_ms={a=1}"},
                "--set emit.period_ms={a=1}: emit.period_ms must be a number, not a table"}),
    [](const auto& mistake) { return mistake.param.name; });

INSTANTIATE_TEST_SUITE_P(
    BetweenKeys, Mistakes,
    ::testing::Values(
        Mistake{"BothFormsOfDynamics",
                "[dynamics.x]\nfreq_hz = 40\nmass_g = 1\nstiffness_n_mm = 1\ndamping_n_s_mm = 0\n",
                {},
                "printer.toml:2: dynamics.x.freq_hz cannot stand beside mass_g, stiffness_n_mm "
                "and damping_n_s_mm; give one form only"},
        Mistake{"HalfAForm",
                "[dynamics.y]\nmass_g = 500\ndamping_n_s_mm = 0\n",
                {},
                "printer.toml:3: dynamics.y.stiffness_n_mm is missing: mass_g, stiffness_n_mm and "
                "damping_n_s_mm go together"},
        Mistake{"MassInKilograms",
                "[dynamics.x]\nmass_g = 0.0005\nstiffness_n_mm = 40\ndamping_n_s_mm = 0.01\n",
                {},
                "printer.toml:2: mass, stiffness and damping give dynamics.x.freq_hz = 4.502e+04, "
                "which is out of range; check their units"},
        Mistake{"PeriodTooLong",
                "[emit]\nperiod_ms = 5\n",
                {},
                "printer.toml:2: emit.period_ms is 5, too long for a resonance at 45 Hz; at most "
                "2.22, better 1.11"},
        Mistake{"BaseWeakerThanThePlan",
                "[base]\nmax_accel_mm_s2 = 4000\n",
                {},
                "printer.toml:2: base.max_accel_mm_s2 is 4000, but must be at least "
                "limits.max_accel_mm_s2, 5000; 2 to 10 times that is usual"},
        Mistake{"BaseSlowerThanThePlan",
                "[base]\nmax_velocity_mm_s = 100\n",
                {},
                "printer.toml:2: base.max_velocity_mm_s is 100, but must be at least "
                "limits.max_velocity_mm_s, 300"},
        Mistake{"EmittedAccelerationTooLow",
                "[limits]\nmax_accel_mm_s2 = 120000\n",
                {},
                "printer.toml:2: emit.accel_mm_s2 is 1000000, but must be at least 1200000 (5 × "
                "base.max_accel_mm_s2); raise it or lower base.max_accel_mm_s2"},
        Mistake{"FastZ",
                "[limits]\nmax_z_velocity_mm_s = 400\n",
                {},
                "printer.toml:2: limits.max_z_velocity_mm_s must not exceed "
                "limits.max_velocity_mm_s"},
        Mistake{"QuickZ",
                "[limits]\nmax_z_accel_mm_s2 = 6000\n",
                {},
                "printer.toml:2: limits.max_z_accel_mm_s2 must not exceed limits.max_accel_mm_s2"},
        Mistake{"EmittedCornersTooSlow",
                "[emit]\nsquare_corner_velocity_mm_s = 1\n",
                {},
                "printer.toml:2: emit.square_corner_velocity_mm_s must not be below "
                "limits.square_corner_velocity_mm_s"},
        Mistake{"CheckpointsOnMarlin",
                "[emit]\ncheckpoints = true\n[printer]\nfirmware = \"marlin\"\n",
                {},
                "printer.toml:2: emit.checkpoints is true, but printer.firmware is marlin, on "
                "which no pause can wait for a run's end; set it to false, docs/pausing.md says "
                "where to pause"},
        Mistake{"CheckpointsOnRepRapFirmware",
                "[printer]\nfirmware = \"rrf\"\n",
                {"emit.checkpoints=true"},
                "--set emit.checkpoints=true: emit.checkpoints is true, but printer.firmware is "
                "rrf, on which no pause can wait for a run's end; set it to false, "
                "docs/pausing.md says where to pause"},
        Mistake{"OverlapLongerThanTheWindow",
                "[solve]\nwindow_s = 1\noverlap_s = 2\n",
                {},
                "printer.toml:3: solve.overlap_s must not exceed solve.window_s"},
        Mistake{
            "TimingOfAnUnknownFeature",
            "[timing]\nfeatures = \"infill, walls\"\n",
            {},
            "printer.toml:2: timing.features has \"walls\" in it, but must be \"all\" or some of "
            "outer_wall, inner_wall, infill, solid_infill, top, bridge, support, skirt, travel, "
            "other, with commas between"},
        Mistake{"NoFlowAtAll",
                "[extruder]\nmax_flow_mm3_s = 0\n",
                {},
                "printer.toml:2: extruder.max_flow_mm3_s is 0, but must be > 0"},
        Mistake{"FilamentThinnerThanNozzle",
                "[extruder]\nfilament_diameter_mm = 0.3\n",
                {},
                "printer.toml:2: extruder.filament_diameter_mm must not be below "
                "nozzle_diameter_mm"}),
    [](const auto& mistake) { return mistake.param.name; });

TEST(Periods, UpToATenthOfTheResonanceAreAllowed) {
  EXPECT_TRUE(parse("", "", {"emit.period_ms=2.22"}));
  EXPECT_FALSE(parse("", "", {"emit.period_ms=2.23"}));
}

TEST(Overrides, CanMendWhatTheFileGotWrong) {
  EXPECT_TRUE(parse("[printer]\nfirmware = \"marlin\"\n", "", {"printer.firmware=klipper"}));
}

TEST(TomlErrors, NameTheLine) {
  const Result<Settings> settings = parse("[limits]\nmax_accel_mm_s2 = = 3\n", "p.toml", {});
  ASSERT_FALSE(settings);
  EXPECT_THAT(to_string(settings.error()), ::testing::StartsWith("p.toml:2: not valid TOML: "));
}

TEST(TomlErrors, IncludeDuplicateKeys) {
  const Result<Settings> settings = parse("[emit]\nperiod_ms = 1\nperiod_ms = 2\n", "p.toml", {});
  ASSERT_FALSE(settings);
  EXPECT_EQ(settings.error().place.line, 3U);
}

TEST(MissingFile, IsAUsageError) {
  const Result<Settings> settings = load("/nonexistent/printer.toml", {});
  ASSERT_FALSE(settings);
  EXPECT_EQ(settings.error().kind, ErrorKind::usage);
  EXPECT_THAT(to_string(settings.error()),
              HasSubstr("/nonexistent/printer.toml: cannot read the printer file"));
}

TEST(DirectoryAsFile, IsAUsageError) {
  const Result<Settings> settings = load(::testing::TempDir(), {});
  ASSERT_FALSE(settings);
  EXPECT_THAT(to_string(settings.error()), HasSubstr("is a directory"));
}

// The file can be opened, but not read.
TEST(UnreadableFile, IsAUsageError) {
  const Result<Settings> settings = load("/proc/self/mem", {});
  ASSERT_FALSE(settings.has_value());
  EXPECT_EQ(settings.error().kind, ErrorKind::usage);
  EXPECT_EQ(to_string(settings.error()), "/proc/self/mem: cannot read the printer file");
}

TEST(EndlessFile, IsAUsageError) {
  const Result<Settings> settings = load("/dev/zero", {});
  ASSERT_FALSE(settings);
  EXPECT_THAT(to_string(settings.error()), HasSubstr("too large"));
}

}  // namespace
}  // namespace unflex::machine
