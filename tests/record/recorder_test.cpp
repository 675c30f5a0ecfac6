#include "unflex/record/recorder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "record/decoded_paths.hpp"
#include "verify/plain_emitter.hpp"

namespace unflex::record {
namespace {

using report::Recording;
using ::testing::ElementsAre;
using ::testing::SizeIs;

// A print of squares and a long wall on every layer.
std::string print(int layers, bool comments = true) {
  std::string text = "G28\nG90\nM83\nM204 S4000\nG1 Z0.3 F600\nG1 X20 Y20 F6000\n";
  for (int layer = 0; layer < layers; ++layer) {
    const double z = 0.3 + 0.2 * layer;
    text += comments ? ";LAYER_CHANGE\n" : "";
    text +=
        fmt::format("G1 Z{} F600\nG1 E1 F1800\n;TYPE:Perimeter\nG1 F{}\n", z, 3000 + 60 * layer);
    text += "G1 X50 Y20 E0.9\nG1 X50 Y50 E0.9\nG1 X20 Y50 E0.9\nG1 X20 Y20 E0.9\n";
    text += ";TYPE:Infill\nG1 X48 Y48 E1.1 F4800\nG1 E-1 F1800\nG1 X20 Y20 F9000\n";
  }
  return text + "M104 S0\n; end\n";
}

verify::Rules rules() {
  verify::Rules result;
  result.nozzle = {dynamics::from_frequency(45.0, 0.06), dynamics::from_frequency(60.0, 0.1)};
  return result;
}

struct Recorded {
  Recorded(const std::string& input, const std::string& output, Options options = {}) {
    options.nozzle = rules().nozzle;
    Recorder recorder(options);
    std::istringstream in(input);
    std::istringstream out(output);
    SilentProgress progress;
    verified = verify::verify(in, "in", out, "out", rules(), progress,
                              {verify::detuned(rules().nozzle), &recorder.observer()})
                   .value();
    recording = recorder.finish(verified);
  }

  verify::VerifyReport verified;
  Recording recording;
};

verify::VerifyReport verified_alone(const std::string& input, const std::string& output) {
  std::istringstream in(input);
  std::istringstream out(output);
  SilentProgress progress;
  return verify::verify(in, "in", out, "out", rules(), progress).value();
}

TEST(Recorder, ChangesNothingOfTheVerification) {
  const std::string input = print(3);
  const std::string output = verify::testing::PlainEmitter().emit(input);
  const verify::VerifyReport with = Recorded(input, output).verified;
  const verify::VerifyReport without = verified_alone(input, output);
  for (const auto& [a, b] : {std::pair{with.measured.uncompensated, without.measured.uncompensated},
                             std::pair{with.measured.compensated, without.measured.compensated}}) {
    EXPECT_EQ(a.all.contour_max_mm, b.all.contour_max_mm);
    EXPECT_EQ(a.all.contour_rms_mm, b.all.contour_rms_mm);
    EXPECT_EQ(a.all.tracking_rms_mm, b.all.tracking_rms_mm);
    EXPECT_EQ(a.all.contour_max_line, b.all.contour_max_line);
    EXPECT_EQ(a.extruding.contour_max_mm, b.extruding.contour_max_mm);
    EXPECT_EQ(a.extruding.contour_rms_mm, b.extruding.contour_rms_mm);
    EXPECT_EQ(a.extruding.duration_s, b.extruding.duration_s);
  }
  EXPECT_EQ(with.violation_count, without.violation_count);
  EXPECT_EQ(with.measured.worst_move_extrusion_error_mm,
            without.measured.worst_move_extrusion_error_mm);
  EXPECT_EQ(with.measured.worst_run_drift_s, without.measured.worst_run_drift_s);
  EXPECT_GT(with.measured.uncompensated.extruding.contour_max_mm, 0.0);
}

TEST(Recorder, LeavesOutWhatPrimesTheNozzle) {
  const std::string prime =
      "G28\nG90\nM83\nM204 S12000\nG1 Z0.3 F600\nG1 X5 Y5 F6000\nG1 X60 Y5 E5 F9000\n"
      "G1 X60 Y8 E.2\nG1 E-1 F1800\n";
  const auto recorded = [](const std::string& input) {
    return Recorded(input, verify::testing::PlainEmitter().emit(input)).recording;
  };
  const Recording with = recorded(prime + print(2));
  EXPECT_EQ(with.start_layers, 1U);
  ASSERT_THAT(with.layers, SizeIs(3));
  ASSERT_FALSE(with.worst_before.empty());
  EXPECT_GT(with.layers[0].spread.before.max_mm, with.worst_before[0].before_mm);
  for (const auto* places : {&with.worst_before, &with.worst_after}) {
    for (const report::Place& place : *places) {
      EXPECT_GE(place.layer, 1U);
    }
  }
  // Without the slicer's marks nobody knows where the print begins.
  const Recording without = recorded(prime + print(2, false));
  EXPECT_EQ(without.start_layers, 0U);
  EXPECT_EQ(without.worst_before[0].layer, 0U);
}

TEST(Recorder, AgreesWithTheVerification) {
  const std::string input = print(4);
  const Recorded recorded(input, verify::testing::PlainEmitter().emit(input));
  const Recording& recording = recorded.recording;
  const verify::DeviationStats& before = recorded.verified.measured.uncompensated.extruding;
  const verify::DeviationStats& after = recorded.verified.measured.compensated.extruding;

  ASSERT_FALSE(recording.worst_before.empty());
  ASSERT_FALSE(recording.worst_after.empty());
  EXPECT_DOUBLE_EQ(recording.worst_before[0].before_mm, before.contour_max_mm);
  EXPECT_EQ(recording.worst_before[0].line, before.contour_max_line);
  EXPECT_DOUBLE_EQ(recording.worst_after[0].after_mm, after.contour_max_mm);
  EXPECT_EQ(recording.worst_after[0].line, after.contour_max_line);

  double histogram_before_s = 0.0;
  double histogram_after_s = 0.0;
  for (const report::HistogramCell& cell : recording.histogram) {
    histogram_before_s += cell.before_s;
    histogram_after_s += cell.after_s;
  }
  EXPECT_NEAR(histogram_before_s, before.duration_s, 1e-9);
  EXPECT_NEAR(histogram_after_s, after.duration_s, 1e-9);

  double duration_s = 0.0;
  double square_before = 0.0;
  double most = 0.0;
  for (const report::FeatureRow& feature : recording.features) {
    duration_s += feature.duration_s;
    square_before += feature.duration_s * std::pow(feature.spread.before.rms_mm, 2);
    most = std::max(most, feature.spread.after.max_mm);
  }
  EXPECT_NEAR(duration_s, before.duration_s, 1e-9);
  EXPECT_NEAR(std::sqrt(square_before / duration_s), before.contour_rms_mm, 1e-9);
  EXPECT_DOUBLE_EQ(most, after.contour_max_mm);

  const auto worst_layer = std::max_element(
      recording.layers.begin(), recording.layers.end(),
      [](const auto& a, const auto& b) { return a.spread.before.max_mm < b.spread.before.max_mm; });
  EXPECT_DOUBLE_EQ(worst_layer->spread.before.max_mm, before.contour_max_mm);
  EXPECT_EQ(static_cast<std::size_t>(worst_layer - recording.layers.begin()),
            recording.worst_before[0].layer);
}

// The two paths that print() lays on every layer, and no others.
void expect_all_paths(const Recording& recording, std::size_t layers) {
  ASSERT_THAT(recording.layers, SizeIs(layers));
  std::size_t from = 0;
  for (const report::LayerRow& layer : recording.layers) {
    const std::vector<testing::DecodedPath> paths =
        testing::decoded(recording.paths.bytes, from, layer.paths_end);
    from = layer.paths_end;
    ASSERT_THAT(paths, SizeIs(2)) << layer.z_mm;
    EXPECT_EQ(recording.features[paths[0].feature].name, "Perimeter");
    EXPECT_EQ(recording.features[paths[1].feature].name, "Infill");
    EXPECT_EQ(paths[0].first_line, layer.first_line);
    EXPECT_EQ(paths[0].last_line, layer.first_line + 3);
    EXPECT_EQ(paths[0].points.front(), (testing::DecodedPoint{20.0, 20.0}));
    EXPECT_EQ(paths[0].points.back().x_mm, 20.0);
    EXPECT_EQ(paths[0].points.back().y_mm, 20.0);
    EXPECT_EQ(paths[1].points.back().x_mm, 48.0);
    unsigned before = 0;
    unsigned after = 0;
    for (const testing::DecodedPath& path : paths) {
      for (std::size_t k = 1; k < path.points.size(); ++k) {
        before = std::max(before, path.points[k].before);
        after = std::max(after, path.points[k].after);
      }
    }
    EXPECT_EQ(before, report::deviation_code(std::pow(layer.spread.before.max_mm, 2)));
    EXPECT_EQ(after, report::deviation_code(std::pow(layer.spread.after.max_mm, 2)));
  }
}

TEST(Recorder, DrawsEveryMoveThatLaysFilamentWithItsDeviation) {
  for (const bool comments : {true, false}) {
    const std::string input = print(3, comments);
    expect_all_paths(Recorded(input, input).recording, 3);
    expect_all_paths(Recorded(input, verify::testing::PlainEmitter().emit(input)).recording, 3);
  }
}

TEST(Recorder, SeesNoDifferenceWhereThereIsNone) {
  const std::string input = print(3);
  const Recording recording = Recorded(input, input).recording;
  EXPECT_EQ(recording.layers[1].spread.before.rms_mm, recording.layers[1].spread.after.rms_mm);
  ASSERT_EQ(recording.worst_before.size(), recording.worst_after.size());
  for (std::size_t i = 0; i < recording.worst_before.size(); ++i) {
    EXPECT_EQ(recording.worst_before[i].line, recording.worst_after[i].line);
    EXPECT_NEAR(recording.worst_before[i].before_mm, recording.worst_before[i].after_mm,
                0.1 * recording.worst_before[i].before_mm);
  }
}

TEST(Recorder, FindsLayersByHeightWhereNoCommentNamesThem) {
  const std::string input = print(5, false);
  const Recorded recorded(input, verify::testing::PlainEmitter().emit(input));
  ASSERT_THAT(recorded.recording.layers, SizeIs(5));
  EXPECT_DOUBLE_EQ(recorded.recording.layers[4].z_mm, 1.1);
}

TEST(Recorder, ShowsBothNozzlesAroundEachPlace) {
  const std::string input = print(4);
  const Recorded recorded(input, verify::testing::PlainEmitter().emit(input));
  for (const auto* const list :
       {&recorded.recording.worst_before, &recorded.recording.worst_after}) {
    for (const report::Place& place : *list) {
      for (const auto* const moments : {&place.before, &place.after}) {
        ASSERT_GT(moments->size(), 100U) << place.line;
        const auto at = std::find_if(moments->begin(), moments->end(),
                                     [](const report::Moment& m) { return m.time_s == 0.0; });
        ASSERT_NE(at, moments->end());
        EXPECT_LT(std::hypot(at->reference_mm.x, at->reference_mm.y), 0.3) << place.line;
        EXPECT_TRUE(
            std::is_sorted(moments->begin(), moments->end(),
                           [](const auto& a, const auto& b) { return a.time_s < b.time_s; }));
      }
      const auto contour_mm = [](const report::Moment& a, const report::Moment& b) {
        return a.contour_mm < b.contour_mm;
      };
      EXPECT_GE(std::max_element(place.before.begin(), place.before.end(), contour_mm)->contour_mm,
                0.9 * place.before_mm);
    }
  }
}

TEST(Recorder, MeasuresOtherFrequenciesAndShapers) {
  const std::string input = print(3);
  const Recorded recorded(input, input);
  const Recording& recording = recorded.recording;
  EXPECT_THAT(recording.frequency_errors, ElementsAre(-0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15));
  ASSERT_THAT(recording.contenders, SizeIs(8));
  EXPECT_EQ(recording.contenders[0].name, "as sliced");
  EXPECT_EQ(recording.contenders[1].name, "unflex");
  EXPECT_EQ(recording.contenders[2].name, "ZV");
  for (const report::Contender& contender : recording.contenders) {
    ASSERT_THAT(contender.spreads, SizeIs(7)) << contender.name;
  }
  const std::vector<report::Spread>& plain = recording.contenders[0].spreads;
  EXPECT_DOUBLE_EQ(plain[3].rms_mm,
                   recorded.verified.measured.uncompensated.extruding.contour_rms_mm);
  // A softer machine swings further.
  EXPECT_GT(plain[0].rms_mm, plain[3].rms_mm);
  EXPECT_GT(plain[3].rms_mm, plain[6].rms_mm);
  // An exact shaper is better than none, and better than one that is off.
  const std::vector<report::Spread>& zv = recording.contenders[2].spreads;
  EXPECT_LT(zv[3].rms_mm, 0.5 * plain[3].rms_mm);
  EXPECT_LT(zv[3].rms_mm, zv[0].rms_mm);
  EXPECT_LT(zv[3].rms_mm, zv[6].rms_mm);
  EXPECT_NEAR(recording.shapers_measured_s,
              recorded.verified.measured.uncompensated.extruding.duration_s, 0.1);
}

TEST(Recorder, DrawsThePrintersOwnShaper) {
  const std::string input = print(3);
  Options options;
  const auto pulses = [](double freq_hz, double damping_ratio) {
    return dynamics::shaper_pulses(dynamics::ShaperKind::ei, freq_hz, damping_ratio).value();
  };
  options.printer_shaper = {"own", pulses(45.0, 0.06), pulses(60.0, 0.1)};
  const std::vector<report::Contender> contenders =
      Recorded(input, input, options).recording.contenders;
  ASSERT_THAT(contenders, SizeIs(9));
  EXPECT_EQ(contenders.back().name, "own");
  std::vector<std::string> drawn;
  for (const report::Contender& contender : contenders) {
    if (contender.drawn) {
      drawn.push_back(contender.name);
    }
  }
  EXPECT_THAT(drawn, ElementsAre("as sliced", "unflex", "ZV", "MZV", "EI", "own"));
}

TEST(Recorder, NeedsNoMoreSpaceForALongPrint) {
  Options options;
  options.paths_bytes = 1500;
  options.places = 3;
  const std::string input = print(60);
  const Recorded recorded(input, input, options);
  EXPECT_LE(recorded.recording.paths.bytes.size(), 1500U);
  EXPECT_THAT(recorded.recording.layers, SizeIs(60));
  EXPECT_THAT(recorded.recording.worst_before, SizeIs(3));
}

TEST(Recorder, OfAnEmptyFileHasNothing) {
  const Recorded recorded("; nothing\n", "; nothing\n");
  EXPECT_TRUE(recorded.recording.layers.empty());
  EXPECT_TRUE(recorded.recording.paths.bytes.empty());
  EXPECT_TRUE(recorded.recording.worst_before.empty());
}

}  // namespace
}  // namespace unflex::record
