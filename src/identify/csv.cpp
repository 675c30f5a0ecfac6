#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "samples.hpp"
#include "stdata.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/text.hpp"
#include "unflex/identify/record.hpp"

namespace unflex::identify {
namespace {

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t at = 0;;) {
    const std::size_t comma = line.find(',', at);
    cells.push_back(trimmed(line.substr(at, comma - at)));
    if (comma == std::string_view::npos) {
      return cells;
    }
    at = comma + 1;
  }
}

struct Table {
  std::vector<std::string> header;
  std::vector<Row> rows;
  std::string last_line;  // last line of M956: "Rate 1344, overflows 0"
};

// Reads the first `columns` cells of each row.
std::optional<Row> row_of(std::string_view line, std::size_t columns) {
  Row row;
  for (const std::string_view cell : cells_of(line)) {
    const std::optional<double> value = row.size() < columns ? parse_real(cell) : 0.0;
    if (!value) {
      return std::nullopt;
    }
    if (row.size() < columns) {
      row.push_back(*value);
    }
  }
  return row.size() == columns ? std::optional(row) : std::nullopt;
}

class Parser {
 public:
  Parser(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  Result<std::vector<DataSet>> parse() {
    read_header();
    if (header_.empty()) {
      return fail(ErrorKind::input, {file_, 0}, "is empty");
    }
    const std::string first = header_.front();
    const bool of_three = header_.size() >= 4;
    if (first == "#time" && of_three) {
      return table(4).and_then([&](const Table& t) { return klipper_recording(t); });
    }
    if (first == "Sample" && of_three) {
      return table(4).and_then([&](const Table& t) { return rrf_recording(t); });
    }
    if ((first == "freq" || first == "#freq") && header_.size() >= 2) {
      if (value_columns() < 2) {
        return fail(
            ErrorKind::input, {file_, line_},
            "has no column between the frequencies and 'shapers:'; give the file as Klipper "
            "wrote it");
      }
      return table(value_columns()).and_then([&](const Table& t) { return spectra(t); });
    }
    return fail(ErrorKind::input, {file_, line_},
                "is no record that unflex knows: '#time,accel_x,accel_y,accel_z' or "
                "'freq,psd_x,psd_y,psd_z,...' of Klipper, 'Sample,X,Y,Z' of RepRapFirmware; "
                "docs/identify.md shows how to make one");
  }

 private:
  // The next line without its ending, or nothing at the end.
  std::optional<std::string_view> next() {
    if (text_.empty()) {
      return std::nullopt;
    }
    ++line_;
    const std::size_t end = text_.find('\n');
    const std::string_view line = text_.substr(0, end);
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    return trimmed(line);
  }

  void read_header() {
    while (const auto line = next()) {
      if (!line->empty()) {
        for (const std::string_view cell : cells_of(*line)) {
          header_.emplace_back(cell);
        }
        return;
      }
    }
  }

  // Behind "shapers:" stand the shapers' own columns.
  [[nodiscard]] std::size_t value_columns() const {
    const auto end = std::ranges::find(header_, "shapers:");
    return static_cast<std::size_t>(end - header_.begin());
  }

  Result<Table> table(std::size_t columns) {
    constexpr std::size_t kFewest = 32;
    Table table;
    while (const auto line = next()) {
      if (line->starts_with("Rate ")) {
        table.last_line = *line;
      } else if (!line->empty() && !line->starts_with('#')) {
        std::optional<Row> row = row_of(*line, columns);
        if (!row) {
          return fail(ErrorKind::input, {file_, line_},
                      fmt::format("must be a row of {} numbers", columns));
        }
        table.rows.push_back(std::move(*row));
      }
    }
    if (table.rows.size() < kFewest) {
      return fail(ErrorKind::input, {file_, 0},
                  fmt::format("has {} rows, too few to tell a resonance", table.rows.size()));
    }
    return table;
  }

  Result<std::vector<DataSet>> klipper_recording(const Table& table) const {
    return timed_set(file_, table.rows).map([](DataSet&& set) {
      return std::vector{std::move(set)};
    });
  }

  Result<std::vector<DataSet>> rrf_recording(const Table& table) const {
    const std::string_view last = table.last_line;
    const std::size_t comma = last.find(',');
    const std::optional<double> rate =
        last.empty() ? std::nullopt : parse_real(trimmed(last.substr(5, comma - 5)));
    if (!rate || *rate <= 0.0) {
      return fail(ErrorKind::input, {file_, 0},
                  "ends without the line 'Rate ..., overflows ...' that M956 writes; the recording "
                  "was broken off");
    }
    DataSet set = named_set(file_);
    Recording recording = recording_of(table.rows, *rate);
    recording.is_along_axes = true;
    set.data = std::move(recording);
    if (!last.ends_with("overflows 0")) {
      set.notes.push_back(fmt::format("samples are missing: {}", last));
    }
    return std::vector{std::move(set)};
  }

  // Klipper rounds frequencies to 0.1 Hz, so the step has to come from all rows together.
  static double step_of(const std::vector<Row>& rows) {
    return (rows.back()[0] - rows.front()[0]) / static_cast<double>(rows.size() - 1);
  }

  Result<std::vector<DataSet>> spectra(const Table& table) const {
    const double step_hz = step_of(table.rows);
    if (!(step_hz > 0.0)) {
      return fail(ErrorKind::input, {file_, 0}, "its frequencies do not grow");
    }
    // Klipper samples at no more than 4.5 kHz (icm20948.py), so its spectra end below 2.5 kHz. Our
    // grid begins at 0 Hz wherever the rows begin, and must fit into memory.
    constexpr double kHighest_hz = 10e3;
    if (const double last_hz = table.rows.back()[0]; last_hz > kHighest_hz) {
      return fail(ErrorKind::input, {file_, 0},
                  fmt::format("ends at {} Hz, but no printer's accelerometer measures above {} "
                              "Hz; the first column must be in Hz",
                              last_hz, kHighest_hz));
    }
    const bool is_normalized = std::ranges::find(header_, "shapers:") != header_.end();
    const std::size_t columns = table.rows.front().size();
    if (header_[1] == "psd_x" && columns >= 4) {
      DataSet set = named_set(file_);
      set.data = spectrum(table, step_hz, is_normalized, {1, 2, 3});
      return std::vector{std::move(set)};
    }
    // Each column is the sum over all three axes at one of several points.
    std::vector<DataSet> sets;
    for (std::size_t column = 1; column < columns; ++column) {
      DataSet set = named_set(fmt::format("{} ({})", file_, header_[column]));
      set.data = spectrum(table, step_hz, is_normalized, {column, column, column});
      sets.push_back(std::move(set));
    }
    return sets;
  }

  static Spectrum spectrum(const Table& table, double step_hz, bool is_normalized,
                           const std::array<std::size_t, 3>& columns) {
    // Files of several points are interpolated to steps of 0.2 Hz. Their spectra were computed in
    // the steps of 2048 samples at 3200 Hz, so we go back to these.
    constexpr double kWelchStep_hz = 3200.0 / 2048.0;
    const double first_hz = table.rows.front()[0];
    const double kept_hz = step_hz < 0.5 ? kWelchStep_hz : step_hz;
    Spectrum spectrum;
    spectrum.step_hz = kept_hz;
    spectrum.is_normalized = is_normalized;
    for (double at_hz = 0.0; at_hz <= table.rows.back()[0] + 1e-6; at_hz += kept_hz) {
      const double place =
          std::clamp((at_hz - first_hz) / step_hz, 0.0, static_cast<double>(table.rows.size() - 1));
      const auto below = std::min(static_cast<std::size_t>(place), table.rows.size() - 2);
      const double part = place - static_cast<double>(below);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        spectrum.density[axis].push_back((1.0 - part) * table.rows[below][columns[axis]] +
                                         part * table.rows[below + 1][columns[axis]]);
      }
    }
    return spectrum;
  }

  std::string_view text_;
  std::string file_;
  std::size_t line_ = 0;
  std::vector<std::string> header_;
};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

// "axis=1.000,0.000,0.000", as Klipper names a test along a direction.
std::optional<Axis> axis_of_direction(std::string_view name) {
  constexpr std::string_view kMark = "axis=";
  const std::size_t at = name.find(kMark);
  if (at == std::string_view::npos) {
    return std::nullopt;
  }
  const std::string_view direction = name.substr(at + kMark.size());
  if (direction.starts_with("1.000,0.000") || direction.starts_with("-1.000,0.000")) {
    return Axis::x;
  }
  return direction.starts_with("0.000,1.000") || direction.starts_with("0.000,-1.000")
             ? std::optional(Axis::y)
             : std::nullopt;
}

}  // namespace

char letter(Axis axis) { return axis == Axis::x ? 'x' : 'y'; }

std::optional<Axis> axis_in_name(std::string_view file) {
  const std::string_view name = file.substr(file.rfind('/') + 1);
  if (const std::optional<Axis> axis = axis_of_direction(name)) {
    return axis;
  }
  std::optional<Axis> found;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool stands_alone =
        (i == 0 || !is_letter(name[i - 1])) && (i + 1 == name.size() || !is_letter(name[i + 1]));
    const char c = name[i];
    if (stands_alone && (c == 'x' || c == 'X' || c == 'y' || c == 'Y')) {
      const Axis axis = c == 'x' || c == 'X' ? Axis::x : Axis::y;
      if (found && *found != axis) {
        return std::nullopt;
      }
      found = axis;
    }
  }
  return found;
}

Result<std::vector<DataSet>> parse_records(std::string_view bytes, const std::string& file) {
  return is_stdata(bytes) ? parse_stdata(bytes, file) : Parser(bytes, file).parse();
}

}  // namespace unflex::identify
