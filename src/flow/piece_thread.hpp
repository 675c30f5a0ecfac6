// Reads pieces ahead, or where the library has no threads, when they are asked for.
#pragma once

#include <deque>
#include <exception>
#include <functional>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cpu_slots.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::flow {

class PieceThread {
 public:
  // The stream is read in the thread; wake: called there whenever something has come. stop_input:
  // ends a read of a stream, which might wait for ever.
  PieceThread(
      std::istream& input, std::string name, const verify::Rules& rules, CpuSlots& slots,
      std::function<void()> wake, std::function<void()> stop_input = [] {});
  // Stops reading; waits for a read that is under way.
  ~PieceThread();
  PieceThread(const PieceThread&) = delete;
  PieceThread& operator=(const PieceThread&) = delete;

  // The next piece, if it has been read.
  [[nodiscard]] std::unique_ptr<run::Piece> take();
  // Gives back pieces that have been dealt with, so that their storage is used again. Then waits
  // for pieces and takes all that have been read; none at the end.
  void exchange(std::deque<std::unique_ptr<run::Piece>>& pieces);
  // Whether take() would give one or at_end() has come.
  [[nodiscard]] bool has_news();
  // Whether the last piece has been taken: the input has ended, or could not be read on.
  [[nodiscard]] bool at_end();
  // To be called at the end. Throws an exception that the thread could not turn into an Error. For
  // std::bad_alloc it had no memory to do so.
  [[nodiscard]] const std::optional<Error>& error() const;
  [[nodiscard]] const std::vector<Diagnostic>& warnings() const { return reader_.warnings(); }

 private:
  void read(const std::function<void()>& wake);
  // Reads a piece into `piece`. Returns whether there was one, and sets `error` if it could not be
  // read.
  bool read_piece(run::Piece& piece, std::optional<Error>& error);
  // Where the library has no threads, reads on until `lines` lines wait, or the input ends.
  void read_here(std::size_t lines);
  // Ends the thread with the exception that is being handled; error() throws it again.
  void give_up();

  CpuSlots* slots_;
  std::function<void()> stop_input_;
  run::PieceReader reader_;
  Mutex mutex_;
  Condition room_;
  Condition news_;
  std::deque<std::unique_ptr<run::Piece>> pieces_;
  std::deque<std::unique_ptr<run::Piece>> returned_;
  std::size_t lines_ahead_ = 0;  // in pieces_
  std::optional<Error> error_;
  std::exception_ptr failure_;
  bool ended_ = false;
  bool stopped_ = false;
  Thread thread_;
};

}  // namespace unflex::flow
