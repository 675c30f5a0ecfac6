// Progress on a terminal.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "time_left.hpp"
#include "unflex/core/progress.hpp"

namespace unflex::app {

// Is cancelled once a signal asks the program to end; shows nothing.
class SignalledProgress : public Progress {
 public:
  void update(std::string_view /*stage*/, double /*fraction*/) override {}
  [[nodiscard]] bool cancelled() const override;
};

// Draws a bar on the terminal behind `fd`, at most ten times a second, and clears it at the end.
class ProgressBar final : public SignalledProgress {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;

  explicit ProgressBar(int fd, Clock clock = &std::chrono::steady_clock::now)
      : fd_(fd), clock_(std::move(clock)) {}
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar() override;

  void update(std::string_view stage, double fraction) override;

 private:
  int fd_;
  Clock clock_;
  std::chrono::steady_clock::time_point last_drawn_{};
  TimeLeft time_left_;
  bool drawn_ = false;
};

// Says once how long a stage that takes minutes will take, on an fd that is no terminal.
class OneEstimate final : public SignalledProgress {
 public:
  explicit OneEstimate(int fd, ProgressBar::Clock clock = &std::chrono::steady_clock::now)
      : fd_(fd), clock_(std::move(clock)) {}

  void update(std::string_view stage, double fraction) override;

 private:
  int fd_;
  ProgressBar::Clock clock_;
  TimeLeft time_left_;
  std::string told_;  // the stage that was told of
};

// The bar's text for a terminal of `columns`, without control characters. left: the text of the
// time left, or empty. It is dropped if there is no room.
[[nodiscard]] std::string bar_text(std::string_view stage, double fraction, std::string_view left,
                                   std::size_t columns);

// A bar if stderr is a terminal that can show one, an estimate elsewhere; neither if `quiet` is
// set.
[[nodiscard]] std::unique_ptr<Progress> make_progress(bool quiet);

}  // namespace unflex::app
