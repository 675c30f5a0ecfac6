// Random programs against a model that works the other way round: it tracks the readings of the
// axes and the machine side by side, and never a base position.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

struct Model {
  Position reading{};
  Position machine{};
  bool absolute = true;
  bool absolute_e = true;
  double unit = 1.0;
  double flow = 1.0;
  double feed = 25.0;
  double speed = 1.0;

  void axis(Axis axis, double word) {
    const bool is_absolute = absolute && (axis != E || absolute_e);
    const double value = word * unit;
    const double target = is_absolute ? value : reading[axis] + value;
    machine[axis] += (target - reading[axis]) * (axis == E ? flow : 1.0);
    reading[axis] = target;
  }
};

class ProgramWriter {
 public:
  explicit ProgramWriter(unsigned seed) : random_(seed) {}

  // The next line; `model` follows.
  std::string next(Model& model) {
    switch (pick(12)) {
      case 0:
        model.absolute = pick(2) == 0;
        return model.absolute ? "G90" : "G91";
      case 1:
        model.absolute_e = pick(2) == 0;
        return model.absolute_e ? "M82" : "M83";
      case 2:
        model.unit = pick(4) == 0 ? 25.4 : 1.0;
        return model.unit == 1.0 ? "G21" : "G20";
      case 3: {
        const double percent = 50 + static_cast<double>(pick(100));
        model.flow = percent / 100.0;
        return fmt::format("M221 S{}", percent);
      }
      case 4: {
        const double percent = 50 + static_cast<double>(pick(100));
        model.speed = percent / 100.0;
        return fmt::format("M220 S{}", percent);
      }
      case 5:
        return set_position(model);
      default:
        return move(model);
    }
  }

 private:
  std::size_t pick(std::size_t choices) {
    return std::uniform_int_distribution<std::size_t>(0, choices - 1)(random_);
  }

  double number() {
    return static_cast<double>(std::uniform_int_distribution<int>(-99999, 99999)(random_)) / 1000.0;
  }

  std::string word(char letter, double value) {
    constexpr std::array<std::string_view, 4> kForms = {"{}{}", "{} {}", " {}{:.3f}", "\t{}{:+}"};
    return fmt::format(fmt::runtime(kForms[pick(kForms.size())]), letter, value);
  }

  std::string set_position(Model& model) {
    std::string line = "G92";
    for (const Axis axis : {X, Y, Z, E}) {
      if (pick(3) == 0) {
        const double value = number();
        line += word("XYZE"[axis], value);
        model.reading[axis] = value * model.unit;
      }
    }
    if (line == "G92") {
      model.reading.fill(0.0);
    }
    return line;
  }

  std::string move(Model& model) {
    std::string line = pick(2) == 0 ? "G1" : "g0";
    for (const Axis axis : {E, Z, X, Y}) {
      if (pick(2) == 0) {
        const double value = number();
        line += word(pick(2) == 0 ? "XYZE"[axis] : "xyze"[axis], value);
        model.axis(axis, value);
      }
    }
    if (pick(3) == 0) {
      const double feed = 1 + static_cast<double>(pick(9000));
      line += word('F', feed);
      model.feed = feed * model.unit / 60.0;
    }
    return line;
  }

  std::mt19937_64 random_;
};

TEST(RandomPrograms, EndWhereAnIndependentModelEnds) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    ProgramWriter writer(seed);
    Model model;
    Interpreter interpreter;
    Position last{};
    for (std::size_t number = 1; number <= 500; ++number) {
      const std::string line = writer.next(model);
      const Event event = interpreter.interpret(Line{line, number});
      ASSERT_EQ(event.warnings.empty(), line != "G20") << line;
      ASSERT_EQ(event.line.text, line);
      for (const Segment& segment : event.segments) {
        ASSERT_EQ(segment.start_mm, last) << line << ", seed " << seed;
        last = segment.end_mm;
        ASSERT_NEAR(segment.feed_mm_s, model.feed * model.speed, 1e-9) << line;
      }
      for (const Axis axis : {X, Y, Z, E}) {
        ASSERT_NEAR(interpreter.state().position_mm[axis], model.machine[axis], 1e-6)
            << line << ", seed " << seed << ", line " << number << ", axis " << axis;
      }
    }
  }
}

TEST(RandomPrograms, MeanTheSameInAbsoluteAndRelativeWords) {
  std::mt19937_64 random(4);
  std::uniform_int_distribution<int> step(-20000, 20000);
  Session absolute;
  Session relative;
  absolute.read("G90\nM82\nG1 X0.001 Y0 Z0 E0");
  relative.read("G1 X0.001 Y0 Z0 E0\nG91\nM83");
  std::array<int, 4> at = {1, 0, 0, 0};  // µm
  for (int i = 0; i < 2000; ++i) {
    std::string to = "G1";
    std::string by = "G1";
    for (const Axis axis : {X, Y, Z, E}) {
      const int delta = step(random);
      at[axis] += delta;
      to += fmt::format(" {}{}", "XYZE"[axis], at[axis] / 1000.0);
      by += fmt::format(" {}{}", "XYZE"[axis], delta / 1000.0);
    }
    const Segment one = absolute.move(to);
    const Segment other = relative.move(by);
    for (const Axis axis : {X, Y, Z, E}) {
      ASSERT_NEAR(one.end_mm[axis], other.end_mm[axis], 1e-9);
      ASSERT_NEAR(one.delta(axis), other.delta(axis), 1e-9);
    }
    ASSERT_EQ(one.start_known, other.start_known);
  }
}

}  // namespace
}  // namespace unflex::gcode
