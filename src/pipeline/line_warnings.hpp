// Warnings about lines of a print. One that says the same of many lines is told once.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"

namespace unflex::pipeline {

class LineWarnings {
 public:
  // Two messages say the same if they differ in their numbers alone.
  void add(std::size_t line, std::string message);

  // In the order of the lines they were first told of, with how many more lines each is about.
  [[nodiscard]] std::vector<Diagnostic> list(const std::string& file) const;

 private:
  struct Warning {
    std::size_t line = 0;
    std::string message;
    std::size_t repeats = 0;
    std::size_t last_line = 0;
  };

  std::vector<Warning> warnings_;
  std::map<std::string, std::size_t> places_;  // in warnings_, by message without numbers
  std::size_t unlisted_ = 0;
};

}  // namespace unflex::pipeline
