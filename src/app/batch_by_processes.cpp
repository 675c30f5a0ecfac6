#include <algorithm>
#include <utility>

#include "batch_workers.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/platform/children.hpp"

namespace unflex::app {
namespace {

constexpr std::chrono::milliseconds kPatience{100};
// The time that prints get to end by themselves before they are killed.
constexpr std::chrono::milliseconds kGrace{200};
constexpr std::chrono::milliseconds kBetweenLooks{5};

}  // namespace

struct BatchWorkers::Running {
  platform::Child child;
  std::size_t ticket = 0;
  unsigned workers = 0;
  std::chrono::steady_clock::time_point start;
};

struct BatchWorkers::Shared {};

BatchWorkers::BatchWorkers(unsigned workers) : free_workers_(workers) {}

BatchWorkers::~BatchWorkers() {
  for (const auto& print : running_) {
    platform::ask_to_end(print->child);
  }
  const auto end = std::chrono::steady_clock::now() + kGrace;
  while (!running_.empty() && std::chrono::steady_clock::now() < end) {
    std::erase_if(running_, [](const auto& print) { return platform::has_ended(print->child); });
    sleep_for(kBetweenLooks);
  }
  for (const auto& print : running_) {
    platform::kill_child(print->child);
  }
}

Status BatchWorkers::start(std::size_t ticket, unsigned workers, const Work& work) {
  // Should the child be killed, its temporary files are removed when the batch is started again.
  tl::expected<platform::Child, std::string> child = platform::fork_child(
      [&](int channel) { return platform::send_message(channel, pack(work())); },
      platform::OnInterrupt::remember);
  if (!child) {
    return fail(ErrorKind::internal, child.error());
  }
  free_workers_ -= workers;
  running_.push_back(std::make_unique<Running>(
      Running{std::move(*child), ticket, workers, std::chrono::steady_clock::now()}));
  return {};
}

std::vector<BatchWorkers::Done> BatchWorkers::take() {
  std::vector<int> channels;
  for (const auto& print : running_) {
    channels.push_back(print->child.channel.get());
  }
  std::vector<std::size_t> ready = platform::ready_channels(channels, kPatience);
  std::ranges::reverse(ready);
  std::vector<Done> all;
  for (const std::size_t i : ready) {
    all.push_back(finish(*running_[i]));
    running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return all;
}

BatchWorkers::Done BatchWorkers::finish(Running& print) {
  std::string text;
  const bool has_come = platform::receive_message(print.child.channel.get(), text);
  const std::string trouble = platform::wait_for_end(print.child);
  free_workers_ += print.workers;
  BatchAnswer answer;
  const bool answered = has_come && trouble.empty();
  if (answered) {
    answer = unpack(text);
  } else {
    answer.error = trouble.empty() ? "the process ended without an answer" : trouble;
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - print.start;
  return {print.ticket, answered, std::move(answer), wall.count()};
}

}  // namespace unflex::app
