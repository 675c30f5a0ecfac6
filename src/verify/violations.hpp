// Broken rules, collected: all are counted, the first ones kept.
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

  void in_output(std::size_t line, std::string message) {
    add({output_name_, line}, std::move(message));
  }
  // For what the sliced file has and the emitted one has not.
  void in_input(std::size_t line, std::string message) {
    add({input_name_, line}, std::move(message));
  }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::vector<Violation> take() { return std::move(kept_); }

 private:
  static constexpr std::size_t kKept = 100;

  void add(SourcePlace place, std::string message) {
    ++count_;
    if (kept_.size() < kKept) {
      kept_.push_back({std::move(place), std::move(message)});
    }
  }

  std::string input_name_;
  std::string output_name_;
  std::vector<Violation> kept_;
  std::size_t count_ = 0;
};

}  // namespace unflex::verify
