#include "run_batches.hpp"

#include <algorithm>
#include <istream>
#include <iterator>

#include "unflex/flow/input_bytes.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::study {
namespace {

// Runs are taken together until they last this long.
constexpr double kBatch_s = 20.0;

}  // namespace

Result<std::vector<Diagnostic>> for_each_batch(
    const flow::Job& job, Progress& progress,
    const std::function<void(std::vector<study::Run>&&)>& use) {
  const std::unique_ptr<std::istream> input = job.input->read();
  if (!*input) {
    return fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file");
  }
  const double bytes = flow::input_bytes(job);
  run::PieceReader reader(*input, job.input_name, machine::interpreter_options(job.settings),
                          machine::planner_limits(job.settings),
                          machine::firmware_config(job.settings));
  std::vector<study::Run> batch;
  double batch_s = 0.0;
  bool has_run = false;
  for (bool more = true; more;) {
    run::Piece piece;
    const Result<bool> read = reader.next(piece);
    if (!read) {
      return tl::unexpected(read.error());
    }
    more = *read;
    if (piece.is_run) {
      has_run = true;
      batch_s += planner::duration_s(piece.moves);
      if (piece.begins_run()) {
        batch.emplace_back();
      }
      std::ranges::move(piece.moves, std::back_inserter(batch.back().plan));
    }
    // A long run comes in parts, but is tried as a whole.
    const bool inside = piece.is_run && !piece.ends_run();
    if (!batch.empty() && !inside && (!more || batch_s >= kBatch_s)) {
      use(std::move(batch));
      batch.clear();
      batch_s = 0.0;
    }
    progress.update("studying",
                    flow::share_of_input(static_cast<double>(reader.bytes_read()), bytes));
    if (progress.cancelled()) {
      return fail(ErrorKind::internal, "cancelled");
    }
  }
  if (!has_run) {
    return fail(ErrorKind::input, {job.input_name, 0},
                "has no stretch that could be compensated; unflex inspect tells why");
  }
  return reader.warnings();
}

}  // namespace unflex::study
