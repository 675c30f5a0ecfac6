// Text of logs in lines and numbers.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "unflex/hotend/log.hpp"

namespace unflex::hotend {

struct NumberedLine {
  std::size_t number = 0;  // from 1 on
  std::string_view text;   // without blanks around it
  bool is_whole = true;    // an end of line follows
};

[[nodiscard]] std::vector<NumberedLine> lines_of(std::string_view text);

// The number at the beginning of the text, whatever follows.
[[nodiscard]] std::optional<double> leading_number(std::string_view text);

// The stretch of what a host has logged that tells most: see parse_log().
[[nodiscard]] std::vector<Sample> best_stretch(const std::vector<Sample>& samples);

[[nodiscard]] Result<Log> parse_klipper(const std::vector<NumberedLine>& lines,
                                        const std::string& file, const LogOptions& options);

// Nothing if no line is one of a serial log.
[[nodiscard]] std::optional<Result<Log>> parse_serial(const std::vector<NumberedLine>& lines,
                                                      const std::string& file,
                                                      const LogOptions& options);

}  // namespace unflex::hotend
