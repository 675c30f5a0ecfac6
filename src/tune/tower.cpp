#include "unflex/tune/tower.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "unflex/core/number.hpp"

namespace unflex::tune {
namespace {

constexpr double kPi = std::numbers::pi;

constexpr double kCornerRadius_mm = 6.0;
constexpr int kCornerLines = 12;
constexpr double kCornerSpeed_mm_s = 30.0;
constexpr double kInnerSpeed_mm_s = 50.0;
constexpr double kBaseSpeed_mm_s = 30.0;
constexpr double kTravelSpeed_mm_s = 100.0;
constexpr double kLiftSpeed_mm_s = 10.0;
constexpr std::size_t kBaseLayers = 4;
constexpr int kBrimLoops = 8;
// A wall is even for so long before its waves begin.
constexpr double kLeadIn_mm = 3.0;
// The axis can be seen to swing so many times behind the waves.
constexpr double kSwingsSeen = 7.0;
// A swing is so long on the wall that waves can be told apart.
constexpr double kSwing_mm = 2.2;
constexpr double kSlowest_mm_s = 50.0;
constexpr double kFastest_mm_s = 160.0;
// The speed while nothing is known of the axis: swings of 22 to 104 Hz are 5.5 to 1.2 mm long.
constexpr double kBroadSpeed_mm_s = 120.0;
constexpr double kLongestRunUp_mm = 10.0;
constexpr double kLeastSide_mm = 50.0;
// The first layer of a band is drawn in by this, so that bands can be counted. Of every fifth, two
// layers are.
constexpr double kGroove_mm = 0.2;
constexpr std::size_t kDeepGroove = 5;
constexpr double kLiftAtEnd_mm = 10.0;
constexpr double kClear_mm = 2.0;

double speed_of(const TowerSettings& settings, const Trial& trial) {
  const double wanted = trial.known.has_freq() ? std::clamp(kSwing_mm * trial.known.freq_hz,
                                                            kSlowest_mm_s, kFastest_mm_s)
                                               : kBroadSpeed_mm_s;
  return std::min({wanted, settings.max_velocity_mm_s,
                   std::sqrt(2.0 * settings.accel_mm_s2 * kLongestRunUp_mm)});
}

// Marlin slows down for the angle between short lines. With whole steps that angle is mostly
// rounding, and large where lines are short.
int lines_per_wave(Firmware firmware) { return firmware == Firmware::marlin ? 6 : 16; }

// The parts of a wall, one behind the other.
struct Parts {
  double speed_mm_s = 0.0;
  double lead_in_mm = 0.0;  // with the way it takes to come up to speed
  double wave_mm = 0.0;     // length of one wave
  double straight_mm = 0.0;
  double run_out_mm = 0.0;

  [[nodiscard]] double length_mm(const Waves& waves) const {
    return lead_in_mm + waves.count * wave_mm + straight_mm + run_out_mm;
  }
};

Parts parts_of(const TowerSettings& settings, const Trial& trial) {
  Parts parts;
  parts.speed_mm_s = speed_of(settings, trial);
  const double run_up_mm = parts.speed_mm_s * parts.speed_mm_s / (2.0 * settings.accel_mm_s2);
  parts.lead_in_mm = run_up_mm + kLeadIn_mm;
  parts.wave_mm = parts.speed_mm_s / trial.waves.freq_hz;
  parts.straight_mm =
      kSwingsSeen * parts.speed_mm_s / std::min(trial.freq_hz(1), trial.freq_hz(trial.bands));
  parts.run_out_mm = run_up_mm + 1.0;
  return parts;
}

struct Point {
  double x_mm = 0.0;
  double y_mm = 0.0;
};

class Writer {
 public:
  explicit Writer(const TowerSettings& settings) : settings_(&settings) {
    const double layer_mm = layer();
    const double width_mm = width();
    // A line with round sides, as slicers reckon it.
    const double area_mm2 = (width_mm - layer_mm) * layer_mm + kPi * std::pow(layer_mm / 2.0, 2);
    e_per_mm_ = area_mm2 / (kPi * std::pow(settings.filament_diameter_mm / 2.0, 2));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      parts_[axis] = parts_of(settings, settings.trials[axis]);
      const double wall_mm = parts_[axis].length_mm(settings.trials[axis].waves);
      side_mm_ = std::max(side_mm_, std::ceil(wall_mm + 2.0 * kCornerRadius_mm));
    }
  }

  [[nodiscard]] double layer() const { return 0.5 * settings_->nozzle_diameter_mm; }
  [[nodiscard]] double width() const { return 1.125 * settings_->nozzle_diameter_mm; }
  [[nodiscard]] double side_mm() const { return side_mm_; }
  [[nodiscard]] std::string take() { return std::exchange(text_, {}); }

  void line(const std::string& text) { text_ += text + "\n"; }

  void travel(Point to) {
    line(fmt::format("G1 X{:.3f} Y{:.3f} F{:.0f}", to.x_mm, to.y_mm, 60.0 * kTravelSpeed_mm_s));
    at_ = to;
  }

  void lift(double z_mm) { line(fmt::format("G1 Z{:.3f} F{:.0f}", z_mm, 60.0 * kLiftSpeed_mm_s)); }

  void begin_layer(double z_mm) {
    line(";LAYER_CHANGE");
    line(fmt::format(";Z:{:.3f}", z_mm));
    lift(z_mm);
  }

  // Where the square's ring begins, in the middle of the corner at the bottom left.
  [[nodiscard]] Point begin(double inset_mm) const { return corner(2, inset_mm, 0.5); }

  // One ring of the square, drawn in by inset_mm. With `waves` its walls have them and are fast.
  void ring(double inset_mm, double speed_mm_s, bool waves) {
    travel(begin(inset_mm));
    for (int wall = 0; wall < 4; ++wall) {
      // The corner ahead of the wall: its second half first, at the ring's begin.
      arc(wall + 2, inset_mm, wall == 0 ? 0.5 : 0.0, 1.0, std::min(speed_mm_s, kCornerSpeed_mm_s));
      waves ? wall_with_waves(wall, inset_mm)
            : extrude(corner(wall + 3, inset_mm, 0.0), speed_mm_s);
    }
    arc(2, inset_mm, 0.0, 0.5, std::min(speed_mm_s, kCornerSpeed_mm_s));
  }

  // The straight part of a wall of the outer ring: 0 bottom, 1 right.
  [[nodiscard]] Wall straight_part(int wall) const {
    const std::size_t axis = axis_of(wall);
    const Parts& parts = parts_[axis];
    const Waves& waves = settings_->trials[axis].waves;
    const Point start = corner(wall + 2, 0.0, 1.0);
    const double from_mm = parts.lead_in_mm + waves.count * parts.wave_mm;
    const double begin_mm = wall == 0 ? start.x_mm : start.y_mm;
    return {axis == 0, axis == 0 ? start.x_mm : start.y_mm, begin_mm + from_mm,
            begin_mm + from_mm + parts.straight_mm, parts.speed_mm_s};
  }

 private:
  // Walls along X show Y.
  [[nodiscard]] static std::size_t axis_of(int wall) { return wall % 2 == 0 ? 1 : 0; }

  // A point of a corner, which is a quarter of a circle: 2 bottom left, 3 bottom right, 4 or 0 top
  // right, 5 or 1 top left. share: 0 where the ring comes in, 1 where it leaves.
  [[nodiscard]] Point corner(int number, double inset_mm, double share) const {
    const double half_mm = side_mm_ / 2.0 - kCornerRadius_mm;
    const double radius_mm = kCornerRadius_mm - inset_mm;
    const double from = 0.5 * kPi * number;
    const double middle = from + 0.25 * kPi;
    const double angle = from + 0.5 * kPi * share;
    return {settings_->codes.center_x_mm + std::numbers::sqrt2 * half_mm * std::cos(middle) +
                radius_mm * std::cos(angle),
            settings_->codes.center_y_mm + std::numbers::sqrt2 * half_mm * std::sin(middle) +
                radius_mm * std::sin(angle)};
  }

  void extrude(Point to, double speed_mm_s) {
    const double length_mm = std::hypot(to.x_mm - at_.x_mm, to.y_mm - at_.y_mm);
    line(fmt::format("G1 X{:.4f} Y{:.4f} E{:.5f} F{:.0f}", to.x_mm, to.y_mm, e_per_mm_ * length_mm,
                     60.0 * speed_mm_s));
    at_ = to;
  }

  void arc(int number, double inset_mm, double from, double to, double speed_mm_s) {
    const int lines = static_cast<int>(std::lround(kCornerLines * (to - from)));
    for (int i = 1; i <= lines; ++i) {
      extrude(corner(number, inset_mm, from + (to - from) * i / lines), speed_mm_s);
    }
  }

  void wall_with_waves(int wall, double inset_mm) {
    const std::size_t axis = axis_of(wall);
    const Parts& parts = parts_[axis];
    const Waves& waves = settings_->trials[axis].waves;
    const Point start = corner(wall + 2, inset_mm, 1.0);
    const double along = 0.5 * kPi * wall;
    const auto to = [&](double distance_mm, double inward_mm) {
      extrude({start.x_mm + distance_mm * std::cos(along) - inward_mm * std::sin(along),
               start.y_mm + distance_mm * std::sin(along) + inward_mm * std::cos(along)},
              parts.speed_mm_s);
    };
    to(parts.lead_in_mm, 0.0);
    const int per_wave = lines_per_wave(settings_->firmware);
    const int lines = per_wave * waves.count;
    for (int i = 1; i <= lines; ++i) {
      const double waves_done = static_cast<double>(i) / per_wave;
      to(parts.lead_in_mm + parts.wave_mm * waves_done,
         0.5 * waves.height_mm() * (1.0 - std::cos(2.0 * kPi * waves_done)));
    }
    extrude(corner(wall + 3, inset_mm, 0.0), parts.speed_mm_s);
  }

  const TowerSettings* settings_;
  std::array<Parts, 2> parts_;
  double e_per_mm_ = 0.0;
  double side_mm_ = kLeastSide_mm;
  Point at_;
  std::string text_;
};

// Sets these limits. Klipper has one for all moves, and Marlin and RepRapFirmware one for each axis
// besides, which is set only if the tower goes beyond the printer's own.
std::string accel_commands(Firmware firmware, const AccelLimits& limits, bool with_axes) {
  if (firmware == Firmware::klipper) {
    return fmt::format("M204 S{:.0f}", limits.print);
  }
  return (with_axes ? fmt::format("M201 X{:.0f} Y{:.0f}\n", limits.x, limits.y) : std::string{}) +
         fmt::format("M204 P{:.0f} T{:.0f}", limits.print, limits.travel);
}

constexpr std::string_view kCenterMark = "; unflex tune: center=";
constexpr std::string_view kStartMark = "; unflex tune: start=";
constexpr std::string_view kEndMark = "; unflex tune: end=";

std::string codes_comments(const Codes& codes) {
  std::string text =
      fmt::format("{}{:.3f} {:.3f}\n", kCenterMark, codes.center_x_mm, codes.center_y_mm);
  for (const auto& [mark, code] : {std::pair(kStartMark, &codes.start), {kEndMark, &codes.end}}) {
    std::istringstream lines(*code);
    for (std::string line; std::getline(lines, line);) {
      text += fmt::format("{}{}\n", mark, line);
    }
  }
  return text;
}

// What follows a mark at the begin of a line.
std::optional<std::string_view> behind(std::string_view line, std::string_view mark) {
  return line.starts_with(mark) ? std::optional(line.substr(mark.size())) : std::nullopt;
}

std::string whole_lines(const std::string& text) {
  return text.empty() || text.ends_with('\n') ? text : text + "\n";
}

constexpr const char* kStandstill = "M400";

}  // namespace

std::string band_begins(std::size_t number) {
  return fmt::format("; band {} begins\n{}\n", number, kStandstill);
}

std::string band_ends(std::size_t number) {
  return fmt::format("; band {} ends\n{}\n", number, kStandstill);
}

std::string Tower::approach(std::size_t number) const {
  return fmt::format("G1 Z{:.3f} F{:.0f}\nG1 X{:.3f} Y{:.3f} F{:.0f}\n", bottoms_mm[number - 1],
                     60.0 * kLiftSpeed_mm_s, begin_x_mm, begin_y_mm, 60.0 * kTravelSpeed_mm_s);
}

Tower tower(const TowerSettings& settings) {
  Writer writer(settings);
  Tower result;
  result.side_mm = writer.side_mm();
  result.brim_mm = kBrimLoops * writer.width();
  const double layer_mm = writer.layer();
  const double width_mm = writer.width();
  writer.line("; unflex tune: a tower whose bands are compensated for different values");
  for (const char axis : {'x', 'y'}) {
    writer.line(to_comment(axis, settings.trials[axis == 'x' ? 0 : 1]));
  }
  const std::string comments = writer.take() + codes_comments(settings.codes);
  for (const char* mode : {"G21", "G90", "M83", "G92 E0"}) {
    writer.line(mode);
  }
  const double accel = settings.accel_mm_s2;
  writer.line(
      accel_commands(settings.firmware, {accel, accel, accel, accel}, settings.own.has_value()));
  result.start = comments + whole_lines(settings.codes.start) + writer.take();
  // Above whatever the start code has laid.
  writer.lift(kClear_mm);
  writer.travel(writer.begin(-kBrimLoops * width_mm));
  double z_mm = layer_mm;
  for (std::size_t layer = 0; layer < kBaseLayers; ++layer, z_mm += layer_mm) {
    writer.begin_layer(z_mm);
    for (int loop = layer == 0 ? kBrimLoops : 0; loop > 0; --loop) {
      writer.ring(-loop * width_mm, kBaseSpeed_mm_s, false);
    }
    writer.ring(width_mm, kBaseSpeed_mm_s, false);
    writer.ring(0.0, kBaseSpeed_mm_s, false);
    if (layer == 0) {
      writer.line("M106 S255");
    }
  }
  result.base = writer.take();
  result.begin_x_mm = writer.begin(0.0).x_mm;
  result.begin_y_mm = writer.begin(0.0).y_mm;
  const std::size_t bands = std::max(settings.trials[0].bands, settings.trials[1].bands);
  for (std::size_t band = 0; band < bands; ++band) {
    result.bottoms_mm.push_back(z_mm - layer_mm);
    const std::size_t grooves = band % kDeepGroove == 0 ? 2 : 1;
    for (std::size_t layer = 0; layer < settings.layers_per_band; ++layer, z_mm += layer_mm) {
      writer.begin_layer(z_mm);
      writer.ring(width_mm, kInnerSpeed_mm_s, false);
      // Every band ends with its outer ring in place, from which the next begins.
      const bool groove = layer < grooves && layer + 1 < settings.layers_per_band;
      writer.ring(groove ? kGroove_mm : 0.0, kCornerSpeed_mm_s, true);
    }
    result.bands.push_back(writer.take());
  }
  writer.line(fmt::format("G1 E-1.00000 F{:.0f}", 60.0 * kInnerSpeed_mm_s / 2.0));
  writer.lift(z_mm - layer_mm + kLiftAtEnd_mm);
  if (settings.own) {
    writer.line(accel_commands(settings.firmware, *settings.own, true));
  }
  result.foot = writer.take() + whole_lines(settings.codes.end);
  // Walls printed first in each ring.
  result.walls = {writer.straight_part(1), writer.straight_part(0)};
  return result;
}

Result<TowerRecord> record_of(const std::string& text, const std::string& name) {
  TowerRecord record;
  std::array<bool, 2> found{};
  bool has_center = false;
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.ends_with('\r')) {
      line.pop_back();
    }
    if (line.starts_with(kTrialMark)) {
      const Result<AxisTrial> trial = from_comment(line, {name, number});
      if (!trial) {
        return tl::unexpected(trial.error());
      }
      const std::size_t axis = trial->axis == 'x' ? 0 : 1;
      record.trials[axis] = trial->trial;
      found[axis] = true;
    } else if (const auto center = behind(line, kCenterMark)) {
      const std::size_t blank = std::min(center->find(' '), center->size());
      const auto x_mm = parse_number(center->substr(0, blank));
      const auto y_mm = parse_number(center->substr(std::min(blank + 1, center->size())));
      has_center = x_mm && y_mm;
      record.codes.center_x_mm = x_mm.value_or(0.0);
      record.codes.center_y_mm = y_mm.value_or(0.0);
    } else if (const auto start = behind(line, kStartMark)) {
      record.codes.start += fmt::format("{}\n", *start);
    } else if (const auto end = behind(line, kEndMark)) {
      record.codes.end += fmt::format("{}\n", *end);
    } else if (has_center && !line.starts_with(';')) {
      // All comments stand before the first command.
      break;
    }
  }
  if (!found[0] || !found[1] || !has_center) {
    return fail(ErrorKind::input, {name, 0},
                "is no tower of unflex tune, or has lost its first lines; give the file as it was "
                "made");
  }
  return record;
}

}  // namespace unflex::tune
