#include "unflex/hotend/log.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>

#include "lines.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/text.hpp"

namespace unflex::hotend {
namespace {

constexpr std::array<std::string_view, 3> kColumns{"time", "temperature", "power"};

std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  for (std::size_t at = 0;;) {
    const std::size_t end = line.find(separator, at);
    std::string_view cell = trimmed(line.substr(at, end - at));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') {
      cell = cell.substr(1, cell.size() - 2);
    }
    cells.push_back(cell);
    if (end == std::string_view::npos) {
      return cells;
    }
    at = end + 1;
  }
}

// Which of kColumns a name means, or their number.
std::size_t meaning(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 15> kNames{
      {{"time", 0},
       {"time_s", 0},
       {"time (s)", 0},
       {"t", 0},
       {"seconds", 0},
       {"temperature", 1},
       {"temperature_c", 1},
       {"temperature (°c)", 1},
       {"temp", 1},
       {"temp_c", 1},
       {"power", 2},
       {"pwm", 2},
       {"output", 2},
       {"duty", 2},
       {"u", 2}}};
  std::string lower(name);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto found = std::ranges::find(kNames, std::string_view(lower),
                                       &std::pair<std::string_view, std::size_t>::first);
  return found == kNames.end() ? kColumns.size() : found->second;
}

struct Header {
  char separator = ',';
  std::array<std::size_t, 3> places{};  // of kColumns among the cells
  std::size_t cells = 0;
};

Result<Header> header_of(const NumberedLine& line, const std::string& file) {
  std::string_view text = line.text;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) {
    text.remove_prefix(kByteOrderMark.size());
  }
  while (text.starts_with('#')) {
    text = trimmed(text.substr(1));
  }
  Header header;
  for (const char separator : {'\t', ';', ','}) {
    if (text.find(separator) != std::string_view::npos) {
      header.separator = separator;
      break;
    }
  }
  const std::vector<std::string_view> names = cells_of(text, header.separator);
  header.cells = names.size();
  header.places.fill(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::size_t column = meaning(names[i]);
    if (column == kColumns.size()) {
      continue;
    }
    if (header.places[column] != names.size()) {
      return fail(ErrorKind::input, {file, line.number},
                  fmt::format("names {} twice; leave one column out", kColumns[column]));
    }
    header.places[column] = i;
  }
  for (std::size_t column = 0; column < kColumns.size(); ++column) {
    if (header.places[column] == names.size()) {
      return fail(ErrorKind::input, {file, line.number},
                  fmt::format("names no column '{}'; begin the table with time,temperature,power, "
                              "in s, °C and counts, or give klippy.log or a serial log",
                              kColumns[column]));
    }
  }
  return header;
}

Result<Sample> row_of(const NumberedLine& line, const std::string& file, const Header& header,
                      double full) {
  const std::vector<std::string_view> cells = cells_of(line.text, header.separator);
  std::array<double, 3> values{};
  for (std::size_t column = 0; column < kColumns.size(); ++column) {
    const std::size_t place = header.places[column];
    const std::optional<double> value =
        place < cells.size() ? parse_real(cells[place]) : std::nullopt;
    if (!value) {
      return fail(ErrorKind::input, {file, line.number},
                  fmt::format("has no number for {}; give one in each row", kColumns[column]));
    }
    values[column] = *value;
  }
  if (values[2] < 0.0 || values[2] > full) {
    return fail(ErrorKind::input, {file, line.number},
                fmt::format("has a power of {}, which is not within 0 and {}; say what full power "
                            "is in this log",
                            values[2], full));
  }
  return Sample{values[0], values[1], values[2] / full * kFullPower};
}

Result<Log> parse_table(const std::vector<NumberedLine>& lines, const std::string& file,
                        const LogOptions& options) {
  const double full = options.full_power.value_or(kFullPower);
  std::optional<Header> header;
  Log log;
  for (const NumberedLine& line : lines) {
    if (line.text.empty() || (header && line.text.starts_with('#'))) {
      continue;
    }
    if (!header) {
      const Result<Header> found = header_of(line, file);
      if (!found) {
        return tl::unexpected(found.error());
      }
      header = *found;
      continue;
    }
    const Result<Sample> row = row_of(line, file, *header, full);
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!log.samples.empty() && row->time_s <= log.samples.back().time_s) {
      return fail(ErrorKind::input, {file, line.number},
                  "is not later than the row before; sort the rows by time and leave doubles out");
    }
    log.samples.push_back(*row);
  }
  if (log.samples.empty()) {
    return fail(ErrorKind::input, {file, 0},
                "has no rows; give a table of time,temperature,power, klippy.log or a serial log");
  }
  return log;
}

}  // namespace

Result<Log> parse_log(std::string_view text, const std::string& file, const LogOptions& options) {
  if (options.full_power && !(*options.full_power > 0.0)) {
    return fail(ErrorKind::usage, "full power must be above 0; give what it is in the log");
  }
  const std::vector<NumberedLine> lines = lines_of(text);
  const bool is_klipper = std::ranges::any_of(
      lines, [](const NumberedLine& line) { return line.text.starts_with("Stats "); });
  if (is_klipper) {
    return parse_klipper(lines, file, options);
  }
  if (std::optional<Result<Log>> serial = parse_serial(lines, file, options)) {
    return std::move(*serial);
  }
  return parse_table(lines, file, options);
}

}  // namespace unflex::hotend
