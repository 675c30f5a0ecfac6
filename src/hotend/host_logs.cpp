// Logs that hosts write while they print: Klipper's klippy.log, and serial logs such as
// OctoPrint's.
#include <fmt/core.h>

#include <array>
#include <chrono>
#include <cmath>
#include <string>

#include "lines.hpp"
#include "unflex/core/text.hpp"

namespace unflex::hotend {
namespace {

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

// The text behind `key` where `key` begins a word.
std::optional<std::string_view> behind(std::string_view text, std::string_view key) {
  for (std::size_t at = text.find(key); at != std::string_view::npos; at = text.find(key, at + 1)) {
    if (at == 0 || !is_word(text[at - 1])) {
      return text.substr(at + key.size());
    }
  }
  return std::nullopt;
}

std::optional<double> number_behind(std::string_view text, std::string_view key) {
  const std::optional<std::string_view> rest = behind(text, key);
  return rest ? leading_number(trimmed(*rest)) : std::nullopt;
}

// The first three words behind a heater's name.
std::string_view part_of(std::string_view text) {
  std::size_t end = 0;
  text = trimmed(text);
  for (int word = 0; word < 3 && end < text.size(); ++word) {
    end = std::min(text.find(' ', end + 1), text.size());
  }
  return text.substr(0, end);
}

Status check_power(double share, const std::string& file, std::size_t line) {
  constexpr double kRounding = 1e-6;
  if (share < -kRounding || share > 1.0 + kRounding) {
    return fail(ErrorKind::input, {file, line},
                "has a power below 0 or above full power; say what full power is in this log");
  }
  return {};
}

// "2024-01-01 12:00:00,123" at the beginning of a line, as seconds.
std::optional<double> stamp_of(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00 00:00:00";
  if (text.size() < kForm.size()) {
    return std::nullopt;
  }
  std::array<int, 6> fields{};  // year, month, day, hour, minute, second
  std::size_t field = 0;
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    const char c = text[i];
    if (kForm[i] != '0') {
      if (c != kForm[i] && !(kForm[i] == ' ' && c == 'T')) {
        return std::nullopt;
      }
      ++field;
    } else if (c < '0' || c > '9') {
      return std::nullopt;
    } else {
      fields[field] = 10 * fields[field] + (c - '0');
    }
  }
  const std::chrono::year_month_day date{std::chrono::year(fields[0]),
                                         std::chrono::month(static_cast<unsigned>(fields[1])),
                                         std::chrono::day(static_cast<unsigned>(fields[2]))};
  if (!date.ok()) {
    return std::nullopt;
  }
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  double seconds = 3600.0 * fields[3] + 60.0 * fields[4] + fields[5];
  std::string_view rest = text.substr(kForm.size());
  if (rest.starts_with(',') || rest.starts_with('.')) {
    double place = 0.1;
    for (std::size_t i = 1; i < rest.size() && rest[i] >= '0' && rest[i] <= '9'; ++i) {
      seconds += place * (rest[i] - '0');
      place *= 0.1;
    }
  }
  return 86400.0 * static_cast<double>(days) + seconds;
}

Log log_of(std::vector<Sample> samples) {
  Log log{.samples = best_stretch(samples), .hold = Hold::to_nearer};
  // Seconds since 1970 leave few digits for the fractions.
  const double start_s = log.samples.front().time_s;
  for (Sample& sample : log.samples) {
    sample.time_s -= start_s;
  }
  return log;
}

}  // namespace

Result<Log> parse_klipper(const std::vector<NumberedLine>& lines, const std::string& file,
                          const LogOptions& options) {
  const double full = options.full_power.value_or(1.0);
  std::vector<Sample> samples;
  for (const NumberedLine& line : lines) {
    if (!line.text.starts_with("Stats ")) {
      continue;
    }
    const std::optional<std::string_view> rest = behind(line.text, options.heater + ": target=");
    if (!rest) {
      continue;
    }
    const std::string_view part = part_of(*rest);
    const std::optional<double> time_s = leading_number(line.text.substr(6));
    const std::optional<double> temperature_c = number_behind(part, "temp=");
    const std::optional<double> power = number_behind(part, "pwm=");
    if (!time_s || !temperature_c || !power) {
      if (!line.is_whole) {
        continue;  // the log ends within it
      }
      return fail(ErrorKind::input, {file, line.number},
                  fmt::format("has no time, temp= or pwm= of '{}'; give klippy.log as Klipper "
                              "wrote it",
                              options.heater));
    }
    if (const Status status = check_power(*power / full, file, line.number); !status) {
      return tl::unexpected(status.error());
    }
    samples.push_back({*time_s, *temperature_c, *power / full * kFullPower});
  }
  if (samples.empty()) {
    return fail(ErrorKind::input, {file, 0},
                fmt::format("has no Stats line with '{}: target='; name the heater as its section "
                            "in printer.cfg is named",
                            options.heater));
  }
  return log_of(std::move(samples));
}

std::optional<Result<Log>> parse_serial(const std::vector<NumberedLine>& lines,
                                        const std::string& file, const LogOptions& options) {
  constexpr double kFullOfMarlin = 127.0;
  constexpr std::string_view kFirst = "extruder";
  const double full = options.full_power.value_or(kFullOfMarlin);
  const std::string number =
      options.heater.starts_with(kFirst) ? options.heater.substr(kFirst.size()) : "";
  std::vector<Sample> samples;
  std::size_t without_power = 0;  // the first such line
  for (const NumberedLine& line : lines) {
    const std::optional<double> time_s = stamp_of(line.text);
    const std::optional<double> temperature_c = number_behind(line.text, "T" + number + ":");
    if (!time_s || !temperature_c) {
      continue;
    }
    const std::optional<double> power = number_behind(line.text, "@" + number + ":");
    if (!power) {
      without_power = without_power == 0 ? line.number : without_power;
      continue;
    }
    if (const Status status = check_power(*power / full, file, line.number); !status) {
      return tl::unexpected(status.error());
    }
    if (samples.empty() || *time_s != samples.back().time_s) {
      samples.push_back({*time_s, *temperature_c, *power / full * kFullPower});
    }
  }
  if (samples.empty() && without_power == 0) {
    return std::nullopt;
  }
  if (samples.empty()) {
    return fail(ErrorKind::input, {file, without_power},
                fmt::format("has a temperature but no power '@{}:', nor has any other line; log "
                            "with a firmware that reports it, or give a table",
                            number));
  }
  return log_of(std::move(samples));
}

}  // namespace unflex::hotend
