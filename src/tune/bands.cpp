#include "unflex/tune/bands.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <istream>
#include <iterator>
#include <limits>

#include "unflex/core/axes.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/run/verify_rules.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::tune {
namespace {

machine::Settings settings_of_band(const machine::Settings& settings,
                                   const Axes<tune::Trial>& trials, std::size_t band) {
  machine::Settings result = settings;
  const auto set = [&](machine::AxisDynamics& axis, const tune::Trial& trial) {
    const std::size_t number = std::min(band, trial.bands);
    axis = {.freq_hz = trial.freq_hz(number), .damping_ratio = trial.damping_ratio(number)};
  };
  for_each_axis(set, result.dynamics, trials);
  result.dynamics_error = {.freq = 0.0, .damping = 0.0};
  result.second = {};
  result.solve.along_weight = 1.0;
  return result;
}

machine::Settings settings_of_band(const machine::Settings& settings,
                                   const tune::PressureTrial& trial, std::size_t band) {
  machine::Settings result = settings;
  result.pressure.written = true;
  result.pressure.shape = machine::PressureSettings{}.shape;
  result.pressure.advance_s = trial.advance_s(band);
  result.pressure.dead_time_ms = 1e3 * trial.dead_time_s(band);
  return result;
}

template <class Trials>
std::vector<machine::Settings> settings_of_all(const machine::Settings& settings,
                                               const Trials& trials, std::size_t bands) {
  std::vector<machine::Settings> result;
  for (std::size_t band = 1; band <= bands; ++band) {
    result.push_back(settings_of_band(settings, trials, band));
  }
  return result;
}

// The first of the band's runs that stays as sliced, and so shows nothing; null if there is none.
const report::Fallback* kept_run(const report::Report& report, const std::string& sliced,
                                 std::size_t band) {
  const auto line_of = [&](const std::string& mark) {
    const auto end = sliced.begin() + static_cast<std::ptrdiff_t>(sliced.find(mark));
    return static_cast<std::size_t>(std::count(sliced.begin(), end, '\n')) + 1;
  };
  const std::size_t first = line_of(tune::band_begins(band));
  const std::size_t last = line_of(tune::band_ends(band));
  const auto found =
      std::ranges::find_if(report.runs.fallbacks, [&](const report::Fallback& fallback) {
        return fallback.last_line >= first && fallback.first_line <= last;
      });
  return found == report.runs.fallbacks.end() ? nullptr : &*found;
}

Result<std::string> compensate_band(const std::string& sliced, const machine::Settings& settings,
                                    std::size_t band, unsigned workers, Progress& progress) {
  const std::string name = fmt::format("band {} of the tower", band);
  const flow::Job job{.input = memory_store(sliced),
                      .input_name = name,
                      .output = memory_store(),
                      .output_name = name,
                      .settings = settings,
                      .engine = flow::EngineChoice::banded,
                      .workers = workers};
  const Result<report::Report> report = flow::compensate(job, progress);
  if (!report) {
    return tl::unexpected(report.error());
  }
  if (report->violation_count > 0) {
    return fail(ErrorKind::internal, fmt::format("a band breaks a rule, which is a fault of "
                                                 "unflex: {}",
                                                 report->violations.front()));
  }
  if (const report::Fallback* const kept = kept_run(*report, sliced, band)) {
    return fail(
        ErrorKind::usage,
        fmt::format("{} stays as sliced, so nothing can be read from it: {}", name, kept->reason));
  }
  return std::string(std::istreambuf_iterator<char>(*job.output->read()), {});
}

// Progress of one band among all.
class BandProgress final : public Progress {
 public:
  BandProgress(Progress& all, std::size_t bands) : all_(&all), bands_(bands) {}
  void begin(std::size_t band) { band_ = band; }
  void update(std::string_view, double fraction) override {
    all_->update("compensating the tower", (static_cast<double>(band_) + std::max(0.0, fraction)) /
                                               static_cast<double>(bands_));
  }
  [[nodiscard]] bool cancelled() const override { return all_->cancelled(); }

 private:
  Progress* all_;
  std::size_t bands_;
  std::size_t band_ = 0;
};

// Looks at one thing while a band is verified.
class Watcher : public verify::Observer {
 public:
  void line(const gcode::Line&) override {}
  void section(const verify::ReferencePath&, const verify::ReferencePath&) override {}
  void step(verify::NozzleId, const verify::NozzleStep&) override {}
  void hold(double) override {}
  void advanced(const verify::ReferencePath&, double) override {}
  [[nodiscard]] double memory_s() const override { return 0.0; }
  [[nodiscard]] bool asks_for_unshaped() const override { return false; }
};

// Has `watcher` look while the band is printed on the rules' machine, and on further machines.
Status watch(const Band& band, const verify::Rules& rules,
             const std::vector<verify::NozzleModel>& others, Watcher& watcher, Progress& progress) {
  std::istringstream sliced(band.sliced);
  std::istringstream compensated(band.compensated);
  const Result<verify::VerifyReport> report =
      verify::verify(sliced, "the tower", compensated, "the compensated tower", rules, progress,
                     {.detuned = others, .observer = &watcher});
  return report ? Status{} : tl::unexpected(report.error());
}

// Looks at the nozzle in the straight parts of walls.
class WallWatcher final : public Watcher {
 public:
  explicit WallWatcher(const std::vector<tune::Wall>& walls) : walls_(&walls) {
    for (const tune::Wall& wall : walls) {
      const double length_mm = wall.to_mm - wall.from_mm;
      reliefs_.push_back(
          {std::vector<double>(static_cast<std::size_t>(std::floor(length_mm / kRelief_mm)), 0.0)});
    }
  }

  void step(verify::NozzleId nozzle, const verify::NozzleStep& step) override {
    if (nozzle.base != verify::NozzleBase::emitted || nozzle.model != 1 || !step.extruding) {
      return;
    }
    for (std::size_t i = 0; i < walls_->size(); ++i) {
      look(step.nozzle, (*walls_)[i], reliefs_[i]);
    }
  }

  [[nodiscard]] const std::vector<Relief>& reliefs() const { return reliefs_; }

 private:
  // Later layers lie upon earlier ones, and only the outer ring counts.
  static void look(const dynamics::NozzleMotionXY& nozzle, const tune::Wall& wall, Relief& relief) {
    constexpr double kNear_mm = 0.15;
    const std::size_t shown = wall.shows_x ? gcode::X : gcode::Y;
    const double across_mm = nozzle[shown].position;
    const double along_mm = nozzle[1 - shown].position - wall.from_mm;
    // The right wall's inside is towards −X, the bottom wall's towards +Y.
    const double inward_mm = wall.shows_x ? wall.at_mm - across_mm : across_mm - wall.at_mm;
    const double place = along_mm / kRelief_mm;
    if (std::abs(inward_mm) < kNear_mm && place >= 0.0 &&
        place < static_cast<double>(relief.inward_um.size())) {
      relief.inward_um[static_cast<std::size_t>(place)] = 1e3 * inward_mm;
    }
  }

  const std::vector<tune::Wall>* walls_;
  std::vector<Relief> reliefs_;
};

// Takes the widths of a band's last line of plastic, which is the outer ring of its last layer.
class WidthWatcher final : public Watcher {
 public:
  void width(verify::NozzleId nozzle, const verify::WidthBin& bin) override {
    if (nozzle.base != verify::NozzleBase::emitted || nozzle.model != 0) {
      return;
    }
    if (bin.path != path_) {
      path_ = bin.path;
      widths_.errors.clear();
    }
    widths_.errors.push_back(bin.error);
  }

  [[nodiscard]] const RingWidths& widths() const { return widths_; }

 private:
  std::size_t path_ = 0;
  RingWidths widths_;
};

}  // namespace

double Relief::height_um() const {
  if (inward_um.empty()) {
    return 0.0;
  }
  const auto [low, high] = std::ranges::minmax(inward_um);
  return high - low;
}

std::vector<machine::Settings> settings_of_bands(const tune::TowerSettings& tower,
                                                 const machine::Settings& settings) {
  return settings_of_all(settings, tower.trials,
                         std::max(tower.trials[0].bands, tower.trials[1].bands));
}

std::vector<machine::Settings> settings_of_bands(const tune::PressureTowerSettings& tower,
                                                 const machine::Settings& settings) {
  return settings_of_all(settings, tower.trial, tower.trial.bands);
}

Result<std::vector<Band>> compensate_bands(const tune::Tower& tower,
                                           const std::vector<machine::Settings>& settings,
                                           unsigned workers, Progress& progress) {
  std::vector<Band> result;
  BandProgress part(progress, tower.bands.size());
  for (std::size_t number = 1; number <= tower.bands.size(); ++number) {
    part.begin(number - 1);
    std::string sliced = tower.start + (number == 1 ? tower.base : tower.approach(number)) +
                         tune::band_begins(number) + tower.bands[number - 1] +
                         tune::band_ends(number) + tower.foot;
    const machine::Settings& made_for = settings[number - 1];
    Result<std::string> compensated = compensate_band(sliced, made_for, number, workers, part);
    if (!compensated) {
      return tl::unexpected(compensated.error());
    }
    result.push_back({made_for, std::move(sliced), std::move(*compensated)});
  }
  return result;
}

std::string join_bands(const std::vector<Band>& bands) {
  std::string text;
  for (std::size_t number = 1; number <= bands.size(); ++number) {
    const std::string& file = bands[number - 1].compensated;
    // The first band has the tower's head, the last its foot.
    const std::size_t begin = number == 1 ? 0 : file.find(tune::band_begins(number));
    const std::string mark = tune::band_ends(number);
    const std::size_t end = number == bands.size() ? file.size() : file.find(mark) + mark.size();
    text += file.substr(begin, end - begin);
  }
  return text;
}

Result<std::vector<std::vector<Relief>>> print_bands(const std::vector<Band>& bands,
                                                     const tune::Tower& tower, const TrueAxes& axes,
                                                     Progress& progress) {
  std::vector<std::vector<Relief>> result;
  const verify::NozzleModel model{dynamics::from_frequency(axes.freq_hz[0], axes.damping_ratio[0]),
                                  dynamics::from_frequency(axes.freq_hz[1], axes.damping_ratio[1])};
  for (const Band& band : bands) {
    WallWatcher watcher(tower.walls);
    if (Status watched = watch(band, run::verify_rules(band.made_for), {model}, watcher, progress);
        !watched) {
      return tl::unexpected(watched.error());
    }
    result.push_back(watcher.reliefs());
  }
  return result;
}

static_assert(RingWidths::kBin_mm == verify::kWidthBin_mm);

double RingWidths::seen() const {
  double largest = 0.0;
  for (std::size_t i = 0; i + kBinsSeen <= errors.size(); ++i) {
    double sum = 0.0;
    for (std::size_t j = i; j < i + kBinsSeen; ++j) {
      sum += errors[j];
    }
    largest = std::max(largest, std::abs(sum) / static_cast<double>(kBinsSeen));
  }
  return largest;
}

Result<std::vector<RingWidths>> print_bands(const std::vector<Band>& bands,
                                            const TrueHotend& hotend, Progress& progress) {
  std::vector<RingWidths> result;
  for (const Band& band : bands) {
    machine::Settings as_it_is = band.made_for;
    as_it_is.pressure.advance_s = hotend.advance_s;
    as_it_is.pressure.dead_time_ms = 1e3 * hotend.dead_time_s;
    WidthWatcher watcher;
    if (Status watched = watch(band, run::verify_rules(as_it_is), {}, watcher, progress);
        !watched) {
      return tl::unexpected(watched.error());
    }
    result.push_back(watcher.widths());
  }
  return result;
}

}  // namespace unflex::tune
