#include "unflex/platform/descriptors.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <string_view>

namespace unflex::platform {
namespace {

using std::chrono::milliseconds;

TEST(Descriptors, SayWhenThereIsSomethingToRead) {
  std::array<int, 2> pipe{};
  ASSERT_EQ(::pipe(pipe.data()), 0);
  const auto source = descriptor_source(pipe[0]);
  const auto sink = descriptor_sink(pipe[1]);
  EXPECT_FALSE(source->wait(milliseconds(0)));
  EXPECT_FALSE(source->wait(milliseconds(5)));
  EXPECT_TRUE(sink->wait(milliseconds(0)));
  EXPECT_EQ(sink->write("G28"), 3U);
  EXPECT_TRUE(source->wait(milliseconds(0)));
  std::array<char, 8> bytes{};
  EXPECT_EQ(source->read(bytes.data(), bytes.size()), 3U);
  EXPECT_EQ(std::string_view(bytes.data(), 3), "G28");
  ::close(pipe[1]);
  EXPECT_TRUE(source->wait(milliseconds(0)));
  EXPECT_EQ(source->read(bytes.data(), bytes.size()), 0U);
  ::close(pipe[0]);
}

TEST(Descriptors, TellWhatGoesWrong) {
  const auto source = descriptor_source(-1);
  char byte = 0;
  EXPECT_EQ(source->read(&byte, 1), tl::unexpected(EBADF));
  EXPECT_EQ(descriptor_sink(-1)->write("x"), tl::unexpected(EBADF));
}

}  // namespace
}  // namespace unflex::platform
