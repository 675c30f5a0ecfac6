#include "unflex/platform/children.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <string>
#include <thread>

namespace unflex::platform {
namespace {

class Sockets : public ::testing::Test {
 protected:
  Sockets() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, pair_), 0); }
  ~Sockets() override {
    close(pair_[0]);
    hang_up();
  }
  void hang_up() {
    if (pair_[1] >= 0) {
      close(pair_[1]);
      pair_[1] = -1;
    }
  }

  int pair_[2] = {-1, -1};
};

TEST_F(Sockets, CarryMessagesOfAnyLengthInOrder) {
  const std::string large(3'000'000, 'x');
  std::thread sender([&] {
    EXPECT_TRUE(send_message(pair_[0], ""));
    EXPECT_TRUE(send_message(pair_[0], std::string("a\0b", 3)));
    EXPECT_TRUE(send_message(pair_[0], large));
  });
  std::string message = "left over";
  EXPECT_TRUE(receive_message(pair_[1], message));
  EXPECT_EQ(message, "");
  EXPECT_TRUE(receive_message(pair_[1], message));
  EXPECT_EQ(message, std::string("a\0b", 3));
  EXPECT_TRUE(receive_message(pair_[1], message));
  EXPECT_EQ(message, large);
  sender.join();
}

TEST_F(Sockets, ToSomeoneWhoIsGoneFailWithoutASignal) {
  hang_up();
  std::string message;
  EXPECT_FALSE(send_message(pair_[0], "anyone?"));
  EXPECT_FALSE(receive_message(pair_[0], message));
}

TEST_F(Sockets, FailWhenAMessageBreaksOff) {
  const std::uint64_t announced = 100;
  ASSERT_EQ(write(pair_[1], &announced, sizeof announced), 8);
  ASSERT_EQ(write(pair_[1], "ten bytes.", 10), 10);
  hang_up();
  std::string message;
  EXPECT_FALSE(receive_message(pair_[0], message));
}

TEST(Children, AnswerAndEndWell) {
  const auto child = fork_child(
      [](int channel) {
        std::string question;
        return receive_message(channel, question) && send_message(channel, question + "!");
      },
      OnInterrupt::remember);
  ASSERT_TRUE(child);
  ASSERT_TRUE(send_message(child->channel.get(), "there"));
  const int channel = child->channel.get();
  EXPECT_EQ(ready_channels({&channel, 1}, std::chrono::seconds(10)), std::vector<std::size_t>{0});
  std::string answer;
  ASSERT_TRUE(receive_message(child->channel.get(), answer));
  EXPECT_EQ(answer, "there!");
  EXPECT_EQ(wait_for_end(*child), "");
}

TEST(Children, ThatEndBadlyTellHow) {
  const auto unwell = fork_child([](int) { return false; }, OnInterrupt::remember);
  ASSERT_TRUE(unwell);
  EXPECT_EQ(wait_for_end(*unwell), "the process ended without an answer");
  const auto thrown =
      fork_child([](int) -> bool { throw std::bad_alloc(); }, OnInterrupt::remember);
  ASSERT_TRUE(thrown);
  EXPECT_EQ(wait_for_end(*thrown), "the process ended without an answer");
  const auto killed =
      fork_child([](int) { return std::raise(SIGKILL) == 0; }, OnInterrupt::remember);
  ASSERT_TRUE(killed);
  EXPECT_EQ(wait_for_end(*killed), "the process died of signal 9 (Killed)");
}

TEST(Children, EndWhenTheyAreAskedTo) {
  const auto child = fork_child(
      [](int channel) {
        std::string nothing;
        return receive_message(channel, nothing);
      },
      OnInterrupt::leave_to_parent);
  ASSERT_TRUE(child);
  EXPECT_FALSE(has_ended(*child));
  kill_child(*child);
  EXPECT_TRUE(has_ended(*child));
}

}  // namespace
}  // namespace unflex::platform
