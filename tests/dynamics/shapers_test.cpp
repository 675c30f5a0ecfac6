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
  Shaper shaper;
  double freq_hz;
  double zeta;
  ShaperPulses pulses;
};

void PrintTo(const Recorded& r, std::ostream* out) {
  *out << name(r.shaper.kind) << " of " << r.shaper.form.pulses << " ζ " << r.zeta;
}

class KlippersPulses : public ::testing::TestWithParam<Recorded> {};

// The pulses that klippy/extras/shaper_defs.py returns, normalised and shifted to their mean.
TEST_P(KlippersPulses, AreReproduced) {
  const Recorded& recorded = GetParam();
  const auto pulses = shaper_pulses(recorded.shaper, recorded.freq_hz, recorded.zeta);
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

// With parameters, as init_shaper() of commit 84104bb returns them, called with the type as text.
INSTANTIATE_TEST_SUITE_P(Generalised, KlippersPulses,
                         ::testing::Values(Recorded{mzv_form("mzv(n=4,t=0.9)").value(),
                                                    45.0,
                                                    0.1,
                                                    {{-0.008771729207, 0.249190276287},
                                                     {-0.002071477105, 0.333613596476},
                                                     {0.004628774997, 0.276037923829},
                                                     {0.011329027098, 0.141158203407}}},
                                           Recorded{mzv_form("mzv(n=5,t=1.1)").value(),
                                                    60.0,
                                                    0.06,
                                                    {{-0.008520096743, 0.139661507072},
                                                     {-0.003928491068, 0.263712430687},
                                                     {0.000663114608, 0.290193179662},
                                                     {0.005254720283, 0.214249213104},
                                                     {0.009846325958, 0.092183669475}}},
                                           Recorded{mzv_form("mzv(n=6,t=1.0)").value(),
                                                    38.0,
                                                    0.0,
                                                    {{-0.013157894737, 0.113933354134},
                                                     {-0.007894736842, 0.177455359435},
                                                     {-0.002631578947, 0.208611286432},
                                                     {0.002631578947, 0.208611286432},
                                                     {0.007894736842, 0.177455359435},
                                                     {0.013157894737, 0.113933354134}}},
                                           Recorded{mzv_form("mzv(n=3,t=0.8)").value(),
                                                    50.0,
                                                    0.15,
                                                    {{-0.006412666688, 0.388875827972},
                                                     {0.001678881111, 0.429734124618},
                                                     {0.009770428910, 0.181390047410}}},
                                           Recorded{mzv_form("mzv(n=10,t=1.4)").value(),
                                                    40.0,
                                                    0.05,
                                                    {{-0.016610044015, 0.033968063306},
                                                     {-0.012716284882, 0.078607894996},
                                                     {-0.008822525748, 0.120489952335},
                                                     {-0.004928766614, 0.150001291345},
                                                     {-0.001035007481, 0.161552716742},
                                                     {0.002858751653, 0.153838151965},
                                                     {0.006752510786, 0.129522244936},
                                                     {0.010646269920, 0.094340847809},
                                                     {0.014540029054, 0.055810342247},
                                                     {0.018433788187, 0.021868494319}}},
                                           Recorded{mzv_form("mzv(n=5,tau=1.5)").value(),
                                                    45.0,
                                                    0.1,
                                                    {{-0.009821663439, 0.180244126757},
                                                     {-0.004238120021, 0.266599455470},
                                                     {0.001345423397, 0.262885198853},
                                                     {0.006928966815, 0.194417016872},
                                                     {0.012512510233, 0.095854202048}}},
                                           Recorded{mzv_form("mzv(5,0.6)").value(),
                                                    22.2,
                                                    0.1,
                                                    {{-0.011667027007, 0.414893331273},
                                                     {-0.004876230958, 0.117264612973},
                                                     {0.001914565091, 0.086770634908},
                                                     {0.008705361140, 0.097026861751},
                                                     {0.015496157189, 0.284044559095}}},
                                           Recorded{mzv_form("mzv(n=4)").value(),
                                                    45.0,
                                                    0.1,
                                                    {{-0.007281173240, 0.311919455623},
                                                     {-0.001697629822, 0.266366726031},
                                                     {0.003885913596, 0.227466518863},
                                                     {0.009469457014, 0.194247299483}}}));

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

// The zeros that Klipper places: at the vibration's frequency and, without damping, n − 2 more, 1/τ
// of it apart, with τ the duration for n → ∞.
TEST(MzvForm, HasItsZerosWhereKlipperPlacesThem) {
  for (const MzvForm form : {MzvForm{4, 0.9}, {5, 1.1}, {6, 1.0}, {10, 1.4}, {3, 0.6}, {7, 0.5}}) {
    for (const double zeta : {0.0, 0.06, 0.15, 0.5}) {
      const ShaperPulses pulses = *shaper_pulses(form, 45.0, zeta);
      EXPECT_NEAR(residual(pulses, 45.0, zeta), 0.0, 1e-12) << form.pulses << ' ' << zeta;
      double sum = 0.0;
      double mean_s = 0.0;
      for (const Pulse& pulse : pulses) {
        EXPECT_GE(pulse.weight, -1e-15);
        sum += pulse.weight;
        mean_s += pulse.weight * pulse.time_s;
      }
      EXPECT_NEAR(sum, 1.0, 1e-14);
      EXPECT_NEAR(mean_s, 0.0, 1e-15);
    }
    const int n = form.pulses;
    const double tau = form.duration_periods * (n - 2.0) / (n - 2.0 * form.duration_periods - 1.0);
    for (int i = 0; i < n - 1; ++i) {
      EXPECT_NEAR(residual(*shaper_pulses(form, 45.0, 0.0), 45.0 * (1.0 + i / tau), 0.0), 0.0,
                  1e-12)
          << n << ' ' << i;
    }
  }
}

void expect_same(const ShaperPulses& a, const ShaperPulses& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i].time_s, b[i].time_s, tolerance);
    EXPECT_NEAR(a[i].weight, b[i].weight, tolerance);
  }
}

// Over half a period it is ZV, however many pulses there are between the two; near the longest time
// with three pulses it is ZVD.
TEST(MzvForm, ReachesFromZvToRepeatedZv) {
  const ShaperPulses zv = *shaper_pulses(ShaperKind::zv, 45.0, 0.1);
  const ShaperPulses shortest = *shaper_pulses(MzvForm{6, 0.5}, 45.0, 0.1);
  expect_same({shortest.front(), shortest.back()}, zv, 1e-12);
  for (std::size_t i = 1; i + 1 < shortest.size(); ++i) {
    EXPECT_NEAR(shortest[i].weight, 0.0, 1e-12);
  }
  expect_same(*shaper_pulses(MzvForm{3, 1.0 - 1e-6}, 45.0, 0.1),
              *shaper_pulses(ShaperKind::zvd, 45.0, 0.1), 1e-6);
  expect_same(*shaper_pulses(MzvForm{4, 1.5 - 1e-6}, 45.0, 0.1),
              *shaper_pulses(ShaperKind::zvdd, 45.0, 0.1), 1e-6);
}

TEST(MzvForm, IsReadAsKlipperWritesIt) {
  EXPECT_EQ(mzv_form("mzv"), MzvForm{});
  EXPECT_EQ(mzv_form("mzv()"), MzvForm{});
  EXPECT_EQ(mzv_form("mzv(n=3)"), MzvForm{});
  EXPECT_EQ(mzv_form("mzv ( n = 4, t = 0.9 )"), (MzvForm{4, 0.9}));
  EXPECT_EQ(mzv_form("mzv(t=1.1,n=5)"), (MzvForm{5, 1.1}));
  EXPECT_EQ(mzv_form("mzv(6, 1)"), (MzvForm{6, 1.0}));
  EXPECT_EQ(mzv_form("mzv(4,tau=1)"), std::nullopt) << "mixed";
  EXPECT_EQ(mzv_form("mzv(4,0,0.5)"), (MzvForm{4, 0.5}));
  const auto of_tau = mzv_form("mzv(n=5,tau=1.5)");
  ASSERT_TRUE(of_tau.has_value());
  EXPECT_DOUBLE_EQ(of_tau->duration_periods, 1.5 * 4.0 / 6.0);
}

TEST(MzvForm, ThatKlipperRefusesIsNone) {
  for (const char* const text :
       {"", "zv", "ei(v_tol=0.1)", "smooth_mzv", "mzv(", "mzv(n=4", "mzv n=4", "mzv(n=x)",
        "mzv(m=4)", "mzv(n=4,t=0.9,tau=1,1)", "mzv(n=4.5)", "mzv(n=-4)", "mzv(n=2)", "mzv(n=11)",
        "mzv(t=0.49)", "mzv(n=3,t=1.0)", "mzv(n=4,t=1.5)"}) {
    EXPECT_EQ(mzv_form(text), std::nullopt) << text;
  }
  EXPECT_FALSE(shaper_pulses(MzvForm{2, 0.5}, 45.0, 0.1).has_value());
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
