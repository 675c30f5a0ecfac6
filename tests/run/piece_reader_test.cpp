#include "unflex/run/piece_reader.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "paths.hpp"

namespace unflex::run {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Reading {
 public:
  explicit Reading(const std::string& text)
      : stream_(text), reader_(stream_, "in.gcode", {}, {}, {}) {
    for (;;) {
      Piece piece;
      const Result<bool> more = reader_.next(piece);
      if (!more) {
        error = to_string(more.error());
        return;
      }
      if (!*more) {
        return;
      }
      pieces.push_back(std::move(piece));
    }
  }

  // "run: …" or "rest: …" with the lines of each piece.
  [[nodiscard]] std::vector<std::string> outline() const {
    std::vector<std::string> result;
    for (const Piece& piece : pieces) {
      result.push_back((piece.is_run ? "run: " : "rest: ") + text(piece));
    }
    return result;
  }

  [[nodiscard]] std::string all() const {
    std::string result;
    for (const Piece& piece : pieces) {
      result += text(piece);
    }
    return result;
  }

  // As "line: message".
  [[nodiscard]] std::vector<std::string> warnings() const {
    std::vector<std::string> result;
    for (const Diagnostic& warning : reader_.warnings()) {
      result.push_back(fmt::format("{}: {}", warning.place.line, warning.message));
    }
    return result;
  }

  std::vector<Piece> pieces;
  std::string error;

 private:
  static std::string text(const Piece& piece) {
    std::string result;
    for (const gcode::Event& event : piece.events) {
      result += event.line.text;
    }
    return result;
  }

  std::istringstream stream_;
  PieceReader reader_;
};

constexpr const char* kKnown = "G90\nM83\nG1 X0 Y0 Z0.2 F6000\n";

TEST(Features, AreThoseThatTheSlicerNamedLast) {
  const Reading reading(
      "G1 X10 Y10 Z1 F6000\nG4 P1\nG1 X20 E1\n;TYPE:External perimeter\nG1 X30 E1.5\n"
      "G1 X31\n; FEATURE: Sparse infill\nG1 X40 E2\n");
  std::vector<gcode::FeatureKind> kinds;
  for (const Piece& piece : reading.pieces) {
    ASSERT_EQ(piece.features.size(), piece.events.size());
    for (std::size_t i = 0; i < piece.events.size(); ++i) {
      if (piece.is_run && piece.move_counts[i] > 0) {
        kinds.push_back(piece.features[i]);
      }
    }
  }
  using enum gcode::FeatureKind;
  EXPECT_THAT(kinds, ElementsAre(other, outer_wall, outer_wall, infill));
}

TEST(PieceReader, CutsRunsAtEverythingThatStopsOrMayNotBeRewritten) {
  const Reading reading(std::string(kKnown) +
                        "G1 X5 E1\n"
                        "G1 Y5 E1\n"
                        "G4 P0\n"
                        "G1 X0 E1\n"
                        "G1 E-1\n"
                        "G1 Y0\n"
                        "G1 X2 E-0.5\n"
                        "G1 X5 E1\n"
                        "G1 Z0.4\n");
  EXPECT_THAT(reading.outline(),
              ElementsAre("rest: " + std::string(kKnown), "run: G1 X5 E1\nG1 Y5 E1\n",
                          "rest: G4 P0\n", "run: G1 X0 E1\n", "rest: G1 E-1\n", "run: G1 Y0\n",
                          "rest: G1 X2 E-0.5\n", "run: G1 X5 E1\n", "rest: G1 Z0.4\n"));
}

TEST(PieceReader, KeepsLinesThatStopNothingInsideARun) {
  const std::string run = "G1 X5 E1\nM204 S700\n; comment\nM106 S9\nG1 F1200\n\nG92 E0\nG1 Y5 E1\n";
  EXPECT_THAT(Reading(kKnown + run).outline(),
              ElementsAre("rest: " + std::string(kKnown), "run: " + run));
}

TEST(PieceReader, GivesLinesAfterTheLastMoveOfARunToTheNextPiece) {
  const std::string head(kKnown);
  EXPECT_THAT(Reading(head + "G1 X5 E1\nM204 S700\n;end\nG4 P0\n").outline(),
              ElementsAre("rest: " + head, "run: G1 X5 E1\n", "rest: M204 S700\n;end\nG4 P0\n"));
  EXPECT_THAT(Reading(head + "G1 X5 E1\n;end\nM104 S0").outline(),
              ElementsAre("rest: " + head, "run: G1 X5 E1\n", "rest: ;end\nM104 S0"));
}

TEST(PieceReader, PlansEveryRunFromRestToRest) {
  const Reading reading(std::string(kKnown) + "G1 X50 E1\nG1 X100 E1\nG1 X100.2 Z9\nG1 X150 E1\n");
  ASSERT_EQ(reading.pieces.size(), 4U);
  for (const Piece& piece : reading.pieces) {
    EXPECT_EQ(piece.moves.front().start_v_mm_s, 0.0);
    EXPECT_NEAR(piece.moves.back().end_v_mm_s, 0.0, 1e-9);
  }
  // Within a run there is no stop.
  EXPECT_GT(reading.pieces[1].moves[0].end_v_mm_s, 50.0);
}

TEST(PieceReader, CountsTheMovesOfEveryLine) {
  const Reading reading(std::string(kKnown) + "G1 X5\n;c\nG1 X5\nG2 X5 Y10 I0 J5 E1\nG1 X0\n");
  const std::vector<std::size_t> counts = {1, 0, 0};
  ASSERT_EQ(reading.pieces.size(), 2U);
  const Piece& run = reading.pieces[1];
  ASSERT_EQ(run.move_counts.size(), 5U);
  EXPECT_THAT(std::vector(run.move_counts.begin(), run.move_counts.begin() + 3),
              ::testing::ElementsAreArray(counts));
  EXPECT_GT(run.move_counts[3], 5U);
  EXPECT_EQ(run.move_counts[4], 1U);
  EXPECT_EQ(run.moves.size(), 2 + run.move_counts[3]);
}

TEST(PieceReader, AppliesLimitsWhereTheyStand) {
  const Reading reading(std::string(kKnown) + "G1 X50\nM204 S700\nG1 X100\nM204 S900\nG4 P1\n");
  ASSERT_EQ(reading.pieces.size(), 3U);
  EXPECT_EQ(reading.pieces[1].moves[0].accel_mm_s2, 5000.0);
  EXPECT_EQ(reading.pieces[1].moves[1].accel_mm_s2, 700.0);
}

TEST(PieceReader, RefusesWhatUnflexWrote) {
  const Reading reading(std::string(kKnown) + "G1 X5\n;unflex run\nG1 X6\n");
  EXPECT_THAT(reading.error, HasSubstr("in.gcode:5: this file was already compensated"));
}

TEST(PieceReader, RefusesPlacesOfJoints) {
  const Reading reading(std::string(kKnown) + "G1 X5\n; unflex joints: 1 moves\n");
  EXPECT_THAT(reading.error, HasSubstr("in.gcode:5: this file was already translated by unflex"));
}

TEST(PieceReader, HandsLongStretchesWithoutMotionOutInPortions) {
  std::string text = "G28\n";
  for (int i = 0; i < 20000; ++i) {
    text += "; line " + std::to_string(i) + "\n";
  }
  const Reading reading(text);
  EXPECT_GT(reading.pieces.size(), 2U);
  EXPECT_EQ(reading.all(), text);
}

std::string comments(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    text += "; " + std::to_string(i) + "\n";
  }
  return text;
}

TEST(PieceReader, EndsARunWhereTooManyLinesWithoutMotionStand) {
  const std::string text = std::string(kKnown) + "G1 X50 E1\nG1 X100 E1\n" + comments(70'000) +
                           "G1 X150 E1\nM204 S700\nG1 X200 E1\nG4 P0\nG1 X0 E1\n";
  const Reading reading(text);
  EXPECT_EQ(reading.all(), text);
  std::vector<bool> cut_off;
  for (const Piece& piece : reading.pieces) {
    EXPECT_LE(piece.events.size(), 20'002U);
    if (piece.is_run) {
      cut_off.push_back(piece.cut_off);
      EXPECT_EQ(piece.moves.front().start_v_mm_s, 0.0);
      EXPECT_NEAR(piece.moves.back().end_v_mm_s, 0.0, 1e-9);
    }
  }
  // The last run begins where the machine has stopped.
  EXPECT_THAT(cut_off, ElementsAre(true, true, false));
}

TEST(PieceReader, KeepsRunsWithManyLinesWithoutMotionWhole) {
  const std::string run = "G1 X50 E1\n" + comments(10'000) + "G1 X100 E1\n";
  EXPECT_THAT(Reading(kKnown + run).outline(),
              ElementsAre("rest: " + std::string(kKnown), "run: " + run));
}

TEST(PieceReader, EndsARunThatHoldsTooManyLinesWithoutMotionInAll) {
  std::string text(kKnown);
  for (int i = 0; i < 50; ++i) {
    text += "G1 X" + std::to_string(i) + " E1\n" + comments(15'000);
  }
  const Reading reading(text);
  EXPECT_EQ(reading.all(), text);
  for (const Piece& piece : reading.pieces) {
    EXPECT_LE(piece.events.size(), 401'000U);
  }
}

TEST(PieceReader, RefusesWhatHoldsNoCommand) {
  for (const char* text : {"", " \t", "; a comment\n", "Dear printer,\nplease print a cube\n"}) {
    EXPECT_THAT(Reading(text).error, HasSubstr("in.gcode: there is no G-code command in it"))
        << text;
  }
  EXPECT_EQ(Reading("T0").error, "");
}

// Sixty walls of random lengths with 0.033 mm of filament per mm, in three strokes with a wipe
// each. E is a difference; or a reading; or a reading that starts anew after each stroke.
enum class WrittenE { relative, absolute, reset };

std::string walls(WrittenE written) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> length(0.3, 8.0);
  std::string text = "G28\nG1 Z0.2 F600\nG1 X20 Y20 F6000\n";
  double laid_mm = 0.0;
  double x = 20.0;
  const auto e = [&](double mm) {
    laid_mm = written == WrittenE::relative ? mm : laid_mm + mm;
    return fmt::format(" E{:.5f}\n", laid_mm);
  };
  for (int i = 0; i < 60; ++i) {
    const double mm = length(random);
    x += i % 2 == 0 ? mm : -mm;
    text += fmt::format("G1 X{:.3f}", x) + e(0.033 * mm);
    if (i % 20 == 19) {
      for (int wipe = 0; wipe < 4; ++wipe) {
        x += 0.4;
        text += fmt::format("G1 X{:.3f}", x) + e(-0.1);
      }
      text += "G1" + e(-0.4) + "G1 Y" + std::to_string(21 + i / 20) + "\n";
      if (written == WrittenE::reset) {
        text += "G92 E0\n";
        laid_mm = 0.0;
      }
      text += "G1" + e(0.8);
    }
  }
  return text;
}

TEST(PieceReader, RefusesRelativeFilamentThatNothingTellsOf) {
  EXPECT_THAT(Reading(walls(WrittenE::relative)).error,
              AllOf(HasSubstr("in.gcode:50: "), HasSubstr("put M83 before its first move"),
                    HasSubstr("printer.relative_extrusion = true")));
  EXPECT_EQ(Reading("M83\n" + walls(WrittenE::relative)).error, "");
  EXPECT_EQ(Reading(walls(WrittenE::absolute)).error, "");
  EXPECT_EQ(Reading(walls(WrittenE::reset)).error, "");
}

TEST(PieceReader, LosesNoByteOfAnyFile) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test_paths::kData)) {
    if (entry.path().extension() == ".gcode") {
      const std::string text = flow::testing::read_file(entry.path());
      const Reading reading(text);
      EXPECT_EQ(reading.all(), text) << entry.path();
      EXPECT_EQ(reading.error, "");
      ++files;
    }
  }
  EXPECT_GE(files, 7U);
}

TEST(PieceReader, WarnsOfMovesThatTakeLong) {
  const Reading reading(std::string(kKnown) + "G1 X9 F6\nG1 X189 F6\nG1 E1 F6\nG1 E99 F6\n");
  EXPECT_THAT(reading.warnings(),
              ElementsAre("5: this move takes 30 minutes; check its F, its length and its filament",
                          "7: this move takes 17 minutes; check its F, its length and its "
                          "filament"));
}

}  // namespace
}  // namespace unflex::run
