// The stages wired together: what the program's commands do, without the command line.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "unflex/container/container.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/core/byte_stream.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/core/text_store.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/report/report.hpp"

namespace unflex::flow {

// The solver of the windows.
enum class EngineChoice {
  automatic,  // banded, checked by Ipopt on a few windows
  banded,     // structure-exploiting interior point, in threads
  ipopt,      // in processes
};

struct Job {
  std::shared_ptr<TextStore> input;
  std::string input_name;             // as the user calls it, for messages ("-" for stdin)
  std::shared_ptr<TextStore> output;  // compensate: written here, not atomically
  // compensate: streams that are read and written as the text comes, instead of these two.
  std::shared_ptr<ByteSource> input_stream = {};
  std::string input_head = {};  // first bytes of input_stream, read already
  std::shared_ptr<ByteSink> output_stream = {};
  // The packing of the two streams: text or gzip. `input` and `output` hold text.
  container::Kind input_stream_kind = container::Kind::text;
  container::Kind output_stream_kind = container::Kind::text;
  std::string output_name;
  machine::Settings settings;
  EngineChoice engine = EngineChoice::automatic;
  // Has a fixed sample of windows solved by Ipopt as well, and warns if it finds something else.
  bool check_solver = false;
  // Measure the print with all input shapers, as reports show them, not only with ZV.
  bool all_shapers = false;
  unsigned workers = 1;  // threads or solver processes that compute at once
};

// An error of kind usage if the library was built without this engine.
[[nodiscard]] Status check_built(EngineChoice engine);

// Reads the input, compensates it, writes the output and verifies what was written.
// Forks its workers first: call it before any thread exists.
[[nodiscard]] Result<report::Report> compensate(const Job& job, Progress& progress);

// Verifies `job.output` against `job.input`.
[[nodiscard]] Result<report::Report> verify(const Job& job, Progress& progress);

// A limit that the print's own commands set.
struct LimitInPrint {
  double first_value = 0.0;
  std::size_t first_line = 0;
  std::size_t times = 0;  // how often it is set
};

// How many of each there are in a print.
struct PrintCounts {
  std::size_t lines = 0;
  std::size_t bytes = 0;
  std::size_t moves = 0;  // segments that move X, Y or Z
  std::size_t extruding_moves = 0;
  std::size_t extrude_only_moves = 0;
  std::size_t arcs = 0;  // G2 and G3 lines
  std::size_t passive_lines = 0;
  std::size_t limit_lines = 0;
  std::size_t barrier_lines = 0;
};

// The facts that an inspection finds in a file.
struct Inspection {
  std::string dialect;  // "PrusaSlicer 2.5.0 …" from the file's first or last comments
  PrintCounts counts;
  std::map<std::string, std::size_t> commands;  // "G1", "M204", "PRINT_START" → lines
  std::size_t runs = 0;                         // stretches that can be compensated
  std::size_t windows = 0;
  double run_time_s = 0.0;                        // duration of all runs
  std::map<std::string, std::size_t> kept_moves;  // reason → moves outside runs
  report::ExtrudedPath extruded_path;  // its `compensated_mm` is what could be compensated
  std::vector<report::UnknownCommand> unknown_commands;  // in the order of their first lines
  double reference_time_s = 0.0;
  double moving_time_s = 0.0;
  double filament_mm = 0.0;
  double path_length_mm = 0.0;
  Axes<double> min_mm, max_mm;
  double z_max_mm = 0.0;
  bool absolute_e = false;                                     // M82 in force for most extrusions
  double lowest_accel_mm_s2 = 0.0, highest_accel_mm_s2 = 0.0;  // in force during moves
  report::StepRates step_rates;                                // without emitted lines
  std::map<std::string, LimitInPrint> limits;                  // by key: "limits.max_accel_mm_s2"
  std::vector<std::string> warnings;
};

[[nodiscard]] Result<Inspection> inspect(const Job& job, Progress& progress);

}  // namespace unflex::flow
