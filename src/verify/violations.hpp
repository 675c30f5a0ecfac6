// Collects broken rules. All are counted, only the first ones kept.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "unflex/verify/verify.hpp"

namespace unflex::verify {

class Violations {
 public:
  Violations(std::string input_name, std::string output_name)
      : input_name_(std::move(input_name)), output_name_(std::move(output_name)) {}

  // A compensated run begins. Broken rules are blamed on it until the next one begins.
  void begin_run() {
    settle();
    run_ = {};
  }
  // A line of the sliced file that belongs to the run.
  void add_to_run(std::size_t line) {
    run_.first_line = run_.first_line == 0 ? line : run_.first_line;
    run_.last_line = line;
  }

  void in_output(std::size_t line, std::string message) {
    add({output_name_, line}, std::move(message));
  }
  // For lines that the sliced file has and the emitted one lacks.
  void in_input(std::size_t line, std::string message) {
    add({input_name_, line}, std::move(message));
  }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::vector<Violation> take() { return std::move(kept_); }
  [[nodiscard]] std::vector<BlamedRun> take_blamed() {
    begin_run();
    return std::move(blamed_);
  }

 private:
  static constexpr std::size_t kKept = 100;

  void add(SourcePlace place, std::string message) {
    ++count_;
    if (run_.reason.empty()) {
      run_.reason = message;
    }
    if (kept_.size() < kKept) {
      kept_.push_back({std::move(place), std::move(message)});
    }
  }

  void settle() {
    if (run_.first_line != 0 && !run_.reason.empty()) {
      blamed_.push_back(std::move(run_));
    }
  }

  std::string input_name_;
  std::string output_name_;
  std::vector<Violation> kept_;
  std::size_t count_ = 0;
  BlamedRun run_;  // the present run
  std::vector<BlamedRun> blamed_;
};

}  // namespace unflex::verify
