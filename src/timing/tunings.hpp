// The numbers that free timing is tuned with, by method: path and time found together
// (OptimalTunings) and scaled limits (ScalingTunings).
//
// Each comment ends with the number's origin. "measured" names where a comparison is written down.
// "chosen" gives the reason for a number about as large. "set by hand" means that no reason is
// written down. A number without a unit in its name is a share or a factor, if its comment says
// nothing else.
#pragma once

#include <array>
#include <cstddef>

#include "excess.hpp"

namespace unflex::timing {

// For optimal.cpp, sections.cpp and section_*. section_search.hpp has the notation.
struct OptimalTunings {
  // --- Sections and their legs ---

  // Even motion is settled this long before and after a change; the time is counted in 1/ω.
  // chosen: a swing has to die down before the path can be cut.
  static constexpr double kSettling_rad = 9.0;
  // Vertices of moves may be this far from the leg that stands for them.
  // set by hand.
  static constexpr double kStraight_mm = 2e-3;
  // They may also be away by no more than this share of the tolerance.
  // chosen: most of the tolerance is left to the nozzle.
  static constexpr double kStraightShare = 0.1;
  // A leg stands for at most this number of moves.
  // chosen: it bounds the time of the check, which looks at all vertices of a leg.
  static constexpr std::size_t kMostMovesOfLeg = 50;
  // The first plan is nowhere slower than this.
  // chosen: a plan that stands still has no end.
  static constexpr double kLeastSpeed_mm_s = 1.0;
  // Even motion shorter than this does not divide the path.
  // chosen: a cut for less is not worth it.
  static constexpr double kShortestPause_s = 5e-3;

  // --- Nodes ---

  // Time from node to node, as ωh.
  // chosen: the matrix for z is too badly conditioned below 0.4.
  // measured: docs/timing.md compares the times with another transcription.
  static constexpr double kNodePeriod_rad = 0.45;
  // A section has at least this number of node periods.
  // set by hand.
  static constexpr std::size_t kFewestPeriods = 18;
  // A path that turns by more has a bound vertex.
  // chosen: 5°, below which a node may belong to either leg.
  static constexpr double kTurn_rad = 0.0873;
  // A bound vertex this close counts for a node, in node periods.
  // set by hand.
  static constexpr double kNearVertex = 2.5;
  // Travel this close to filament keeps the tolerance of filament in the looks between rows, in
  // node periods.
  // chosen: lines do not end exactly where filament does.
  static constexpr double kBesideInLooks = 2.0;
  // The rows ask for that tolerance a little earlier, in node periods.
  // chosen: rows look less often than the looks do.
  static constexpr double kBesideInRows = 2.5;
  // Travel this close to filament keeps the speed of filament, in node periods.
  // chosen: lines do not end exactly where filament does.
  static constexpr double kBesideFeed = 1.5;
  // The end of a section gives the base and its clock for the last periods, which number this many.
  // set by hand.
  static constexpr std::size_t kGivenPeriods = 3;

  // --- Rounds ---

  // A search has at most this number of rounds.
  // set by hand.
  static constexpr int kRounds = 18;
  // A round that gains a smaller share of the time settles the search.
  // chosen: a gain this small is not worth another round.
  static constexpr double kGain = 1e-3;
  // The search settles after this number of rounds without a gain.
  // chosen: a single round may fail by chance.
  static constexpr int kIdleRounds = 2;
  // This number of rounds is solved finely once the search has settled.
  // set by hand.
  static constexpr int kFineRounds = 2;
  // The first, badly conditioned program is solved again for its own residual until this number of
  // solutions is reached.
  // set by hand.
  static constexpr int kFirstSolutions = 3;

  // --- Weights of the squares; lengths and times are in the units of their rows ---

  // r₂.
  // set by hand.
  static constexpr double kBend = 1.0;
  // r₃.
  // chosen: it keeps nodes evenly spread.
  static constexpr double kTwist = 300.0;
  // r₃ for a band of frequencies.
  // set by hand.
  static constexpr double kTwistOfBand = 1000.0;
  // Weight of e², relative to the tolerance.
  // chosen: small beside the time, which is the goal.
  static constexpr double kErrorWeight = 4e-3;
  // Weight of b̈², relative to the limit.
  // chosen: small beside the time, which is the goal.
  static constexpr double kAccelWeight = 1e-2;
  // Weight of the step of every control point.
  // chosen: small, as it only keeps the matrix regular.
  static constexpr double kStepWeight = 1e-6;
  // Weight of the differences that make time go evenly over the last period.
  // chosen: large, since it stands for an equation.
  static constexpr double kEvenClockWeight = 1e5;

  // --- Rows ---

  // ρ: the cost, in node periods, of exceeding a bound by 100 %.
  // chosen: a row holds where its price is above what it costs in time.
  static constexpr double kPrice = 30.0;
  // The trust's rows cost this many times as much.
  // chosen: beyond them the program means nothing.
  static constexpr double kTimesForTrust = 100.0;
  // The rows for the base's place cost this many times as much.
  // chosen: these limits are hard.
  static constexpr double kTimesForReach = 3.0;
  // T′ is at least this.
  // chosen: derivatives by time divide by T′.
  static constexpr double kLeastClock = 0.3;
  // T′ may become smaller by at least this in a round.
  // chosen: a row needs some room.
  static constexpr double kLeastChange = 1e-3;
  // Nodes below this share of F have no row for it.
  // chosen: a nozzle this slow is far from the limit.
  static constexpr double kNearFeed = 0.3;
  // Angle between neighbouring facets of the limit of speed.
  // chosen: the corner between two facets is 1 % farther out.
  static constexpr double kFacet_rad = 0.3;
  // A velocity this close to the direction of its leg needs one facet alone.
  // chosen: the side facets are farther out in that direction.
  static constexpr double kAlong_rad = 0.1;
  // Only a base this close to a limit of its place has a row for it.
  // chosen: farther away the row would only take time.
  static constexpr double kNearReach_mm = 1.0;
  // A row for the base's place counts in this unit.
  // set by hand.
  static constexpr double kReachScale_mm = 0.02;
  // The base keeps this distance from the limits of its place.
  // chosen: the programs break their rows by a hair.
  static constexpr double kRoom_mm = 3e-3;
  // The finished base is moved onto a limit of its place that it exceeds by no more than this.
  // chosen: less than kRoom_mm, and too little to be seen.
  static constexpr double kHair_mm = 1e-3;
  // The allowance beyond a vertex grows with 1/sine of the turn, and this is the factor.
  // chosen: the nozzle is then about one tolerance away from the next leg.
  static constexpr double kTimesSine = 2.0;
  // The sine counts as at least this.
  // chosen: a path that goes nearly straight on would have no bound at all.
  static constexpr double kLeastSine = 0.1;
  // The strip across a sharp turn is this many tolerances wide.
  // chosen: the nozzle cuts a sharp turn short by more.
  static constexpr double kTimesBack = 3.0;
  // Two directions whose sum is shorter than this are opposite.
  // chosen: rounding leaves less.
  static constexpr double kAllBack = 1e-6;

  // --- Gap per unknown at which a program counts as solved ---

  // As long as the limits are broken by a lot.
  // chosen: the next program is quite another one.
  static constexpr double kFirstGap = 0.05;
  // As long as the search goes on.
  // chosen: the next program is another one.
  static constexpr double kRoughGap = 1e-3;
  // As long as the search goes on, for a band of frequencies.
  // set by hand.
  static constexpr double kRoughGapOfBand = 1e-2;
  // In the last rounds and in the first plan.
  // chosen: the result is kept.
  static constexpr double kFineGap = 1e-4;

  // --- Trust: the share by which T′ may change in a round ---

  // In the first round.
  // chosen: the program does not foresee the second order, which goes with the square of a step.
  static constexpr double kFirstTrust = 0.3;
  // In the first round for a band of frequencies.
  // set by hand.
  static constexpr double kFirstTrustOfBand = 0.12;
  // At least.
  // chosen: a search without any trust could not go on.
  static constexpr double kLeastTrust = 1e-3;
  // The next step is to come out otherwise than foreseen by this share of the limit.
  // set by hand.
  static constexpr double kSurprise = 0.15;
  // The trust shrinks to at least this share in a round.
  // set by hand.
  static constexpr double kShrink = 0.25;
  // The trust grows by at most this factor in a round.
  // set by hand.
  static constexpr double kGrow = 1.6;
  // The largest trust shrinks by this factor from round to round.
  // chosen: it makes the search settle.
  static constexpr double kCooling = 0.85;
  // A node's trust depends on surprises up to this number of nodes away.
  // set by hand.
  static constexpr std::size_t kReach = 8;
  // Where the excess is above this, T′ may always grow by kTrustToSlow.
  // chosen: slower motion breaks less.
  static constexpr double kBroken = 1.1;
  static constexpr double kTrustToSlow = 0.1;

  // --- Tightening of rows that stay broken ---

  // Rows aim at these shares of the limits at first.
  // chosen: only the acceleration leaves room, for what is between the rows.
  static constexpr Excess kAim{0.985, 1.0, 1.0};
  // An excess up to here counts as kept.
  // chosen: within what the measure of the finished motion lets pass (nozzle_measure.hpp).
  static constexpr Excess kKept{1.025, 1.03, 1.015};
  // Rows above this excess are tightened.
  // chosen: below kKept, so that rows come to lie within it.
  static constexpr Excess kTightenAbove{1.01, 1.0, 1.013};
  // Rows are tightened to at least these shares of the limits.
  // chosen: a place that never comes right is not to slow down without bound.
  static constexpr Excess kTightest{0.8, 0.6, 0.95};
  // Rows that are broken by more are not tightened.
  // chosen: the reason is elsewhere then.
  static constexpr double kMostTightening = 1.3;
  // The search is stuck if the largest excess changes by a smaller share in a round.
  // chosen: an excess that hardly changes does not come right any more.
  static constexpr double kStuck = 0.01;
  // The search cannot be stuck before this round.
  // chosen: the first rounds go far.
  static constexpr int kRoundsToSettle = 4;
  // Rows are tightened from this round on.
  // chosen: the first rounds are rough.
  static constexpr int kFirstRoughRounds = 2;

  // --- Swing behind the end, for a band of frequencies ---

  // The acceleration is lowered over this number of periods before the end.
  // chosen: the swing in the end cannot be chosen there, so it is made less before.
  static constexpr std::size_t kNodesBeforeEnd = 80;
  // It is lowered to at least this share.
  // chosen: a place that never comes right is not to slow down without bound.
  static constexpr double kTightestBeforeEnd = 0.25;
  // It changes by at least and by at most these factors in a round.
  // chosen: it goes down quickly and comes up slowly.
  static constexpr double kTighter = 0.5;
  static constexpr double kLooser = 1.1;

  // --- Finished motion ---

  // The error may exceed the measure's bound by this, relative to the tolerance.
  // chosen: a single place that is a little worse than in the programs is no reason to try again.
  static constexpr double kMoreError = 0.03;
  // The speed may exceed the measure's bound by this, relative to F.
  // chosen: as for kMoreError.
  static constexpr double kMoreSpeed = 0.05;
};

// For local_scaling.cpp, scaled_limits.cpp and model_shares.cpp. local_scaling.cpp has the
// notation.
struct ScalingTunings {
  // --- Rounds ---

  // Limits may rise in at least this number of rounds.
  // set by hand.
  static constexpr int kLeastRounds = 3;
  // Limits may rise in at most this number of rounds.
  // set by hand.
  static constexpr int kRounds = 10;
  // Limits are lowered only in at most this number of rounds, called repairs.
  // chosen: a run that is still broken then keeps its timing.
  static constexpr int kRepairs = 20;
  // A round that changes the plan's time by a smaller share is the last of its kind.
  // chosen: a gain this small is not worth another round.
  static constexpr double kGain = 1e-3;
  // A timing that lasts this many times as long as the sliced one is still taken.
  // chosen: where F is slow, the nozzle may run ahead of it in the timing as sliced.
  static constexpr double kHardlySlower = 1.01;
  // With each repair the error may be larger by this, relative to the tolerance.
  // chosen: each repair moves all nodes behind it, which may break a bound by a hair.
  static constexpr double kMoreError = 0.002;
  // With each repair the speed may be larger by this, relative to F.
  // chosen: as for kMoreError.
  static constexpr double kMoreSpeed = 0.00002;

  // --- Exponents ---

  // α, β and γ at first.
  // set by hand.
  static constexpr double kAlpha = 0.45;
  static constexpr double kBeta = 0.2;
  static constexpr double kGamma = 0.5;
  // α and β shrink by this factor from round to round.
  // chosen: smaller changes make the rounds settle.
  static constexpr double kCooling = 0.87;
  // α and β of the repairs.
  // chosen: repairs are in more of a hurry.
  static constexpr double kAlphaOfRepairs = 0.8;
  static constexpr double kBetaOfRepairs = 0.5;

  // --- Change of a limit in a round ---

  // Accelerations, and speeds at vertices, change by at least and at most these factors.
  // set by hand.
  static constexpr double kLeastFactor = 0.6;
  static constexpr double kMostFactor = 1.3;
  // The speed on a piece changes by at least and at most these factors for F.
  // set by hand.
  static constexpr double kLeastSpeedFactor = 0.8;
  static constexpr double kMostSpeedFactor = 1.05;
  // No speed becomes smaller than this.
  // chosen: a plan that stands still has no end.
  static constexpr double kLeastSpeed_mm_s = 1.0;
  // A smaller error counts as this, relative to the tolerance.
  // chosen: a negative power of 0 would be infinite.
  static constexpr double kLeastError = 1e-3;
  // All limits change by this factor where the engine finds no base.
  // set by hand.
  static constexpr double kSlower = 0.7;
  // A vertex passed at more than this share of its limit is bound by it.
  // set by hand.
  static constexpr double kBoundShare = 0.97;
  // A piece cruised at more than this share of its limit is bound by it.
  // set by hand.
  static constexpr double kBoundSpeedShare = 0.99;
  // The speed at a vertex begins where a corner asks for this share of the acceleration.
  // set by hand.
  static constexpr double kCornerShare = 0.5;

  // --- Aims ---

  // The error aimed at, relative to the tolerance.
  // chosen: a little below 1, so that rounds end within it.
  static constexpr double kAim = 0.97;
  // The nozzle's speed aimed at, relative to F.
  // chosen: a little below what counts as kept (nozzle_measure.hpp).
  static constexpr double kAimOfFeed = 1.014;
  // A larger swing in the end counts as this, relative to the allowance.
  // set by hand.
  static constexpr double kMostLeft = 4.0;
  // A model may stray further than as sliced by this factor, where it breaks its tolerance there.
  // chosen: looks at another timing fall on other places.
  static constexpr double kSampling = 1.02;

  // --- Reach of an error: limits this close answer for it ---

  // Reach of the contour error, in 1/ω.
  // set by hand.
  static constexpr double kErrorReach_rad = 2.3;
  // It grows by this share from repair to repair.
  // chosen: repairs reach further from round to round.
  static constexpr double kWider = 0.25;
  // Reach of the speed, in 1/ω.
  // set by hand.
  static constexpr double kSpeedReach_rad = 1.1;
  // Reach of the swing in the end, in 1/ω.
  // set by hand.
  static constexpr double kEndReach_rad = 3.4;
  // Reach of the width, on either side.
  // chosen: the width depends on accelerations that far in time.
  static constexpr double kWidthReach_s = 0.02;
  // After this number of repairs by accelerations alone, the width makes speeds smaller as well.
  // chosen: smaller accelerations should help first, since a slower corner asks more of the
  // extruder.
  static constexpr int kMendsByAccel = 4;

  // --- Pieces: their lengths from both ends of a move, in 1/ω ---

  // chosen: the reaches of speed and of error.
  static constexpr std::array kPieces_rad = {1.1, 2.3};
  // For runs that are slow on long lines.
  // chosen: with a third piece a swing behind a corner does not slow down the rest of a long line.
  // Speeds that change more often make swings of their own, so it is not the rule.
  static constexpr std::array kMorePieces_rad = {1.1, 2.3, 5.0};
  // For runs that keep their timing but for F.
  // chosen: the nozzle runs ahead of F only for a moment, at vertices and behind them.
  static constexpr std::array kFeedPieces_rad = {1.1, 2.3, 5.0, 10.0};
  // Long lines below their speed matter if they cost more than this share of the time.
  // set by hand.
  static constexpr double kLossThatMatters = 0.04;
  // A part of a run keeps its timing this long before and after its neighbours.
  // chosen: neighbours are solved by themselves.
  static constexpr double kSeam_s = 0.3;

  // --- Shares of the models ---

  // Errors on the pieces are compared by their power mean with this exponent.
  // set by hand.
  static constexpr double kPower = 4.0;
  // A model with twice the mean error gets 2 to this power times its share.
  // set by hand.
  static constexpr double kResponse = 1.5;
  // A share is multiplied by at most this in all, and divided by at most this.
  // set by hand.
  static constexpr double kMostShareFactor = 50.0;
  // A plant is left out where its share of the sum is below this.
  // set by hand.
  static constexpr double kHardlyAny = 0.02;
};

}  // namespace unflex::timing
