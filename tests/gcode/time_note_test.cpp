#include "unflex/gcode/time_note.hpp"

#include <gtest/gtest.h>

#include <string>

namespace unflex::gcode {
namespace {

TEST(TimeNote, ScalesTheMinutesOfM73AndNotThePercents) {
  EXPECT_EQ(with_times_scaled("M73 P0 R98", TimeFactors::even(1.5)), "M73 P0 R147");
  EXPECT_EQ(with_times_scaled("M73 Q50 S10", TimeFactors::even(0.5)), "M73 Q50 S5");
  EXPECT_EQ(with_times_scaled("m73 p1 r97 C20 D3 ; R97", TimeFactors::even(2.0)),
            "m73 p1 r194 C40 D6 ; R97");
  EXPECT_EQ(with_times_scaled("M73P5R7", TimeFactors::even(1.0)), "M73P5R7");
  EXPECT_EQ(with_times_scaled("M73 R1.5", TimeFactors::even(2.0)), "M73 R3.0");
}

TEST(TimeNote, ScalesWhatSlicersWrite) {
  EXPECT_EQ(with_times_scaled(";TIME:2789", TimeFactors::even(1.1)), ";TIME:3068");
  EXPECT_EQ(with_times_scaled(";TIME_ELAPSED:376.225026", TimeFactors::even(2.0)),
            ";TIME_ELAPSED:752.450052");
  EXPECT_EQ(with_times_scaled("; estimated printing time (normal mode) = 1h 38m 3s",
                              TimeFactors::even(1.01)),
            "; estimated printing time (normal mode) = 1h 39m 2s");
  EXPECT_EQ(with_times_scaled("; estimated printing time (normal mode) = 59m 59s",
                              TimeFactors::even(2.0)),
            "; estimated printing time (normal mode) = 1h 59m 58s");
  EXPECT_EQ(with_times_scaled("; estimated first layer printing time (silent mode) = 55s",
                              TimeFactors::even(0.5)),
            "; estimated first layer printing time (silent mode) = 28s");
  EXPECT_EQ(with_times_scaled("; model printing time: 30m 0s; total estimated time: 1d 2h 0m 10s",
                              TimeFactors::even(0.5)),
            "; model printing time: 15m 0s; total estimated time: 13h 0m 5s");
}

TEST(TimeNote, LeavesAllOtherLinesAlone) {
  for (const char* line :
       {"", "G1 X10 R98", "M730 R5", "M73", "N5 M73 R98*12", "M73 R98*12", "; time to go",
        ";TYPE:Perimeter", ";TIME:", ";TIME:soon", "; printing time unknown",
        "; estimated printing time = 5apples", "M117 printing time = 5m",
        "; thumbnail begin 16x16 700", "; layer_gcode = ; printing time[x]"}) {
    EXPECT_EQ(with_times_scaled(line, TimeFactors::even(2.0)), line);
  }
}

TEST(TimeNote, AFactorOfOneChangesNothing) {
  for (const char* line : {"M73 P10 R88", ";TIME:2789", ";TIME_ELAPSED:376.225026",
                           "; estimated printing time (normal mode) = 1d 1h 38m 3s",
                           "; total estimated time: 7m 44s"}) {
    EXPECT_EQ(with_times_scaled(line, TimeFactors::even(1.0)), line);
  }
}

TEST(TimeNote, ScalesWhatIsGoneAndWhatIsLeftByTheirOwn) {
  const TimeFactors factors{.whole = 2.0, .gone = 3.0, .left = 0.5};
  EXPECT_EQ(with_times_scaled("M73 P5 R10", factors), "M73 P5 R5");
  EXPECT_EQ(with_times_scaled(";TIME_ELAPSED:10.0", factors), ";TIME_ELAPSED:30.0");
  EXPECT_EQ(with_times_scaled(";TIME:10", factors), ";TIME:20");
  EXPECT_EQ(with_times_scaled("; estimated printing time (normal mode) = 5m 0s", factors),
            "; estimated printing time (normal mode) = 10m 0s");
}

TEST(TimeNote, IsToldFromOtherLines) {
  for (const char* line : {"M73 P0 R98", " m73 r5", ";TIME:2789", ";TIME_ELAPSED:3.5",
                           "; estimated printing time (normal mode) = 1h 38m 3s"}) {
    EXPECT_TRUE(tells_time(line)) << line;
  }
  for (const char* line :
       {"", "G1 X1", "M73", "M73 P5", ";TIME_ELAPSED:0", "; time to go", "M117 time"}) {
    EXPECT_FALSE(tells_time(line)) << line;
  }
}

TEST(TimeNote, SameButForTimes) {
  EXPECT_TRUE(same_but_for_times("M73 P1 R97", "M73 P1 R99"));
  EXPECT_FALSE(same_but_for_times("M73 P1 R97", "M73 P2 R97"));
  EXPECT_TRUE(same_but_for_times("; estimated printing time (normal mode) = 59m 59s",
                                 "; estimated printing time (normal mode) = 1h 0m 3s"));
  EXPECT_FALSE(same_but_for_times("; estimated printing time (normal mode) = 59m 59s",
                                  "; estimated printing time (silent mode) = 59m 59s"));
  EXPECT_FALSE(same_but_for_times("G1 X1", "G1 X2"));
}

}  // namespace
}  // namespace unflex::gcode
