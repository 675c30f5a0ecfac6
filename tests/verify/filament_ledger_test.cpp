#include "filament_ledger.hpp"

#include <gtest/gtest.h>

#include "replaying.hpp"

namespace unflex::verify {
namespace {

planner::PlannedMove even_move(double duration_s, double filament_mm) {
  planner::PlannedMove move;
  move.segment.end_mm = {duration_s, 0.0, 0.0, filament_mm};
  move.length_mm = duration_s;
  move.cruise_v_mm_s = 1.0;
  move.cruise_s = duration_s;
  return move;
}

class Ledger : public ::testing::Test {
 protected:
  void play(const std::vector<planner::PlannedMove>& reference,
            const std::vector<planner::PlannedMove>& emitted) {
    std::size_t taken = 0;
    ReferencePath path([&](ReferenceMove& next) {
      if (taken == reference.size()) return false;
      next.move = reference[taken++];
      return true;
    });
    path.begin_section();
    FilamentLedger ledger;
    ledger.begin_run(path);
    double time_s = 0.0;
    for (const planner::PlannedMove& move : emitted) {
      path.extend_to(time_s + move.duration_s() + 1.0);
      ledger.play(move, time_s);
      time_s += move.duration_s();
    }
    path.extend_to(1e9);
    ledger.end_run();
    input_mm_ = ledger.input_mm();
    output_mm_ = ledger.output_mm();
    worst_mm_ = ledger.worst_move_error_mm();
  }

  double input_mm_ = 0.0;
  double output_mm_ = 0.0;
  double worst_mm_ = 0.0;
};

TEST_F(Ledger, FindsNoErrorInTheSameMoves) {
  play({even_move(1.0, 0.5), even_move(2.0, 0.0)}, {even_move(1.0, 0.5), even_move(2.0, 0.0)});
  EXPECT_DOUBLE_EQ(input_mm_, 0.5);
  EXPECT_DOUBLE_EQ(output_mm_, 0.5);
  EXPECT_LT(worst_mm_, 1e-15);
}

TEST_F(Ledger, GivesALineThatSpansTwoMovesTheBenefitOfTheDoubt) {
  // The middle line covers the last half second of the first move and the first of the second.
  play({even_move(1.0, 0.4), even_move(1.0, 0.8)},
       {even_move(0.5, 0.2), even_move(1.0, 0.6), even_move(0.5, 0.4)});
  EXPECT_LT(worst_mm_, 1e-15);
}

TEST_F(Ledger, FindsFilamentLaidInTheWrongMove) {
  play({even_move(1.0, 0.4), even_move(1.0, 0.8)},
       {even_move(0.5, 0.3), even_move(0.5, 0.3), even_move(0.5, 0.3), even_move(0.5, 0.3)});
  EXPECT_DOUBLE_EQ(output_mm_, 1.2);
  // The error is less by what the tolerance of the clock explains, 0.2 ms at 0.6 mm/s.
  EXPECT_NEAR(worst_mm_, 0.2, 1.3e-4);
}

TEST_F(Ledger, FindsFilamentThatIsMissingAtTheEnd) {
  play({even_move(1.0, 0.4), even_move(1.0, 0.8)},
       {even_move(0.5, 0.2), even_move(0.5, 0.2), even_move(1.0, 0.7)});
  EXPECT_NEAR(worst_mm_, 0.1, 1e-12);
}

TEST_F(Ledger, CountsATailWithTheLastMove) {
  play({even_move(1.0, 0.4)}, {even_move(0.5, 0.2), even_move(0.5, 0.1), even_move(0.5, 0.1)});
  EXPECT_LT(worst_mm_, 1e-15);
}

TEST_F(Ledger, SeesManyShortMovesWithinOneLine) {
  play({even_move(0.2, 0.1), even_move(0.2, 0.1), even_move(0.2, 0.1), even_move(0.4, 0.2)},
       {even_move(1.0, 0.5)});
  EXPECT_LT(worst_mm_, 1e-15);
}

}  // namespace
}  // namespace unflex::verify
