#include "unflex/core/caught.hpp"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>
#include <system_error>

namespace unflex {
namespace {

TEST(Caught, NamesWhatRanOutAndTheRemedy) {
  const Error memory = error_of(std::bad_alloc());
  EXPECT_EQ(memory.kind, ErrorKind::internal);
  EXPECT_EQ(memory.message, "out of memory; give -j a smaller number, or end other programs");
  EXPECT_EQ(error_of(std::system_error(EAGAIN, std::generic_category())).message,
            "the system gives no more threads; give -j a smaller number, or end other programs");
}

TEST(Caught, PassesOnWhatElseIsSaid) {
  EXPECT_EQ(error_of(std::runtime_error("odd")).message, "internal error: odd");
}

}  // namespace
}  // namespace unflex
