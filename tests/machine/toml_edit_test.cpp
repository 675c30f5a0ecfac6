#include "unflex/machine/toml_edit.hpp"

#include <gtest/gtest.h>

#include <array>

#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

const std::array<TomlEdit, 2> kEdits = {TomlEdit{"dynamics.x.freq_hz", "45.294", "± 2 %"},
                                        TomlEdit{"dynamics.x.damping_ratio", "0.0581", "± 0.01"}};

void expect_edited(std::string_view before, std::string_view after) {
  const Result<std::string> edited = with_values(before, "printer.toml", kEdits);
  ASSERT_TRUE(edited) << to_string(edited.error());
  EXPECT_EQ(*edited, after);
}

TEST(TomlEdit, ChangesValuesInPlaceAndNothingElse) {
  expect_edited(
      "schema_version = 1\n# mine\n[dynamics.x]\n  freq_hz = 50   # old\ndamping_ratio=0.1\n"
      "[limits]\nmax_accel_mm_s2 = 4000 # kept\n",
      "schema_version = 1\n# mine\n[dynamics.x]\n  freq_hz = 45.294  # ± 2 %\n"
      "damping_ratio=0.0581  # ± 0.01\n[limits]\nmax_accel_mm_s2 = 4000 # kept\n");
}

TEST(TomlEdit, AddsKeysToTheirSection) {
  expect_edited("schema_version = 1\n[dynamics.x]\n[limits]\nmax_accel_mm_s2 = 4000",
                "schema_version = 1\n[dynamics.x]\nfreq_hz = 45.294  # ± 2 %\n"
                "damping_ratio = 0.0581  # ± 0.01\n[limits]\nmax_accel_mm_s2 = 4000");
}

TEST(TomlEdit, AddsASectionAtTheEnd) {
  expect_edited("schema_version = 1\n[limits]\nmax_accel_mm_s2 = 4000",
                "schema_version = 1\n[limits]\nmax_accel_mm_s2 = 4000\n\n[dynamics.x]\n"
                "freq_hz = 45.294  # ± 2 %\ndamping_ratio = 0.0581  # ± 0.01\n");
}

TEST(TomlEdit, ChangesDottedAndInlineKeys) {
  expect_edited("schema_version = 1\ndynamics.x.freq_hz = 50\ndynamics.x.damping_ratio = 0.1\n",
                "schema_version = 1\ndynamics.x.freq_hz = 45.294  # ± 2 %\n"
                "dynamics.x.damping_ratio = 0.0581  # ± 0.01\n");
  expect_edited("schema_version = 1\ndynamics.x = {freq_hz = 50, damping_ratio = 0.1}\n",
                "schema_version = 1\ndynamics.x = {freq_hz = 45.294, damping_ratio = 0.0581}\n");
}

TEST(TomlEdit, KeepsWindowsLineEndings) {
  expect_edited("schema_version = 1\r\n[dynamics.x]\r\nfreq_hz = 50\r\n",
                "schema_version = 1\r\n[dynamics.x]\r\ndamping_ratio = 0.0581  # ± 0.01\r\n"
                "freq_hz = 45.294  # ± 2 %\r\n");
}

TEST(TomlEdit, RefusesWhatItCannotChangeAndTellsTheLines) {
  for (const char* text :
       {"schema_version = 1\ndynamics.x = {freq_hz = 50}\n",
        "schema_version = 1\n[dynamics.x]\nmass_g = 400\nstiffness_n_mm = 30\ndamping_n_s_mm = "
        "0.01\n",
        "schema_version = 1\n[[dynamics.x.mode]]\nfreq_hz = 45\ndamping_ratio = 0.05\ngain = 1\n",
        "[printer]\nkinematics: cartesian\nmax_velocity: 300\nmax_accel: 3000\n"}) {
    const Result<std::string> edited = with_values(text, "printer.toml", kEdits);
    ASSERT_FALSE(edited) << *edited;
    EXPECT_EQ(edited.error().kind, ErrorKind::usage);
    EXPECT_EQ(edited.error().place.file, "printer.toml");
    EXPECT_NE(edited.error().message.find("dynamics.x.freq_hz = 45.294"), std::string::npos)
        << edited.error().message;
  }
}

TEST(TomlEdit, ReadsBackWhatItWrites) {
  const Result<std::string> edited = with_values("schema_version = 1\n", "printer.toml", kEdits);
  ASSERT_TRUE(edited);
  const Result<Settings> settings = parse(*edited, "printer.toml", {});
  ASSERT_TRUE(settings);
  EXPECT_DOUBLE_EQ(settings->dynamics.x.freq_hz, 45.294);
  EXPECT_DOUBLE_EQ(settings->dynamics.x.damping_ratio, 0.0581);
}

}  // namespace
}  // namespace unflex::machine
