#include "random_dialect.hpp"

namespace unflex::gcode {
namespace {

TEST(MarlinRandomPrograms, EndWhereAnIndependentModelEnds) {
  expect_random_programs_agree(Firmware::marlin);
}

}  // namespace
}  // namespace unflex::gcode
