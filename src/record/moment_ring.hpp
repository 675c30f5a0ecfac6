// Keeps samples of the last seconds of a nozzle's motion. From them the motion just before and
// after a place can be taken.
#pragma once

#include <compare>
#include <cstddef>
#include <vector>

#include "unflex/report/recording.hpp"
#include "unflex/verify/observer.hpp"

namespace unflex::record {

// Where the reference is: which move, and how far along it.
struct PathPoint {
  std::size_t move = 0;
  double along_mm = 0.0;

  friend auto operator<=>(const PathPoint&, const PathPoint&) = default;
};

class MomentRing {
 public:
  // Moments are taken up to half_width_s before and after the reference is at a place.
  explicit MomentRing(double half_width_s);

  // The nozzle takes a step of duration_s. Returns whether the step is to be added.
  [[nodiscard]] bool advance(double duration_s) {
    clock_s_ += duration_s;
    return clock_s_ - last_s_ >= interval_s_;
  }
  // Adds the step. The reference is at `where`, which must never decrease.
  void add(const verify::NozzleStep& step, const PathPoint& where);
  // The base rests.
  void pass(double duration_s) { clock_s_ += duration_s; }

  // Asks for the moments around a place, under a number of the caller's own.
  void request(std::size_t id, const PathPoint& where) { requests_.push_back({id, where}); }
  void cancel(std::size_t id);

  struct Taken {
    std::size_t id = 0;
    std::vector<report::Moment> moments;
  };
  // The requests fulfilled since the last call. over: no more steps follow, so all requests are
  // answered with the moments there are. A place that has left the ring gets no moments.
  [[nodiscard]] std::vector<Taken> take(bool over);
  [[nodiscard]] bool has_requests() const { return !requests_.empty(); }

 private:
  struct Entry {
    report::Moment moment;  // absolute time and places
    PathPoint where;
  };
  struct Request {
    std::size_t id;
    PathPoint where;
  };

  [[nodiscard]] std::size_t begin() const {
    return count_ > entries_.size() ? count_ - entries_.size() : 0;
  }
  [[nodiscard]] const Entry& at(std::size_t number) const {
    return entries_[number % entries_.size()];
  }
  [[nodiscard]] std::size_t find(const PathPoint& where) const;
  [[nodiscard]] std::vector<report::Moment> around(std::size_t centre) const;

  double interval_s_;
  double clock_s_ = 0.0;
  double last_s_ = -1.0;
  std::size_t count_ = 0;  // number of all entries ever added
  std::vector<Entry> entries_;
  std::vector<Request> requests_;
};

}  // namespace unflex::record
