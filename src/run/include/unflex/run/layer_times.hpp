// The durations of layers whose timing is chosen anew. Slicers slow small layers down so that they
// cool. So a layer is not made shorter than a least time, unless it was sliced shorter.
//
//   T   the lesser of the least time and the layer's duration as sliced
//   k   by how much its runs are stretched
//
// T = fixed + k · runs, where `fixed` is what keeps its timing: moves and dwells between runs, runs
// that are kept, and runs for which no other timing was found.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "unflex/run/run_job.hpp"

namespace unflex::run {

class LayerTimes {
 public:
  // 0: no layer is stretched.
  explicit LayerTimes(double least_s) : least_s_(least_s) {}

  // The next piece of the file. A piece belongs to the layer in which it begins, and a part of a
  // run to the layer in which the run begins. Pieces before the first comment that begins a layer
  // belong to none.
  void add(const std::shared_ptr<RunJob>& job);
  // There are no more pieces.
  void end();

  // Sets RunJob::stretch of all runs whose timing is known and whose layer is known to last long
  // enough, or is known as a whole.
  void settle();
  // Whether settle() has something to do.
  [[nodiscard]] bool can_settle() const;
  // Whether nothing can be settled before more pieces are added.
  [[nodiscard]] bool needs_more() const;

 private:
  struct Layer {
    std::vector<std::shared_ptr<RunJob>> jobs;
    bool is_whole = false;
    bool is_settled = false;
  };

  [[nodiscard]] static bool is_timed(const Layer& layer);
  [[nodiscard]] bool is_known(const Layer& layer) const;
  void set(Layer& layer) const;

  double least_s_;
  bool in_layer_ = false;  // a comment has begun a layer
  bool begins_ = true;     // the next piece that is no later part of a run begins a layer
  std::deque<Layer> layers_;
};

}  // namespace unflex::run
