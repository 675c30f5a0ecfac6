#include "tower_writer.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/number.hpp"

namespace unflex::tune {
namespace {

constexpr double kPi = std::numbers::pi;

constexpr double kCornerRadius_mm = 6.0;
constexpr int kCornerLines = 12;
constexpr double kInnerSpeed_mm_s = 50.0;
constexpr double kBaseSpeed_mm_s = 30.0;
constexpr double kTravelSpeed_mm_s = 100.0;
constexpr double kLiftSpeed_mm_s = 10.0;
constexpr std::size_t kBaseLayers = 4;
constexpr int kBrimLoops = 8;
constexpr double kLeastSide_mm = 50.0;
// The first layer of a band is drawn in by this, so that bands can be counted. Every fifth band has
// two such layers.
constexpr double kGroove_mm = 0.2;
constexpr std::size_t kDeepGroove = 5;
constexpr double kLiftAtEnd_mm = 10.0;
constexpr double kClear_mm = 2.0;

// " X… Y…" with `decimals` digits behind the point.
std::string words(const XY& of_axes, int decimals) {
  std::string text;
  for_each_axis([&](std::string_view letter,
                    double value) { text += fmt::format(" {}{:.{}f}", letter, value, decimals); },
                kAxisLetters, of_axes);
  return text;
}

// The direction at this angle from the X axis.
XY direction(double angle_rad) { return {math::cos(angle_rad), math::sin(angle_rad)}; }

// Sets these limits. Klipper has one for all moves, and Marlin and RepRapFirmware one for each axis
// besides, which is set only if the tower goes beyond the printer's own.
std::string accel_commands(Firmware firmware, const AccelLimits& limits, bool with_axes) {
  if (!spec_of(firmware).motion.has_axis_limits) {
    return fmt::format("M204 S{:.0f}", limits.print);
  }
  return (with_axes ? fmt::format("M201{}\n", words(limits, 0)) : std::string{}) +
         fmt::format("M204 P{:.0f} T{:.0f}", limits.print, limits.travel);
}

constexpr std::string_view kCenterMark = "; unflex tune: center=";
constexpr std::string_view kStartMark = "; unflex tune: start=";
constexpr std::string_view kEndMark = "; unflex tune: end=";

std::string codes_comments(const Codes& codes) {
  std::string text =
      fmt::format("{}{:.3f} {:.3f}\n", kCenterMark, codes.center_mm.x, codes.center_mm.y);
  for (const auto& [mark, code] : {std::pair(kStartMark, &codes.start), {kEndMark, &codes.end}}) {
    std::istringstream lines(*code);
    for (std::string line; std::getline(lines, line);) {
      text += fmt::format("{}{}\n", mark, line);
    }
  }
  return text;
}

// The text behind a mark at the begin of a line.
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
  return fmt::format("G1 Z{:.3f} F{:.0f}\nG1{} F{:.0f}\n", bottoms_mm[number - 1],
                     60.0 * kLiftSpeed_mm_s, words(begin_mm, 3), 60.0 * kTravelSpeed_mm_s);
}

TowerWriter::TowerWriter(const TowerPrinter& printer, double wall_mm)
    : printer_(&printer),
      side_mm_(std::max(kLeastSide_mm, std::ceil(wall_mm + 2.0 * kCornerRadius_mm))) {
  // A line with round sides, as slicers reckon it.
  const double area_mm2 = (width() - layer()) * layer() + kPi * math::square(layer() / 2.0);
  e_per_mm_ = area_mm2 / (kPi * math::square(printer.filament_diameter_mm / 2.0));
}

std::string TowerWriter::take() { return std::exchange(text_, {}); }

void TowerWriter::travel(XY to) {
  line(fmt::format("G1{} F{:.0f}", words(to, 3), 60.0 * kTravelSpeed_mm_s));
  at_ = to;
}

void TowerWriter::lift(double z_mm) {
  line(fmt::format("G1 Z{:.3f} F{:.0f}", z_mm, 60.0 * kLiftSpeed_mm_s));
}

void TowerWriter::begin_layer(double z_mm) {
  line(";LAYER_CHANGE");
  line(fmt::format(";Z:{:.3f}", z_mm));
  lift(z_mm);
}

void TowerWriter::ring(double inset_mm, double speed_mm_s) {
  ring(inset_mm, speed_mm_s,
       [&](int wall, double) { extrude(corner(wall + 3, inset_mm, 0.0), speed_mm_s); });
}

void TowerWriter::ring(double inset_mm, double speed_mm_s, const WallOf& wall_of) {
  travel(begin(inset_mm));
  for (int wall = 0; wall < 4; ++wall) {
    // The corner ahead of the wall: its second half first, at the ring's begin.
    arc(wall + 2, inset_mm, wall == 0 ? 0.5 : 0.0, 1.0, std::min(speed_mm_s, kCornerSpeed_mm_s));
    wall_of(wall, inset_mm);
  }
  arc(2, inset_mm, 0.0, 0.5, std::min(speed_mm_s, kCornerSpeed_mm_s));
}

XY TowerWriter::corner(int number, double inset_mm, double share) const {
  const double half_mm = side_mm_ / 2.0 - kCornerRadius_mm;
  const double radius_mm = kCornerRadius_mm - inset_mm;
  const double from = 0.5 * kPi * number;
  const double middle = from + 0.25 * kPi;
  const double angle = from + 0.5 * kPi * share;
  return printer_->codes.center_mm + std::numbers::sqrt2 * half_mm * direction(middle) +
         radius_mm * direction(angle);
}

XY TowerWriter::on_wall(int wall, XY start, double distance_mm, double inward_mm) {
  const XY along = direction(0.5 * kPi * wall);
  return start + distance_mm * along + inward_mm * turned_left(along);
}

void TowerWriter::extrude(XY to, double speed_mm_s) {
  line(fmt::format("G1{} E{:.5f} F{:.0f}", words(to, 4), e_per_mm_ * distance(at_, to),
                   60.0 * speed_mm_s));
  at_ = to;
}

void TowerWriter::arc(int number, double inset_mm, double from, double to, double speed_mm_s) {
  const int lines = static_cast<int>(std::lround(kCornerLines * (to - from)));
  for (int i = 1; i <= lines; ++i) {
    extrude(corner(number, inset_mm, from + (to - from) * i / lines), speed_mm_s);
  }
}

Tower TowerWriter::write(const std::string& mark, const Bands& bands) {
  Tower result;
  result.side_mm = side_mm_;
  result.brim_mm = kBrimLoops * width();
  line("; unflex tune: a tower whose bands are compensated for different values");
  const std::string comments = take() + mark + codes_comments(printer_->codes);
  for (const char* mode : {"G21", "G90", "M83", "G92 E0"}) {
    line(mode);
  }
  const double accel = printer_->accel_mm_s2;
  line(accel_commands(printer_->firmware, {accel, accel, accel, accel}, printer_->own.has_value()));
  result.start = comments + whole_lines(printer_->codes.start) + take();
  // Above whatever the start code has laid.
  lift(kClear_mm);
  travel(begin(-kBrimLoops * width()));
  double z_mm = layer();
  for (std::size_t layer_number = 0; layer_number < kBaseLayers; ++layer_number, z_mm += layer()) {
    begin_layer(z_mm);
    for (int loop = layer_number == 0 ? kBrimLoops : 0; loop > 0; --loop) {
      ring(-loop * width(), kBaseSpeed_mm_s);
    }
    ring(width(), kBaseSpeed_mm_s);
    ring(0.0, kBaseSpeed_mm_s);
    if (layer_number == 0) {
      line("M106 S255");
    }
  }
  result.base = take();
  result.begin_mm = begin(0.0);
  for (std::size_t band = 0; band < bands.count; ++band) {
    text_ += bands.head ? bands.head(band + 1) : std::string{};
    result.bottoms_mm.push_back(z_mm - layer());
    const std::size_t grooves = band % kDeepGroove == 0 ? 2 : 1;
    for (std::size_t i = 0; i < printer_->layers_per_band; ++i, z_mm += layer()) {
      begin_layer(z_mm);
      ring(width(), kInnerSpeed_mm_s);
      // Every band ends with its outer ring in place, from which the next begins.
      const bool groove = i < grooves && i + 1 < printer_->layers_per_band;
      ring(groove ? kGroove_mm : 0.0, bands.corner_speed_mm_s, bands.outer_wall);
    }
    result.bands.push_back(take());
  }
  text_ += bands.after;
  line(fmt::format("G1 E-1.00000 F{:.0f}", 60.0 * kInnerSpeed_mm_s / 2.0));
  lift(z_mm - layer() + kLiftAtEnd_mm);
  if (printer_->own) {
    line(accel_commands(printer_->firmware, *printer_->own, true));
  }
  result.foot = take() + whole_lines(printer_->codes.end);
  return result;
}

Result<Codes> codes_in(
    const std::string& text, const std::string& name, std::string_view mark,
    const std::function<Status(std::string_view line, const SourcePlace& place)>& trial) {
  Codes codes;
  bool has_center = false;
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.ends_with('\r')) {
      line.pop_back();
    }
    if (line.starts_with(mark)) {
      if (Status taken = trial(line, {name, number}); !taken) {
        return tl::unexpected(taken.error());
      }
    } else if (const auto center = behind(line, kCenterMark)) {
      const std::size_t blank = std::min(center->find(' '), center->size());
      const auto x_mm = parse_number(center->substr(0, blank));
      const auto y_mm = parse_number(center->substr(std::min(blank + 1, center->size())));
      has_center = x_mm && y_mm;
      codes.center_mm = {x_mm.value_or(0.0), y_mm.value_or(0.0)};
    } else if (const auto start = behind(line, kStartMark)) {
      codes.start += fmt::format("{}\n", *start);
    } else if (const auto end = behind(line, kEndMark)) {
      codes.end += fmt::format("{}\n", *end);
    } else if (has_center && !line.starts_with(';')) {
      // All comments stand before the first command.
      break;
    }
  }
  if (!has_center) {
    return fail(ErrorKind::input, {name, 0}, kNoTower);
  }
  return codes;
}

}  // namespace unflex::tune
