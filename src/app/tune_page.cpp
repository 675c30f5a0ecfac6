#include "tune_page.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "unflex/core/base64.hpp"
#include "unflex/report/html_page.hpp"

namespace unflex::app {
namespace {

using tune::Relief;

// A picture of 8 bits per pixel in shades of grey, as a BMP file: all browsers read it, and it
// needs no packing. Rows are from the bottom up, as bands are.
class GreyPicture {
 public:
  GreyPicture(std::size_t width, std::size_t height)
      : width_(width),
        height_(height),
        stride_((width + 3) / 4 * 4),
        pixels_(stride_ * height, '\0') {}

  // value: 0 black to 1 white.
  void set(std::size_t x, std::size_t y, double value) {
    pixels_[y * stride_ + x] = static_cast<char>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  }

  [[nodiscard]] std::string bmp() const {
    constexpr std::uint32_t kShades = 256;
    constexpr std::uint32_t kHeader = 14 + 40 + 4 * kShades;
    std::string bytes = "BM";
    const auto add32 = [&](std::uint32_t value) {
      for (int shift = 0; shift < 32; shift += 8) {
        bytes += static_cast<char>(value >> static_cast<unsigned>(shift));
      }
    };
    add32(kHeader + static_cast<std::uint32_t>(pixels_.size()));
    add32(0);
    add32(kHeader);
    add32(40);
    add32(static_cast<std::uint32_t>(width_));
    add32(static_cast<std::uint32_t>(height_));
    add32(1U | 8U << 16U);  // one plane, bits per pixel
    add32(0);               // not packed
    add32(static_cast<std::uint32_t>(pixels_.size()));
    add32(0);
    add32(0);
    add32(kShades);
    add32(kShades);
    for (std::uint32_t shade = 0; shade < kShades; ++shade) {
      add32(shade * 0x010101U);
    }
    return bytes + pixels_;
  }

 private:
  std::size_t width_;
  std::size_t height_;
  std::size_t stride_;
  std::string pixels_;
};

// The wall in light from one side. A point is as bright as the wall slopes towards the light, so a
// smooth wall is evenly grey.
std::string picture(const std::vector<std::vector<Relief>>& reliefs, std::size_t wall,
                    std::size_t bands) {
  constexpr double kBrightnessPerSlope = 14.0;
  const std::size_t width = reliefs.front()[wall].inward_um.size();
  GreyPicture grey(width, bands);
  for (std::size_t band = 0; band < bands; ++band) {
    const std::vector<double>& inward_um = reliefs[band][wall].inward_um;
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t before = i == 0 ? 0 : i - 1;
      const std::size_t after = std::min(i + 1, width - 1);
      const double slope = 1e-3 * (inward_um[after] - inward_um[before]) /
                           (tune::kRelief_mm * static_cast<double>(after - before));
      grey.set(i, band, 0.62 + kBrightnessPerSlope * slope);
    }
  }
  return to_base64(grey.bmp());
}

// The width of a wall: light where it is thicker, dark where it is thinner. Each row is a band's
// ring, as far as its first side goes.
std::string width_picture(const std::vector<tune::RingWidths>& widths, double side_mm) {
  constexpr double kBrightnessPerShare = 1.2;
  const auto width = static_cast<std::size_t>(side_mm / tune::RingWidths::kBin_mm);
  GreyPicture grey(width, widths.size());
  for (std::size_t band = 0; band < widths.size(); ++band) {
    const std::vector<double>& errors = widths[band].errors;
    for (std::size_t i = 0; i < width; ++i) {
      grey.set(i, band, 0.5 + kBrightnessPerShare * (i < errors.size() ? errors[i] : 0.0));
    }
  }
  return to_base64(grey.bmp());
}

constexpr std::string_view kStyle =
    ".wall { display: flex; gap: .6rem; align-items: flex-start; }\n"
    ".wall img { width: min(100%, 44rem); image-rendering: pixelated; flex: 1 1 auto; "
    "min-width: 0; }\n"
    ".bands { display: flex; flex-direction: column; font-size: .72rem; color: var(--muted); "
    "white-space: nowrap; }\n"
    ".bands span { flex: 1 1 0; line-height: 12px; }\n";

std::string value_text(const tune::Trial& trial, std::size_t band) {
  return trial.parameter == tune::Parameter::freq_hz ? fmt::format("{:.2f} Hz", trial.value(band))
                                                     : fmt::format("ζ {:.3f}", trial.value(band));
}

std::string axis_card(std::size_t axis, const tune::TowerSettings& settings,
                      const tune::Tower& tower, const std::vector<std::vector<Relief>>& reliefs,
                      const tune::TrueAxes& axes) {
  const tune::Trial& trial = settings.trials[axis];
  const char letter = axis == 0 ? 'X' : 'Y';
  const tune::Wall& wall = tower.walls[axis];
  constexpr int kRow_px = 12;
  std::string rows;
  for (std::size_t band = trial.bands; band >= 1; --band) {
    rows += fmt::format("<tr><td>{}</td><td>{:.1f} mm</td><td>{}</td><td>{:.0f} µm</td></tr>\n",
                        band, tower.bottoms_mm[band - 1], value_text(trial, band),
                        reliefs[band - 1][axis].height_um());
  }
  std::string numbers;
  for (std::size_t band = trial.bands; band >= 1; --band) {
    numbers +=
        fmt::format("<span>{}</span>", band % 5 == 0 || band == 1
                                           ? fmt::format("{} · {}", band, value_text(trial, band))
                                           : std::string{});
  }
  return fmt::format(
      "<section class=\"card\"><h2>{0}: the {1} wall tries the {2}</h2>\n"
      "<p>Below is the straight part of the wall behind its waves, {3:.0f} mm of it, as it would "
      "look in light from one side if the axis swung at {4:.2f} Hz with a damping ratio of "
      "{5:.3f}. "
      "On your printer the even zone lies where the band's value is the printer's own. Count the "
      "bands from the bed, by the grooves between them; band 1, 6, 11 … begin with a deep one. "
      "Write down the first and the last band in which you see no waves, and give them as "
      "<code>--read {6}=FIRST..LAST</code>. If all bands show waves, give the one that shows the "
      "least.</p>\n"
      "<div class=\"wall\"><img alt=\"The wall along which {0} is tried\" "
      "style=\"height:{7}px\" src=\"data:image/bmp;base64,{8}\">"
      "<div class=\"bands\" style=\"height:{7}px\">{9}</div></div>\n"
      "<details><summary>All bands</summary><table class=\"data\"><thead><tr><th>band</th>"
      "<th>begins at</th><th>made for</th><th>waves in the picture</th></tr></thead><tbody>\n{10}"
      "</tbody></table></details></section>\n",
      letter, axis == 0 ? "right" : "front",
      trial.parameter == tune::Parameter::freq_hz ? "frequency" : "damping ratio",
      wall.to_mm - wall.from_mm, axes.freq_hz[axis], axes.damping_ratio[axis],
      axis == 0 ? 'x' : 'y', kRow_px * static_cast<int>(trial.bands),
      picture(reliefs, axis, trial.bands), numbers, rows);
}

}  // namespace

std::string tune_page(const tune::TowerSettings& settings, const tune::Tower& tower,
                      const std::vector<std::vector<Relief>>& reliefs, const tune::TrueAxes& axes) {
  std::string body = fmt::format(
      "<section class=\"card\"><h2>A tower of {} bands</h2>\n"
      "<p>Print the file as it is: on the bed's middle, without input shaping of your own, at 100 "
      "% "
      "speed. It is a hollow square of {:.0f} mm, {:.0f} mm high. Its right wall shows the X axis, "
      "its front wall the Y axis. Each band is compensated for another value. Where that is the "
      "printer's own, the wall behind the waves is even.</p></section>\n",
      tower.bands.size(), tower.side_mm,
      tower.bottoms_mm.back() + tower.bottoms_mm[1] - tower.bottoms_mm[0]);
  for (const std::size_t axis : {0U, 1U}) {
    body += axis_card(axis, settings, tower, reliefs, axes);
  }
  return report::html_page(
      {.title = "Calibration tower", .style = std::string(kStyle), .body = body, .script = {}});
}

std::string pressure_page(const tune::PressureTowerSettings& settings, const tune::Tower& tower,
                          const std::vector<tune::RingWidths>& widths,
                          const tune::TrueHotend& hotend) {
  const tune::PressureTrial& trial = settings.trial;
  const bool is_sum = trial.parameter == tune::PressureParameter::sum;
  const auto value_of = [&](std::size_t band) {
    return is_sum ? fmt::format("{:.4f} s", trial.advance_s(band))
                  : fmt::format("{:.2f} ms", 1e3 * trial.dead_time_s(band));
  };
  constexpr int kRow_px = 12;
  std::string rows;
  std::string numbers;
  for (std::size_t band = trial.bands; band >= 1; --band) {
    rows +=
        fmt::format("<tr><td>{}</td><td>{:.1f} mm</td><td>{}</td><td>{:.0f} %</td></tr>\n", band,
                    tower.bottoms_mm[band - 1], value_of(band), 100.0 * widths[band - 1].seen());
    numbers += fmt::format("<span>{}</span>", band % 5 == 0 || band == 1
                                                  ? fmt::format("{} · {}", band, value_of(band))
                                                  : std::string{});
  }
  const tune::PressureWall wall = tune::pressure_wall(settings);
  const std::string body = fmt::format(
      "<section class=\"card\"><h2>A tower of {0} bands: {1}</h2>\n"
      "<p>Print the file as it is, at 100 % speed. It is a hollow square of {2:.0f} mm, {3:.0f} mm "
      "high. Its walls are slow ({4:.0f} mm/s) at both ends and fast ({5:.0f} mm/s) between. Each "
      "band is made for another hotend. Where the speed changes, {6:.0f} mm from the corners' "
      "ends, the wall is thick or thin, unless the band's value is your hotend's own.</p>\n"
      "<p>Below is one wall from the first half of a corner on, as it would be with a pressure "
      "advance of {7:.4f} s and a dead time of {8:.1f} ms: light is thick, dark is thin. Count the "
      "bands from the bed, by the grooves between them; band 1, 6, 11 … begin with a deep one. "
      "Write down the first and the last band whose walls are even, and give them as <code>--read "
      "pressure=FIRST..LAST</code>. If none is, give the one that shows the least: where thick "
      "places and thin ones are about the same.</p>\n"
      "<div class=\"wall\"><img alt=\"A wall of the tower\" style=\"height:{9}px\" "
      "src=\"data:image/bmp;base64,{10}\"><div class=\"bands\" style=\"height:{9}px\">{11}</div>"
      "</div>\n"
      "<details><summary>All bands</summary><table class=\"data\"><thead><tr><th>band</th>"
      "<th>begins at</th><th>made for</th><th>off in the picture</th></tr></thead><tbody>\n{12}"
      "</tbody></table></details></section>\n",
      trial.bands, is_sum ? "pressure advance" : "dead time", tower.side_mm,
      tower.bottoms_mm.back() + tower.bottoms_mm[1] - tower.bottoms_mm[0], wall.slow_mm_s,
      wall.fast_mm_s, wall.slow_mm, hotend.advance_s, 1e3 * hotend.dead_time_s,
      kRow_px * static_cast<int>(trial.bands), width_picture(widths, tower.side_mm), numbers, rows);
  return report::html_page(
      {.title = "Pressure tower", .style = std::string(kStyle), .body = body, .script = {}});
}

}  // namespace unflex::app
