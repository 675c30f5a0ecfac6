#include "piece_thread.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "unflex/core/threads.hpp"

namespace unflex::flow {
namespace {

// Lines that are read ahead.
constexpr std::size_t kMostAhead = 4'000;

}  // namespace

PieceThread::PieceThread(std::istream& input, std::string name, const verify::Rules& rules,
                         CpuSlots& slots, std::function<void()> wake,
                         std::function<void()> stop_input)
    : slots_(&slots),
      stop_input_(std::move(stop_input)),
      reader_(input, std::move(name), rules.interpreter, rules.limits, rules.fixed, rules.travel),
      thread_([this, wake = std::move(wake)] {
        try {
          read(wake);
        } catch (...) {
          give_up();
          wake();
        }
      }) {}

PieceThread::~PieceThread() {
  {
    const Lock lock(mutex_);
    stopped_ = true;
  }
  stop_input_();
  room_.notify_one();
}

void PieceThread::give_up() {
  {
    const Lock lock(mutex_);
    failure_ = std::current_exception();
    ended_ = true;
  }
  news_.notify_one();
}

bool PieceThread::read_piece(run::Piece& piece, std::optional<Error>& error) {
  const Result<bool> more = reader_.next(piece);
  if (!more) {
    error = more.error();
  }
  return more && *more;
}

void PieceThread::read_here(std::size_t lines) {
  while (!kHasThreads && !ended_ && (pieces_.empty() || lines_ahead_ < lines)) {
    auto piece = std::make_unique<run::Piece>();
    ended_ = !read_piece(*piece, error_);
    if (!ended_) {
      lines_ahead_ += piece->events.size();
      pieces_.push_back(std::move(piece));
    }
  }
}

void PieceThread::read(const std::function<void()>& wake) {
  const CpuSlot slot(*slots_);
  bool ended = false;
  std::deque<std::unique_ptr<run::Piece>> returned;
  while (!ended) {
    std::unique_ptr<run::Piece> piece;
    if (returned.empty()) {
      piece = std::make_unique<run::Piece>();
    } else {
      piece = std::move(returned.front());
      returned.pop_front();
    }
    std::optional<Error> error;
    std::size_t lines_ahead = 0;
    ended = !read_piece(*piece, error);
    const CpuSlot::Without without(*slots_);
    {
      Lock lock(mutex_);
      room_.wait(lock, [this] { return stopped_ || lines_ahead_ < kMostAhead; });
      if (stopped_) {
        return;
      }
      if (!ended) {
        lines_ahead_ += piece->events.size();
        pieces_.push_back(std::move(piece));
      }
      error_ = std::move(error);
      ended_ = ended;
      std::ranges::move(returned_, std::back_inserter(returned));
      returned_.clear();
      lines_ahead = lines_ahead_;
    }
    if (ended || lines_ahead >= kMostAhead / 2) {
      news_.notify_one();
    }
    wake();
  }
}

void PieceThread::exchange(std::deque<std::unique_ptr<run::Piece>>& pieces) {
  Lock lock(mutex_);
  returned_ = std::exchange(pieces, {});
  read_here(kMostAhead / 2);
  // Threads that wake each other for every piece do little else.
  news_.wait(lock, [this] { return lines_ahead_ >= kMostAhead / 2 || ended_; });
  pieces.swap(pieces_);
  lines_ahead_ = 0;
  room_.notify_one();
}

std::unique_ptr<run::Piece> PieceThread::take() {
  const Lock lock(mutex_);
  read_here(1);
  if (pieces_.empty()) {
    return nullptr;
  }
  std::unique_ptr<run::Piece> piece = std::move(pieces_.front());
  pieces_.pop_front();
  lines_ahead_ -= piece->events.size();
  if (lines_ahead_ < kMostAhead) {
    room_.notify_one();
  }
  return piece;
}

bool PieceThread::has_news() {
  const Lock lock(mutex_);
  read_here(1);
  return !pieces_.empty() || ended_;
}

const std::optional<Error>& PieceThread::error() const {
  if (failure_) {
    std::rethrow_exception(failure_);
  }
  return error_;
}

bool PieceThread::at_end() {
  const Lock lock(mutex_);
  return pieces_.empty() && ended_;
}

}  // namespace unflex::flow
