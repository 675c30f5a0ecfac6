// Short ways to feed text to the interpreter.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

// A printer that is fed line by line.
class Session {
 public:
  explicit Session(InterpreterOptions options = {}) : interpreter_(options) {}

  // Reads the lines and returns the event of the last one.
  Event read(const std::string& lines) {
    std::istringstream text(lines);
    Event event;
    for (std::string line; std::getline(text, line);) {
      event = interpreter_.interpret(Line{line + "\n", ++number_});
      EXPECT_EQ(event.line.text, line + "\n");
      EXPECT_EQ(event.line.number, number_);
      for (const Segment& segment : event.segments) {
        EXPECT_EQ(segment.line, number_);
      }
    }
    return event;
  }

  // Reads the lines and returns the only segment of the last one.
  Segment move(const std::string& lines) {
    const Event event = read(lines);
    EXPECT_EQ(event.kind, EventKind::move) << lines;
    EXPECT_EQ(event.segments.size(), 1U) << lines;
    return event.segments.empty() ? Segment{} : event.segments.front();
  }

  [[nodiscard]] std::optional<std::string> approach(const std::string& line) const {
    return interpreter_.approach({line + "\n", number_ + 1});
  }
  [[nodiscard]] const ModalState& state() const { return interpreter_.state(); }

 private:
  Interpreter interpreter_;
  std::size_t number_ = 0;
};

inline std::string file_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.is_open()) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// The rows of numbers of a table, without the heading.
inline std::vector<std::vector<double>> csv_rows(const std::string& path) {
  std::istringstream text(file_text(path));
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(text, line);
  while (std::getline(text, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) {
      rows.back().push_back(std::stod(cell));
    }
  }
  return rows;
}

}  // namespace unflex::gcode
