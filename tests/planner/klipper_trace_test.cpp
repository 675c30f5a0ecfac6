// The plan of real prints against what Klipper's own host code planned for them.
//
// The traces' printer: max_velocity 300, max_accel 5000, square_corner_velocity 5,
// minimum_cruise_ratio 0.5, no Z limits, instantaneous_corner_velocity 1. Klipper ran in its batch
// mode: G28 and commands unknown to it (macros, G10, G11, G29) are skipped and nothing waits for a
// temperature. The first SET_PRESSURE_ADVANCE of a printer that had none stops it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "paths.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/planner/klipper_planner.hpp"
#include "whole_prints.hpp"

namespace unflex::planner {
namespace {

namespace fs = std::filesystem;

struct Plan {
  std::vector<PlannedMove> moves;
  double dwell_s = 0.0;     // between the first and the last move
  double duration_s = 0.0;  // from the first to the end of the last move
  double moving_s = 0.0;    // of moves with X, Y or Z
  std::size_t xyz_moves = 0;
  std::size_t e_moves = 0;
};

// Klipper restarts this much later after a stop that changes the extruder's smoothing: half of the
// 40 ms of pressure_advance_smooth_time and 1 ms.
constexpr double kSmoothingRestart_s = 0.021;

bool begins_with(const gcode::Line& line, std::string_view word) {
  return line.content().substr(0, word.size()) == word;
}

// How long the traced printer stops for a line; none if it moves on.
std::optional<double> stop_s(const gcode::Event& event, bool& pressure_advance) {
  if (begins_with(event.line, "SET_PRESSURE_ADVANCE") && !pressure_advance) {
    pressure_advance = true;
    return kSmoothingRestart_s;
  }
  if (event.kind != gcode::EventKind::barrier || event.position_lost) return std::nullopt;
  if (begins_with(event.line, "M109") || begins_with(event.line, "M190")) return std::nullopt;
  return event.dwell_s;
}

Plan plan_file(const fs::path& path) {
  Plan plan;
  std::ifstream stream(path, std::ios::binary);
  EXPECT_TRUE(stream.good()) << path;
  gcode::InterpreterOptions options;
  options.firmware_retraction = false;
  gcode::Interpreter interpreter(options);
  gcode::LineReader reader(stream, path.string());
  KlipperPlanner planner(Limits{}, FirmwareConfig{});
  gcode::Line line;
  double dwell_since_last_move_s = 0.0;
  bool pressure_advance = false;
  while (reader.next(line).value_or(false)) {
    const gcode::Event event = interpreter.interpret(line);
    if (event.kind == gcode::EventKind::limits) planner.apply(*event.limits);
    for (const gcode::Segment& segment : event.segments) {
      if (!planner.add(segment)) continue;
      if (planner.pending() + plan.moves.size() > 1) plan.dwell_s += dwell_since_last_move_s;
      dwell_since_last_move_s = 0.0;
    }
    if (const auto stop = stop_s(event, pressure_advance)) {
      planner.stop();
      dwell_since_last_move_s += *stop;
    }
    planner.take(plan.moves);
  }
  planner.stop();
  planner.take(plan.moves);
  for (const PlannedMove& move : plan.moves) {
    plan.duration_s += move.duration_s();
    if (move.kinematic) plan.moving_s += move.duration_s();
    plan.xyz_moves += move.kinematic ? 1 : 0;
    plan.e_moves += move.segment.delta(gcode::E) != 0.0 ? 1 : 0;
  }
  plan.duration_s += plan.dwell_s;
  return plan;
}

std::vector<std::string> split(const std::string& row) {
  std::vector<std::string> cells;
  std::stringstream stream(row);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

// The traces write small numbers with exponents.
double number(const std::string& cell) { return std::strtod(cell.c_str(), nullptr); }

// The rows of a trace: t, accel_t, cruise_t, decel_t, start x y z, direction x y z, start_v,
// cruise_v, accel.
using Row = std::array<double, 13>;

std::vector<Row> parse_trace(const std::string& text) {
  std::vector<Row> rows;
  std::stringstream stream(text);
  std::string row;
  std::getline(stream, row);
  while (std::getline(stream, row)) {
    const auto cells = split(row);
    EXPECT_EQ(cells.size(), std::tuple_size_v<Row>);
    Row& values = rows.emplace_back();
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = number(cells[i]);
  }
  return rows;
}

std::string read_text(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string read_gz(const fs::path& path) {
  const std::string command = "zcat '" + path.string() + "'";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string text;
  if (!pipe) return text;
  std::array<char, 65536> block{};
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe.get())) {
    text.append(block.data(), count);
  }
  return text;
}

struct Mismatch {
  double worst_phase_s = 0.0;
  std::size_t phases_off = 0;  // moves with a phase that is off by more than 1 µs
};

// Compares the first `rows.size()` moves of the plan with a trace of nine significant digits.
Mismatch compare(const Plan& plan, const std::vector<Row>& rows) {
  Mismatch mismatch;
  std::size_t i = 0;
  for (const PlannedMove& move : plan.moves) {
    if (!move.kinematic) continue;
    if (i == rows.size()) break;
    const Row& row = rows[i++];
    const double off = std::max({std::abs(move.accel_s - row[1]), std::abs(move.cruise_s - row[2]),
                                 std::abs(move.decel_s - row[3])});
    mismatch.worst_phase_s = std::max(mismatch.worst_phase_s, off);
    if (off > 1e-6) ++mismatch.phases_off;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(move.segment.start_mm[axis], row[4 + axis], 1e-6) << "move " << i;
      EXPECT_NEAR(move.direction[axis], row[7 + axis], 1e-8) << "move " << i;
    }
    EXPECT_NEAR(move.start_v_mm_s, row[10], 1e-5) << "move " << i;
    EXPECT_NEAR(move.cruise_v_mm_s, row[11], 1e-5) << "move " << i;
    EXPECT_NEAR(move.accel_mm_s2, row[12], 1e-4) << "move " << i;
    if (::testing::Test::HasNonfatalFailure()) break;
  }
  EXPECT_EQ(i, rows.size());
  return mismatch;
}

// The beginnings of two prints, cut a few seconds of motion after the last row.
class CutTrace : public ::testing::TestWithParam<const char*> {};

TEST_P(CutTrace, HasKlippersPhases) {
  const fs::path data = test_paths::kData;
  const std::string name = std::string("planner_") + GetParam();
  const auto rows = parse_trace(read_text(data / (name + ".csv")));
  ASSERT_EQ(rows.size(), 800U);
  const Plan plan = plan_file(data / (name + ".gcode"));
  ASSERT_GT(plan.xyz_moves, rows.size() + 100);
  EXPECT_EQ(compare(plan, rows).phases_off, 0U);
}

INSTANTIATE_TEST_SUITE_P(Klipper, CutTrace, ::testing::Values("wallring", "arcs"));

class WholeTrace : public ::testing::TestWithParam<const char*> {};

TEST_P(WholeTrace, HasKlippersPhases) {
  const std::string name = GetParam();
  const fs::path path = unflex::testing::whole_print_folder("traces") / (name + ".moves.csv.gz");
  if (!fs::exists(path)) GTEST_SKIP() << "UNFLEX_SAMPLES names no folder with it: " << path;
  const auto rows = parse_trace(read_gz(path));
  ASSERT_GT(rows.size(), 10000U);
  const Plan plan = plan_file(unflex::testing::whole_print(name));
  EXPECT_EQ(plan.xyz_moves, rows.size());
  const Mismatch mismatch = compare(plan, rows);
  EXPECT_EQ(mismatch.phases_off, 0U);
  RecordProperty("worst_phase_ns", static_cast<int>(mismatch.worst_phase_s * 1e9));
}

INSTANTIATE_TEST_SUITE_P(Klipper, WholeTrace,
                         ::testing::Values("wallring_mini_marlin2", "star_voron_klipper_fwretract",
                                           "washer_ratrig_arcs"));

class WholeSample : public ::testing::TestWithParam<const char*> {};

TEST_P(WholeSample, TakesAsLongAsKlipperSays) {
  const fs::path path = unflex::testing::whole_print_folder("traces") / "totals.csv";
  if (!fs::exists(path)) GTEST_SKIP() << "UNFLEX_SAMPLES names no folder with it: " << path;
  std::map<std::string, std::vector<std::string>> rows;
  std::stringstream stream(read_text(path));
  for (std::string row; std::getline(stream, row);) {
    const auto cells = split(row);
    rows[cells.at(0)] = cells;
  }
  const auto& row = rows.at(GetParam());
  const Plan plan = plan_file(unflex::testing::whole_print(GetParam()));
  EXPECT_NEAR(plan.duration_s, number(row[1]), 2e-6);
  EXPECT_EQ(plan.xyz_moves, std::stoul(row[2]));
  EXPECT_EQ(plan.e_moves, std::stoul(row[3]));
  EXPECT_NEAR(plan.moving_s, number(row[4]), 2e-6);
}

INSTANTIATE_TEST_SUITE_P(Klipper, WholeSample,
                         ::testing::Values("bracket_mk3s_whole", "cube20_ender3_absE",
                                           "star_voron_klipper_fwretract", "vase_rrf_spiral",
                                           "wallring_mini_marlin2", "pins_slic3r_zhop",
                                           "textplate_cura", "dome_snap_dense",
                                           "washer_ratrig_lines", "washer_ratrig_arcs"));

}  // namespace
}  // namespace unflex::planner
