// Notation of along_print.hpp.
#include "unflex/hotend/along_print.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "controller.hpp"
#include "unflex/core/math.hpp"

namespace unflex::hotend {
namespace {

// Firmwares stop waiting this near the target: Klipper's PID_SETTLE_DELTA (heaters.py),
// Marlin's TEMP_WINDOW, RepRapFirmware's TEMPERATURE_CLOSE_ENOUGH.
constexpr double kReached_c = 1.0;
constexpr double kLongestWait_s = 1800.0;
constexpr double kStep_s = Course::kStep_s;

// The step that begins at a time or contains it.
std::size_t step_at(double time_s) {
  constexpr double kRounding = 1e-6;
  return static_cast<std::size_t>(std::max(0.0, time_s / kStep_s + kRounding));
}

class HotLoop {
 public:
  HotLoop(const Loop& loop, double target_c)
      : loop_(loop),
        ticks_per_sample_(std::max(1L, std::lround(loop.control.sample_s / kStep_s))),
        controller_(loop.control, static_cast<double>(ticks_per_sample_) * kStep_s,
                    loop.plant.full_power, loop.plant.holding_power(target_c)),
        simulation_(loop.plant, target_c) {}

  void tick(double target_c, double volume_mm3) {
    if (ticks_++ % ticks_per_sample_ == 0) {
      power_ = controller_.power(target_c - temperature_c());
    }
    double load = 0.0;
    if (loop_.heater_w && volume_mm3 > 0.0) {
      const double melting_w =
          melting_power_w(volume_mm3 / kStep_s, temperature_c() - loop_.plant.ambient_c);
      load = load_in_counts(loop_.plant, melting_w, *loop_.heater_w);
    }
    simulation_.advance(power_, kStep_s, load);
  }

  [[nodiscard]] double temperature_c() const { return simulation_.temperature_c(); }

 private:
  Loop loop_;
  long ticks_per_sample_;
  long ticks_ = 0;
  double power_ = 0.0;
  Controller controller_;
  Simulation simulation_;
};

bool is_reached(const Command& command, double target_c, double temperature_c) {
  return temperature_c >= target_c - kReached_c &&
         (command.wait == Wait::heating || temperature_c <= target_c + kReached_c);
}

// The target that is wanted in a step, for steps that rise. 0: none.
class Wanted {
 public:
  explicit Wanted(const std::vector<Target>& targets) : targets_(&targets) {}

  double at(std::size_t step) {
    while (next_ < targets_->size() && step_at((*targets_)[next_].time_s) <= step) {
      target_c_ = (*targets_)[next_++].target_c;
    }
    return target_c_;
  }

 private:
  const std::vector<Target>* targets_;
  std::size_t next_ = 0;
  double target_c_ = 0.0;
};

struct Start {
  std::size_t step = 0;
  double target_c = 0.0;
};

// The first step in which the temperature is known, and the target at which the hotend rests there.
std::optional<Start> start(const Course& course, const std::vector<Command>& commands) {
  const auto first_extrusion = std::ranges::find_if(
      course.steps, [](const Course::Step& step) { return step.extruding_s > 0.0F; });
  Start known{static_cast<std::size_t>(first_extrusion - course.steps.begin()), 0.0};
  for (const Command& command : commands) {
    const std::size_t step = step_at(command.time_s);
    if (!command.target_c || (step > known.step && known.target_c > 0.0)) {
      continue;
    }
    known = {std::max(step, known.step), *command.target_c};
  }
  return known.target_c > 0.0 ? std::optional(known) : std::nullopt;
}

void judge(const Course::Step& step, double off_c, double band_c, std::size_t line,
           PrintResponse& result) {
  if (!(step.extruding_s > 0.0F)) {
    return;
  }
  result.colder_s += off_c < -band_c ? step.extruding_s : 0.0;
  result.hotter_s += off_c > band_c ? step.extruding_s : 0.0;
  if (std::abs(off_c) > std::abs(result.worst_c)) {
    result.worst_c = off_c;
    result.worst_line = line;
  }
}

// The latest line that begins before time_s, and not before free_from_s.
std::optional<Ahead> place_before(const Course& course, double time_s, double free_from_s) {
  if (!(time_s > free_from_s)) {
    return std::nullopt;
  }
  // What begins in a step begins before its end.
  for (std::size_t k = step_at(time_s); k-- > 0;) {
    const double begin_s = static_cast<double>(k) * kStep_s;
    if (begin_s < free_from_s) {
      break;
    }
    if (k < course.steps.size() && course.steps[k].first_line != 0) {
      return Ahead{.before_line = course.steps[k].first_line, .time_s = begin_s};
    }
  }
  return std::nullopt;
}

std::vector<Ahead> candidates(const Plant& plant, const Course& course,
                              const std::vector<Command>& commands, double band_c, AheadWhen when) {
  std::vector<Ahead> found;
  double from_c = 0.0;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const Command& command = commands[i];
    if (!command.target_c) {
      continue;
    }
    const double to_c = *command.target_c;
    const double before_c = std::exchange(from_c, to_c);
    const double change_c = to_c - before_c;
    if (command.text.empty() || before_c <= 0.0 || to_c <= 0.0 || std::abs(change_c) <= band_c ||
        (change_c < 0.0 && when == AheadWhen::heating)) {
      continue;
    }
    const double band = std::copysign(band_c, change_c);
    const std::optional<double> lead =
        lead_s(plant, before_c, to_c, command.wait == Wait::none ? to_c - band : before_c + band);
    if (!lead) {
      continue;
    }
    if (auto place = place_before(course, command.time_s - *lead, command.free_from_s)) {
      place->command = i;
      place->from_c = before_c;
      place->to_c = to_c;
      found.push_back(*place);
    }
  }
  return found;
}

// Chooses from some changes those that do not lengthen the time in which filament is laid outside
// the band.
class Harmless {
 public:
  using OutOfBand = std::function<double(const std::vector<Ahead>&)>;

  explicit Harmless(OutOfBand out_of_band_s)
      : out_of_band_s_(std::move(out_of_band_s)), least_s_(out_of_band_s_({})) {}

  std::vector<Ahead> of(std::span<const Ahead> changes) {
    add(changes);
    return std::move(chosen_);
  }

 private:
  // Adds all changes if together they do no harm. Otherwise it does the same for either half. So
  // few harmful changes among many cost few simulations.
  void add(std::span<const Ahead> changes) {
    constexpr double kRounding_s = 1e-6;
    std::vector<Ahead> with = chosen_;
    with.insert(with.end(), changes.begin(), changes.end());
    if (const double now_s = out_of_band_s_(with); now_s <= least_s_ + kRounding_s) {
      least_s_ = now_s;
      chosen_ = std::move(with);
    } else if (changes.size() > 1) {
      add(changes.first(changes.size() / 2));
      add(changes.subspan(changes.size() / 2));
    }
  }

  OutOfBand out_of_band_s_;
  double least_s_;
  std::vector<Ahead> chosen_;
};

}  // namespace

PrintResponse print_response(const Loop& loop, const Course& course,
                             const std::vector<Command>& commands,
                             const std::vector<Target>& wanted, double band_c) {
  PrintResponse result;
  const std::optional<Start> known = start(course, commands);
  if (!known) {
    return result;
  }
  result.known_from_s = static_cast<double>(known->step) * kStep_s;
  result.temperature_c.assign(std::min(known->step, course.steps.size()),
                              std::numeric_limits<float>::quiet_NaN());
  HotLoop hot(loop, known->target_c);
  Wanted wanted_c(wanted);
  double target_c = known->target_c;
  auto next = std::ranges::find_if(
      commands, [&](const Command& one) { return step_at(one.time_s) > known->step; });
  std::size_t line = 0;
  for (std::size_t k = known->step; k < course.steps.size(); ++k) {
    for (; next != commands.end() && step_at(next->time_s) <= k; ++next) {
      target_c = next->target_c.value_or(target_c);
      double waited_s = 0.0;
      while (next->wait != Wait::none && target_c > 0.0 && waited_s < kLongestWait_s &&
             !is_reached(*next, target_c, hot.temperature_c())) {
        hot.tick(target_c, 0.0);
        waited_s += kStep_s;
      }
      result.waiting_s += waited_s;
    }
    const Course::Step& step = course.steps[k];
    hot.tick(target_c, step.volume_mm3);
    line = step.first_line != 0 ? step.first_line : line;
    result.temperature_c.push_back(static_cast<float>(hot.temperature_c()));
    if (const double wanted_now_c = wanted_c.at(k); wanted_now_c > 0.0) {
      judge(step, hot.temperature_c() - wanted_now_c, band_c, line, result);
    }
  }
  return result;
}

std::vector<Target> targets(const std::vector<Command>& commands) {
  std::vector<Target> result;
  for (const Command& command : commands) {
    if (command.target_c) {
      result.push_back({command.time_s, *command.target_c});
    }
  }
  return result;
}

std::optional<double> lead_s(const Plant& plant, double from_c, double to_c, double passes_c) {
  const bool heats = to_c > from_c;
  if (!(heats ? passes_c > from_c && passes_c <= to_c : passes_c < from_c && passes_c >= to_c)) {
    return std::nullopt;
  }
  const double goal_c = plant.ambient_c + (heats ? plant.gain_c * plant.full_power : 0.0);
  const double ratio = (goal_c - from_c) / (goal_c - passes_c);
  if (!(ratio > 1.0)) {
    return std::nullopt;  // beyond where the hotend would go
  }
  const OneLag lag = plant.one_lag();
  return lag.dead_time_s + lag.time_constant_s * math::log(ratio);
}

std::vector<Ahead> choose_ahead(const Loop& loop, const Course& course,
                                const std::vector<Command>& commands, double band_c,
                                AheadWhen when) {
  const std::vector<Ahead> all = candidates(loop.plant, course, commands, band_c, when);
  if (all.empty()) {
    return all;
  }
  return Harmless([&, wanted = targets(commands)](const std::vector<Ahead>& ahead) {
           return print_response(loop, course, with_ahead(commands, ahead), wanted, band_c)
               .out_of_band_s();
         })
      .of(all);
}

std::vector<Command> with_ahead(const std::vector<Command>& commands,
                                const std::vector<Ahead>& ahead) {
  std::vector<Command> result = commands;
  for (const Ahead& one : ahead) {
    if (commands[one.command].wait != Wait::none) {
      result.push_back({.target_c = one.to_c});
    }
    Command& early = commands[one.command].wait != Wait::none ? result.back() : result[one.command];
    early.line = one.before_line;
    early.time_s = one.time_s;
  }
  std::ranges::stable_sort(result, {}, &Command::time_s);
  return result;
}

}  // namespace unflex::hotend
