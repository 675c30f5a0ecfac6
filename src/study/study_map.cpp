#include "unflex/study/study_map.hpp"

#include <algorithm>
#include <limits>

#include "run_batches.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/run/setup.hpp"

namespace unflex::study {
namespace {

// The places of all maps along a direction: the first, the last and the one between them. Empty if
// no map is along it.
std::vector<double> places_along(char direction, const machine::Settings& settings) {
  double first_mm = std::numeric_limits<double>::infinity();
  double last_mm = -first_mm;
  for_each_axis(
      [&](const machine::AxisDynamics& axis) {
        for (const machine::FrequencyMap& map : axis.map) {
          if (map.along == direction) {
            first_mm = std::min(first_mm, map.at_mm.front());
            last_mm = std::max(last_mm, map.at_mm.back());
          }
        }
      },
      settings.dynamics);
  return first_mm < last_mm ? std::vector{first_mm, 0.5 * (first_mm + last_mm), last_mm}
                            : std::vector<double>{};
}

// The machine at each place, with constant frequencies.
std::vector<MapPlace> places_of(const machine::Settings& settings) {
  const std::vector<double> along_x = places_along('x', settings);
  const std::vector<double> along_y = places_along('y', settings);
  std::vector<MapPlace> places;
  for (const double y_mm : along_y.empty() ? std::vector{0.0} : along_y) {
    for (const double x_mm : along_x.empty() ? std::vector{0.0} : along_x) {
      machine::Settings here = settings;
      for_each_axis(
          [&](machine::AxisDynamics& axis) {
            axis.freq_hz *= axis.share_at({x_mm, y_mm});
            axis.map.clear();
          },
          here.dynamics);
      places.push_back({{x_mm, y_mm}, run::compensate_setup(here)});
    }
  }
  return along_x.empty() && along_y.empty() ? std::vector<MapPlace>{} : places;
}

}  // namespace

Result<MapOutcome> study_map(const flow::Job& job, Progress& progress) {
  if (Status built = flow::check_built(job.engine); !built) {
    return tl::unexpected(built.error());
  }
  std::vector<MapPlace> places = places_of(job.settings);
  if (places.empty()) {
    return fail(ErrorKind::usage,
                "study --map needs a map of frequencies over the bed: [[dynamics.x.map]] or "
                "[[dynamics.y.map]] with along = \"x\" or \"y\" in the printer file");
  }
  MapBench bench(std::move(places),
                 {.ipopt = job.engine == flow::EngineChoice::ipopt, .workers = job.workers});
  const Result<std::vector<Diagnostic>> warnings =
      for_each_batch(job, progress, [&](std::vector<Run>&& batch) { bench.add(batch); });
  if (!warnings) {
    return tl::unexpected(warnings.error());
  }
  MapOutcome outcome = bench.outcome();
  outcome.input = job.input_name;
  for (const Diagnostic& warning : *warnings) {
    outcome.warnings.push_back(to_string(warning));
  }
  return outcome;
}

}  // namespace unflex::study
