#include "progress.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "files.hpp"
#include "unflex/platform/process.hpp"
#include "unflex/platform/signals.hpp"

namespace unflex::app {
namespace {

constexpr std::chrono::milliseconds kRedrawInterval{100};
constexpr std::size_t kDefaultColumns = 80;
constexpr std::size_t kMostColumns = 100;
constexpr std::size_t kLeastBar = 8;
constexpr std::string_view kClearLine = "\r\033[K";

std::size_t columns_of(int fd) {
  const unsigned columns = platform::columns_of(fd);
  return columns > 0 ? columns : kDefaultColumns;
}

}  // namespace

bool SignalledProgress::cancelled() const { return platform::ending_signal() != 0; }

ProgressBar::~ProgressBar() {
  if (drawn_) {
    static_cast<void>(write_all(fd_, kClearLine));
  }
}

void ProgressBar::update(std::string_view stage, double fraction) {
  const auto now = clock_();
  if (drawn_ && now - last_drawn_ < kRedrawInterval) {
    return;
  }
  last_drawn_ = now;
  drawn_ = true;
  const std::optional<TimeLeft::Seconds> left = time_left_.update(stage, fraction, now);
  static_cast<void>(write_all(
      fd_,
      fmt::format("{}{}", kClearLine,
                  bar_text(stage, fraction, left ? time_left_text(*left) : "", columns_of(fd_)))));
}

void OneEstimate::update(std::string_view stage, double fraction) {
  constexpr TimeLeft::Seconds kWorthALine{60.0};
  if (told_ == stage) {
    return;
  }
  const std::optional<TimeLeft::Seconds> left = time_left_.update(stage, fraction, clock_());
  if (left && *left > kWorthALine) {
    told_ = stage;
    static_cast<void>(
        write_all(fd_, fmt::format("unflex: {}, {}\n", stage, time_left_text(*left))));
  }
}

std::string bar_text(std::string_view stage, double fraction, std::string_view left,
                     std::size_t columns) {
  // The last column stays free: a cursor beyond it would wrap.
  const std::size_t room = std::min(columns, kMostColumns) - std::min<std::size_t>(columns, 1);
  if (!(fraction >= 0.0)) {
    return std::string(stage.substr(0, room));
  }
  const double part = std::min(fraction, 1.0);
  std::string percent = fmt::format(" {:3.0f} %", std::floor(100.0 * part));
  std::size_t taken = stage.size() + percent.size() + 3;
  const std::string behind = left.empty() ? "" : fmt::format(", {}", left);
  if (room >= taken + behind.size() + kLeastBar) {
    percent += behind;
    taken += behind.size();
  }
  if (room < taken + kLeastBar) {
    return fmt::format("{}{}", stage, percent).substr(0, room);
  }
  const std::size_t length = room - taken;
  const auto filled = static_cast<std::size_t>(part * static_cast<double>(length));
  return fmt::format("{} [{}{}]{}", stage, std::string(filled, '#'),
                     std::string(length - filled, '-'), percent);
}

std::unique_ptr<Progress> make_progress(bool quiet) {
  if (!quiet && platform::takes_escape_sequences(platform::kStandardError)) {
    return std::make_unique<ProgressBar>(platform::kStandardError);
  }
  if (!quiet) {
    return std::make_unique<OneEstimate>(platform::kStandardError);
  }
  return std::make_unique<SignalledProgress>();
}

}  // namespace unflex::app
