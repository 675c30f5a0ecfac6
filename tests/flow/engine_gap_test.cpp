// Compares the banded engine with Ipopt, which solves by an entirely different method, on
// every third window of a stretch of a real print.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>

#include "jobs.hpp"
#include "paths.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/run/nozzle_motion.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/run/setup.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::flow {
namespace {

struct Gap {
  std::size_t windows = 0;
  double objective = 0.0;  // relative gap of the objectives
  double base_mm = 0.0;
};

void compare(const compensate::AxisWindow& window, const compensate::Engine& banded,
             const compensate::Engine& ipopt, Gap& gap) {
  const auto one = banded.solve(window);
  const auto other = ipopt.solve(window);
  ASSERT_TRUE(one.has_value()) << to_string(one.error());
  ASSERT_TRUE(other.has_value()) << to_string(other.error());
  // Without motion the objective is only rounding errors. Ignore what an error of one nanometre
  // throughout would give.
  constexpr double kNothing_mm = 1e-6;
  const double nothing =
      kNothing_mm * kNothing_mm * static_cast<double>(window.nodes()) * window.period_s;
  gap.objective = std::max(gap.objective, std::abs(one->objective - other->objective) /
                                              std::max(other->objective, nothing));
  for (std::size_t k = 0; k < window.nodes(); ++k) {
    gap.base_mm =
        std::max(gap.base_mm, std::abs(one->base.position_mm[k] - other->base.position_mm[k]));
  }
  ++gap.windows;
}

Gap gap_over(const std::string& text) {
  machine::Settings settings;
  const compensate::Setup common = run::compensate_setup(settings);
  std::istringstream stream(text);
  run::PieceReader reader(stream, "print", machine::interpreter_options(settings),
                          machine::planner_limits(settings), machine::firmware_config(settings));
  const auto banded = compensate::make_banded_engine();
  const auto ipopt = compensate::make_ipopt_engine();
  Gap gap;
  constexpr std::size_t kOneOf = 3;  // Ipopt takes seconds for each
  std::size_t number = 0;
  for (run::Piece piece; reader.next(piece).value(); piece = {}) {
    if (!piece.is_run) {
      continue;
    }
    const auto start =
        run::at_rest(piece.moves.front().segment.start_mm, run::verify_rules(settings).nozzle);
    const compensate::Setup setup = run::setup_for(common, piece, start, settings).setup;
    const compensate::Course course(piece.before, piece.moves, piece.after);
    const auto spans = compensate::mesh(course, compensate::node_grid(course, setup), setup);
    const auto windows = compensate::windows(course, spans, start, setup);
    for (std::size_t i = 0; i < windows.size(); ++i) {
      if (!spans[i].cruise && number++ % kOneOf == 0) {
        compare(windows[i].x, *banded, *ipopt, gap);
        compare(windows[i].y, *banded, *ipopt, gap);
      }
    }
  }
  return gap;
}

void expect_small(const Gap& gap, std::size_t least_windows) {
  EXPECT_GE(gap.windows, least_windows);
  EXPECT_LE(gap.objective, 1e-6);
  EXPECT_LE(gap.base_mm, 0.05e-3);
  ::testing::Test::RecordProperty("windows", static_cast<int>(gap.windows));
  ::testing::Test::RecordProperty("objective_gap", std::to_string(gap.objective));
}

TEST(SamplesEngineGap, IsNothingOnAPieceOfAPrint) {
  const std::filesystem::path path =
      std::filesystem::path(test_paths::kData) / "pipeline_cube20.gcode";
  expect_small(gap_over(testing::read_file(path)), 20);
}

}  // namespace
}  // namespace unflex::flow
