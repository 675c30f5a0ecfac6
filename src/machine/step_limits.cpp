// The steps per second that boards and drivers make.
//
// Drivers: 1 / (shortest high + shortest low of a pulse), by the data sheets of A4988 (1 + 1 µs),
// DRV8825 (1.9 + 1.9 µs) and TMC2209 (0.1 + 0.1 µs).
// Boards: Klipper's docs/Benchmarks.md, which tells the ticks of the clock that a step takes with
// one stepper and with three at the same time; rate = steppers × clock / ticks.
#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

struct Driver {
  std::string_view name;
  double max_hz;
};

constexpr std::array kDrivers = {
    Driver{"a4988", 1.0 / 2e-6},
    Driver{"drv8825", 1.0 / 3.8e-6},
    Driver{"tmc2209", 1.0 / 0.2e-6},
};

struct Board {
  std::string_view name;
  double one_hz;    // one stepper
  double three_hz;  // three steppers, the sum of their rates
};

constexpr std::array kBoards = {
    Board{"avr_16mhz", 156.9e3, 98.8e3},  Board{"lpc1768", 1.923e6, 1.351e6},
    Board{"stm32f103", 1.180e6, 0.818e6}, Board{"stm32f4", 3.652e6, 2.459e6},
    Board{"sam3x", 1.273e6, 0.981e6},
};

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

double given(double hz) { return hz > 0.0 ? hz : kNoLimit; }

}  // namespace

StepLimits Settings::step_limits() const {
  StepLimits most{given(printer.board.max_step_rate_hz),
                  given(printer.board.max_total_step_rate_hz), kNoLimit};
  for (const Driver& driver : kDrivers) {
    if (driver.name == printer.board.driver) {
      most.max_hz = std::min(most.max_hz, driver.max_hz);
    }
  }
  for (const Board& board : kBoards) {
    if (board.name == printer.board.mcu) {
      most.max_hz = std::min(most.max_hz, board.one_hz);
      most.max_shared_hz = board.three_hz;
    }
  }
  most.max_shared_hz = std::min(most.max_shared_hz, most.max_total_hz);
  return most;
}

bool StepLimits::is_any() const { return std::min(max_hz, max_shared_hz) < kNoLimit; }

}  // namespace unflex::machine
