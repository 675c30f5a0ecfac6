// The way in which long-running work reports its progress and learns that it should stop.
#pragma once

#include <string_view>

namespace unflex {

class Progress {
 public:
  Progress() = default;
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  virtual ~Progress() = default;

  // stage: a few words ("compensating"); fraction in [0, 1], negative when unknown.
  virtual void update(std::string_view stage, double fraction) = 0;
  // True once the user wants the work to end; the work then returns an error of kind internal.
  [[nodiscard]] virtual bool cancelled() const = 0;
};

// Says nothing and is never cancelled.
class SilentProgress final : public Progress {
 public:
  void update(std::string_view, double) override {}
  [[nodiscard]] bool cancelled() const override { return false; }
};

}  // namespace unflex
