#include "random_dialect.hpp"

namespace unflex::gcode {
namespace {

TEST(RrfRandomPrograms, EndWhereAnIndependentModelEnds) {
  expect_random_programs_agree(Firmware::rrf);
}

}  // namespace
}  // namespace unflex::gcode
