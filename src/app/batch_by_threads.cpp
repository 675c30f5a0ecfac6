#include <algorithm>
#include <utility>

#include "batch_workers.hpp"
#include "unflex/core/threads.hpp"

namespace unflex::app {
namespace {

constexpr std::chrono::milliseconds kPatience{100};

}  // namespace

struct BatchWorkers::Shared {
  Mutex mutex;
  Condition one_is_done;
};

struct BatchWorkers::Running {
  std::size_t ticket = 0;
  unsigned workers = 0;
  std::chrono::steady_clock::time_point start;
  BatchAnswer answer;
  bool is_done = false;  // under the shared mutex
  std::unique_ptr<Thread> thread;
};

BatchWorkers::BatchWorkers(unsigned workers)
    : free_workers_(workers), shared_(std::make_shared<Shared>()) {}

// The prints under way look for a signal themselves, and their threads are waited for.
BatchWorkers::~BatchWorkers() = default;

Status BatchWorkers::start(std::size_t ticket, unsigned workers, const Work& work) {
  free_workers_ -= workers;
  auto& print = running_.emplace_back(std::make_unique<Running>());
  print->ticket = ticket;
  print->workers = workers;
  print->start = std::chrono::steady_clock::now();
  print->thread = std::make_unique<Thread>([shared = shared_.get(), print = print.get(), work] {
    BatchAnswer answer = work();
    const Lock lock(shared->mutex);
    print->answer = std::move(answer);
    print->is_done = true;
    shared->one_is_done.notify_one();
  });
  return {};
}

std::vector<BatchWorkers::Done> BatchWorkers::take() {
  if (!kHasThreads && !running_.empty()) {
    running_.front()->thread->join();
  }
  std::vector<Done> all;
  Lock lock(shared_->mutex);
  const auto is_done = [](const auto& print) { return print->is_done; };
  shared_->one_is_done.wait_for(lock, kPatience,
                                [&] { return std::ranges::any_of(running_, is_done); });
  for (const auto& print : running_) {
    if (print->is_done) {
      all.push_back(finish(*print));
    }
  }
  std::erase_if(running_, is_done);
  return all;
}

BatchWorkers::Done BatchWorkers::finish(Running& print) {
  free_workers_ += print.workers;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - print.start;
  return {print.ticket, true, std::move(print.answer), wall.count()};
}

}  // namespace unflex::app
