// Random programs for Marlin and RepRapFirmware against a model that tracks the readings of the
// axes and the machine side by side, and never a base position.
#pragma once

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "interpreting.hpp"

namespace unflex::gcode {

struct DialectModel {
  Firmware firmware;
  Position reading{};
  Position machine{};
  bool relative = false;
  bool e_relative = false;
  double unit = 1.0;
  double feed = 0.0;  // mm/s
  double speed = 1.0;
  double flow = 1.0;
  double area = 1.0;  // cross section of the filament, if E is a volume
  bool retracted = false;
  double hop = 0.0;

  [[nodiscard]] bool is_marlin() const { return firmware == Firmware::marlin; }
};

// Writes line by line; the model follows.
class DialectWriter {
 public:
  static constexpr double kLength_mm = 1.5;
  static constexpr double kExtra_mm = 0.25;
  static constexpr double kHop_mm = 0.4;

  DialectWriter(Firmware firmware, unsigned seed) : random_(seed) {
    model_.firmware = firmware;
    model_.feed = default_feed();
  }

  [[nodiscard]] const DialectModel& model() const { return model_; }

  std::string next() {
    switch (pick(14)) {
      case 0:
        return distance_mode();
      case 1:
        model_.e_relative = pick(2) == 0;
        return model_.e_relative ? "M83" : "M82";
      case 2:
        return factor(220, model_.speed);
      case 3:
        return factor(221, model_.flow);
      case 4:
        return set_position();
      case 5:
        return volumetric();
      case 6:
        return retraction();
      default:
        return move();
    }
  }

 private:
  [[nodiscard]] double default_feed() const {
    return model_.is_marlin() ? 4000.0 / 60.0 : 3000.0 / 60.0;
  }

  std::size_t pick(std::size_t choices) {
    return std::uniform_int_distribution<std::size_t>(0, choices - 1)(random_);
  }

  double number() {
    return static_cast<double>(std::uniform_int_distribution<int>(-99999, 99999)(random_)) / 1000.0;
  }

  // For E, Marlin uses the later one of G90/G91 and M82/M83. RepRapFirmware uses only M82/M83.
  std::string distance_mode() {
    model_.relative = pick(2) == 0;
    if (model_.is_marlin()) {
      model_.e_relative = model_.relative;
    }
    return model_.relative ? "G91" : "G90";
  }

  std::string factor(int code, double& target) {
    const double percent = 50.0 + static_cast<double>(pick(100));
    target = percent / 100.0;
    return fmt::format("M{} S{}", code, percent);
  }

  std::string volumetric() {
    if (pick(2) == 0) {
      model_.area = 1.0;
      return "M200 S0";
    }
    const double diameter = 1.5 + 0.01 * static_cast<double>(pick(50));
    model_.area = std::numbers::pi * diameter * diameter / 4.0;
    return fmt::format("M200 S1 D{}", diameter);
  }

  std::string retraction() {
    const bool retract = pick(2) == 0;
    if (retract != model_.retracted) {
      model_.retracted = retract;
      model_.machine[E] += retract ? -kLength_mm : kLength_mm + kExtra_mm;
      model_.machine[Z] += retract ? kHop_mm : -kHop_mm;
    }
    return retract ? "G10" : "G11";
  }

  // A bare G92 does nothing.
  std::string set_position() {
    std::string line = "G92";
    for (const Axis axis : {X, Y, Z, E}) {
      if (pick(3) == 0) {
        model_.reading[axis] = number();
        line += fmt::format(" {}{}", "XYZE"[axis], model_.reading[axis]);
      }
    }
    return line;
  }

  std::string move() {
    std::string line = pick(2) == 0 ? "G1" : "G0";
    Position delta{};
    bool axes = false;
    for (const Axis axis : {E, Z, X, Y}) {
      if (pick(2) == 0) {
        const double value = number();
        const bool relative = axis == E ? model_.e_relative : model_.relative;
        delta[axis] = relative ? value : value - model_.reading[axis];
        // In RepRapFirmware relative moves do not change the reading of E.
        model_.reading[axis] += relative && axis == E && !model_.is_marlin() ? 0.0 : delta[axis];
        axes = axes || axis != E;
        line += fmt::format(" {}{}", "XYZE"[axis], value);
      }
    }
    if (pick(3) == 0) {
      const double feed = 1.0 + static_cast<double>(pick(9000));
      line += fmt::format(" F{}", feed);
      model_.feed = feed / 60.0;
    }
    // RepRapFirmware does not scale moves of E alone.
    scaled_ = model_.is_marlin() || axes;
    for (const Axis axis : {X, Y, Z}) {
      model_.machine[axis] += delta[axis];
    }
    model_.machine[E] += delta[E] * (scaled_ ? model_.flow : 1.0) / model_.area;
    return line;
  }

 public:
  [[nodiscard]] double feed_mm_s() const { return model_.feed * (scaled_ ? model_.speed : 1.0); }

 private:
  DialectModel model_{};
  std::mt19937_64 random_;
  bool scaled_ = true;
};

inline void expect_random_programs_agree(Firmware firmware) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    InterpreterOptions options = default_options(firmware);
    options.firmware_retraction = true;
    options.retract_length_mm = DialectWriter::kLength_mm;
    options.unretract_extra_length_mm = DialectWriter::kExtra_mm;
    options.retract_z_hop_mm = DialectWriter::kHop_mm;
    Interpreter interpreter(options);
    DialectWriter writer(firmware, seed);
    Position last{};
    for (std::size_t number = 1; number <= 500; ++number) {
      const std::string line = writer.next();
      const Event event = interpreter.interpret(Line{line, number});
      ASSERT_TRUE(event.warnings.empty()) << line;
      const bool is_move = line.starts_with("G0") || (line.starts_with("G1") && line[2] == ' ');
      for (const Segment& segment : event.segments) {
        ASSERT_EQ(segment.start_mm, last) << line << ", seed " << seed;
        last = segment.end_mm;
        if (is_move) {
          ASSERT_NEAR(segment.feed_mm_s, writer.feed_mm_s(), 1e-9) << line;
        }
      }
      for (const Axis axis : {X, Y, Z, E}) {
        ASSERT_NEAR(interpreter.state().position_mm[axis], writer.model().machine[axis], 1e-6)
            << line << ", seed " << seed << ", line " << number << ", axis " << axis;
      }
    }
  }
}

}  // namespace unflex::gcode
