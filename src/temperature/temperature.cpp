#include "unflex/temperature/temperature.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "lines_ahead.hpp"
#include "print_course.hpp"
#include "unflex/hotend/along_print.hpp"
#include "unflex/hotend/rules.hpp"

namespace unflex::temperature {
namespace {

using hotend::Course;

constexpr std::size_t kMostMoments = 1500;

std::optional<hotend::Loop> loop_of(const machine::HotendSettings& settings) {
  const std::optional<hotend::Plant> plant = hotend_plant(settings);
  if (!plant) {
    return std::nullopt;
  }
  const Result<hotend::Gains> gains = hotend::gains(hotend::kDefaultRule, *plant);
  if (!gains) {
    return std::nullopt;
  }
  return hotend::Loop{.plant = *plant, .control = {.gains = *gains}, .heater_w = settings.heater_w};
}

// The targets of the sliced file, at the times at which the output comes to the same places. A
// place is known by the filament that is laid before it.
std::vector<hotend::Target> wanted_in_output(const std::vector<hotend::Command>& sliced,
                                             const Course& output) {
  constexpr double kRounding_mm3 = 1e-3;
  std::vector<hotend::Target> result;
  double laid_mm3 = 0.0;
  std::size_t step = 0;
  for (const hotend::Command& command : sliced) {
    while (step < output.steps.size() &&
           laid_mm3 + output.steps[step].volume_mm3 <= command.laid_mm3 + kRounding_mm3) {
      laid_mm3 += output.steps[step++].volume_mm3;
    }
    if (command.target_c) {
      result.push_back({static_cast<double>(step) * Course::kStep_s, *command.target_c});
    }
  }
  return result;
}

report::TemperatureRow row(const hotend::PrintResponse& response) {
  return {response.colder_s, response.hotter_s, response.worst_c, response.worst_line,
          response.waiting_s};
}

// Takes the step of each stretch that is furthest from its target, and one that lays filament if
// there is any.
std::vector<report::Temperature::Moment> thinned(const hotend::PrintResponse& response,
                                                 const Course& course,
                                                 const std::vector<hotend::Target>& wanted) {
  const std::size_t count = response.temperature_c.size();
  const std::size_t stretch = std::max<std::size_t>(1, (count + kMostMoments - 1) / kMostMoments);
  std::vector<report::Temperature::Moment> result;
  double target_c = 0.0;
  auto next = wanted.begin();
  for (std::size_t first = 0; first < count; first += stretch) {
    std::optional<report::Temperature::Moment> chosen;
    double most_c = -1.0;
    for (std::size_t k = first; k < std::min(first + stretch, count); ++k) {
      const double time_s = static_cast<double>(k) * Course::kStep_s;
      for (; next != wanted.end() && next->time_s <= time_s; ++next) {
        target_c = next->target_c;
      }
      const double temperature_c = response.temperature_c[k];
      if (!std::isfinite(temperature_c)) {
        continue;
      }
      constexpr double kWithoutFilament = 1e-3;
      const double off_c = std::abs(temperature_c - target_c) *
                           (course.steps[k].extruding_s > 0.0F ? 1.0 : kWithoutFilament);
      if (off_c > most_c) {
        most_c = off_c;
        chosen = report::Temperature::Moment{time_s, target_c, temperature_c};
      }
    }
    if (chosen) {
      result.push_back(*chosen);
    }
  }
  return result;
}

std::vector<LineAhead> lines_of(const std::vector<hotend::Command>& commands,
                                const std::vector<hotend::Ahead>& ahead) {
  std::vector<LineAhead> lines;
  for (const hotend::Ahead& one : ahead) {
    const hotend::Command& command = commands[one.command];
    const bool stays = command.wait != hotend::Wait::none;
    lines.push_back({one.before_line, stays ? 0 : command.line, command.text});
  }
  return lines;
}

void renumber(const std::vector<LineAhead>& lines, report::Report& report) {
  const auto now = [&](std::size_t& number) { number = number_behind(lines, number); };
  now(report.measured.compensated.flow.max_line);
  now(report.measured.compensated.flow.max_change_line);
  for (report::StepRates::Row& motor : report.step_rates.motors) {
    now(motor.emitted_line);
  }
  now(report.step_rates.total.emitted_line);
  now(report.temperature->emitted.worst_line);
  report.measured.output.lines +=
      static_cast<std::size_t>(std::ranges::count(lines, std::size_t{0}, &LineAhead::from_line));
}

}  // namespace

std::optional<hotend::Plant> hotend_plant(const machine::HotendSettings& settings) {
  if (!settings.has_model()) {
    return std::nullopt;
  }
  return hotend::Plant{.gain_c = *settings.gain_c,
                       .time_constant_s = *settings.time_constant_s,
                       .sensor_lag_s = settings.sensor_lag_s,
                       .dead_time_s = *settings.dead_time_s,
                       .ambient_c = settings.ambient_c};
}

Status follow_temperature(const flow::Job& job, OutputMay may, Progress& progress,
                          report::Report& report) {
  const machine::HotendSettings& settings = job.settings.hotend;
  const std::optional<hotend::Loop> loop = loop_of(settings);
  if (!loop) {
    return {};
  }
  const Result<PrintCourse> sliced =
      print_course(*job.input, job.input_name, job.settings, progress);
  if (!sliced) {
    return tl::unexpected(sliced.error());
  }
  Result<PrintCourse> output = print_course(*job.output, job.output_name, job.settings, progress);
  if (!output) {
    return tl::unexpected(output.error());
  }
  report::Temperature& result = report.temperature.emplace();
  result.band_c = settings.band_c;
  const hotend::PrintResponse before = hotend::print_response(
      *loop, sliced->course, sliced->commands, hotend::targets(sliced->commands), settings.band_c);
  result.is_known = before.known_from_s.has_value();
  result.sliced = row(before);
  std::vector<LineAhead> lines;
  if (may == OutputMay::change && settings.ahead && result.is_known) {
    const std::vector<hotend::Ahead> ahead = hotend::choose_ahead(
        *loop, output->course, output->commands, settings.band_c,
        settings.ahead_when == "both" ? hotend::AheadWhen::both : hotend::AheadWhen::heating);
    lines = lines_of(output->commands, ahead);
    if (Status status = put_ahead(*job.output, job.output_name, lines); !status) {
      return status;
    }
    for (const hotend::Ahead& one : ahead) {
      const hotend::Command& command = output->commands[one.command];
      // Both files have the same commands.
      const std::size_t number = std::min(one.command, sliced->commands.size() - 1);
      result.ahead.push_back(
          {sliced->commands[number].line, command.time_s - one.time_s, one.from_c, one.to_c});
    }
    output->commands = hotend::with_ahead(output->commands, ahead);
  }
  const std::vector<hotend::Target> wanted = wanted_in_output(sliced->commands, output->course);
  const hotend::PrintResponse after =
      hotend::print_response(*loop, output->course, output->commands, wanted, settings.band_c);
  result.emitted = row(after);
  renumber(lines, report);
  result.course = thinned(after, output->course, wanted);
  return {};
}

}  // namespace unflex::temperature
