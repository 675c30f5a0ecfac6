#include "read_print.hpp"

#include <deque>
#include <istream>
#include <memory>

#include "cpu_slots.hpp"
#include "piece_thread.hpp"
#include "unflex/flow/input_bytes.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::flow {
namespace {

// What the file has of the piece.
std::size_t bytes_of(const run::Piece& piece) {
  std::size_t bytes = 0;
  for (const gcode::Event& event : piece.events) {
    bytes += event.added ? 0 : event.line.text.size();
  }
  return bytes;
}

}  // namespace

Result<std::vector<std::string>> read_print(const Job& job, Progress& progress,
                                            const std::function<void(const run::Piece&)>& take) {
  const std::unique_ptr<std::istream> input = job.input->read();
  if (!*input) {
    return fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file");
  }
  const double all_bytes = input_bytes(job);
  std::size_t bytes = 0;
  CpuSlots slots(2);
  PieceThread pieces(*input, job.input_name, run::verify_rules(job.settings), slots, [] {});
  std::deque<std::unique_ptr<run::Piece>> read;
  for (pieces.exchange(read); !read.empty(); pieces.exchange(read)) {
    for (const std::unique_ptr<run::Piece>& piece : read) {
      bytes += bytes_of(*piece);
      take(*piece);
    }
    progress.update("reading", share_of_input(static_cast<double>(bytes), all_bytes));
    if (progress.cancelled()) {
      return fail(ErrorKind::internal, "cancelled");
    }
  }
  if (pieces.error()) {
    return tl::unexpected(*pieces.error());
  }
  std::vector<std::string> warnings;
  for (const Diagnostic& warning : pieces.warnings()) {
    warnings.push_back(to_string(warning));
  }
  return warnings;
}

}  // namespace unflex::flow
