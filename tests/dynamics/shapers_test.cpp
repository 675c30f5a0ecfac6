#include "unflex/dynamics/shapers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <ostream>
#include <vector>

namespace unflex::dynamics {
namespace {

struct Recorded {
  ShaperKind kind;
  double freq_hz;
  double zeta;
  ShaperPulses pulses;
};

void PrintTo(const Recorded& r, std::ostream* out) { *out << name(r.kind) << " ζ " << r.zeta; }

class KlippersPulses : public ::testing::TestWithParam<Recorded> {};

// The pulses that klippy/extras/shaper_defs.py returns, normalised and shifted to their mean.
TEST_P(KlippersPulses, AreReproduced) {
  const Recorded& recorded = GetParam();
  const auto pulses = shaper_pulses(recorded.kind, recorded.freq_hz, recorded.zeta);
  ASSERT_TRUE(pulses.has_value());
  ASSERT_EQ(pulses->size(), recorded.pulses.size());
  for (std::size_t i = 0; i < pulses->size(); ++i) {
    EXPECT_NEAR((*pulses)[i].time_s, recorded.pulses[i].time_s, 1e-11) << i;
    EXPECT_NEAR((*pulses)[i].weight, recorded.pulses[i].weight, 1e-10) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Recordings, KlippersPulses,
                         ::testing::Values(Recorded{ShaperKind::zv,
                                                    45.0,
                                                    0.06,
                                                    {{-0.005041648084, 0.547069155858},
                                                     {0.006089517190, 0.452930844142}}},
                                           Recorded{ShaperKind::zv,
                                                    20.0,
                                                    0.5,
                                                    {{-0.004046635475, 0.859820435146},
                                                     {0.024820877984, 0.140179564854}}},
                                           Recorded{ShaperKind::mzv,
                                                    45.0,
                                                    0.06,
                                                    {{-0.007657514972, 0.335481714106},
                                                     {0.000690858984, 0.411790289727},
                                                     {0.009039232939, 0.252727996167}}},
                                           Recorded{ShaperKind::mzv,
                                                    20.0,
                                                    0.5,
                                                    {{-0.007493880696, 0.699949240280},
                                                     {0.014156754398, 0.253973996459},
                                                     {0.035807389493, 0.046076763260}}},
                                           Recorded{ShaperKind::zvd,
                                                    45.0,
                                                    0.06,
                                                    {{-0.010083296167, 0.299284661291},
                                                     {0.001047869106, 0.495568989134},
                                                     {0.012179034380, 0.205146349575}}},
                                           Recorded{ShaperKind::ei,
                                                    45.0,
                                                    0.06,
                                                    {{-0.010072233433, 0.316221872800},
                                                     {0.001115963071, 0.465071240400},
                                                     {0.012190097114, 0.218706886800}}},
                                           Recorded{ShaperKind::ei,
                                                    20.0,
                                                    0.35,
                                                    {{-0.012104615497, 0.643965280000},
                                                     {0.017156137536, 0.286088602500},
                                                     {0.041271435771, 0.069946117500}}},
                                           Recorded{ShaperKind::two_hump_ei,
                                                    45.0,
                                                    0.06,
                                                    {{-0.014979381798, 0.214341008655},
                                                     {-0.003689614758, 0.357060540819},
                                                     {0.007344539518, 0.301432076382},
                                                     {0.018198457438, 0.127166374144}}},
                                           Recorded{ShaperKind::two_hump_ei,
                                                    20.0,
                                                    0.25,
                                                    {{-0.021901086341, 0.474464945756},
                                                     {0.008195882409, 0.317482800991},
                                                     {0.031708476159, 0.150605565026},
                                                     {0.052462085534, 0.057446688226}}},
                                           Recorded{ShaperKind::three_hump_ei,
                                                    45.0,
                                                    0.06,
                                                    {{-0.019785916655, 0.170267223590},
                                                     {-0.008267283855, 0.265444069123},
                                                     {0.002723337212, 0.280948532290},
                                                     {0.013576582723, 0.195009118466},
                                                     {0.024348395968, 0.088331056531}}},
                                           Recorded{ShaperKind::three_hump_ei,
                                                    20.0,
                                                    0.15,
                                                    {{-0.036482565116, 0.296886591383},
                                                     {-0.007102076366, 0.287086327639},
                                                     {0.016965941134, 0.223675173704},
                                                     {0.039833897384, 0.131311871665},
                                                     {0.062984399259, 0.061040035609}}}));

TEST(Shaper, IsRefusedAboveTheDampingItIsDefinedFor) {
  for (const ShaperKind kind : kShaperKinds) {
    EXPECT_FALSE(shaper_pulses(kind, 45.0, 1.0).has_value()) << name(kind);
    EXPECT_TRUE(shaper_pulses(kind, 45.0, max_damping_ratio(kind)).has_value()) << name(kind);
    EXPECT_FALSE(shaper_pulses(kind, 45.0, max_damping_ratio(kind) + 1e-6).has_value());
  }
}

// The vibration left after the last pulse, as a share of that after a single pulse: |Σ weight ·
// e^{ζωt} e^{iω_d t}| e^{−ζω t_last} (Singer & Seering, eq. 7).
double residual(const ShaperPulses& pulses, double freq_hz, double zeta) {
  const double omega = 2.0 * std::numbers::pi * freq_hz;
  const std::complex<double> pole(zeta * omega, omega * std::sqrt(1.0 - zeta * zeta));
  std::complex<double> sum = 0.0;
  for (const Pulse& pulse : pulses) {
    sum += pulse.weight * std::exp(pole * (pulse.time_s - pulses.back().time_s));
  }
  return std::abs(sum);
}

TEST(Shaper, LeavesNoVibrationOrTheFiveOrTwoPercentThatItAdmits) {
  for (const double zeta : {0.0, 0.06, 0.15}) {
    for (const ShaperKind kind : {ShaperKind::zv, ShaperKind::mzv, ShaperKind::zvd}) {
      EXPECT_NEAR(residual(*shaper_pulses(kind, 45.0, zeta), 45.0, zeta), 0.0, 1e-12);
    }
    for (const ShaperKind kind :
         {ShaperKind::ei, ShaperKind::two_hump_ei, ShaperKind::three_hump_ei}) {
      EXPECT_LE(residual(*shaper_pulses(kind, 45.0, zeta), 45.0, zeta), 0.052) << name(kind);
    }
  }
}

// The wider a shaper's notch, the more frequency error it stands.
TEST(Shaper, WithMoreHumpsStandsMoreFrequencyError) {
  const auto left = [](ShaperKind kind, double error) {
    return residual(*shaper_pulses(kind, 45.0, 0.0), 45.0 * (1.0 + error), 0.0);
  };
  EXPECT_NEAR(left(ShaperKind::zv, 0.1), std::sin(0.05 * std::numbers::pi), 1e-12);
  EXPECT_LT(left(ShaperKind::zvd, 0.1), 0.2 * left(ShaperKind::zv, 0.1));
  EXPECT_GT(left(ShaperKind::ei, 0.3), left(ShaperKind::two_hump_ei, 0.3));
  EXPECT_GT(left(ShaperKind::two_hump_ei, 0.4), left(ShaperKind::three_hump_ei, 0.4));
}

}  // namespace
}  // namespace unflex::dynamics
