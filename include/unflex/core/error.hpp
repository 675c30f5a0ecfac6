// Errors as values. The library never prints and never exits: it returns one of these and the
// program turns it into a line on stderr and an exit code.
#pragma once

#include <cstddef>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace unflex {

// Kinds of errors, as far as the caller's next step depends on them.
enum class ErrorKind {
  usage,     // command line or configuration: exit code 1
  input,     // the G-code or another input file: exit code 2
  internal,  // the machine's or our fault (disk, memory, solver, worker): exit code 4
};

// A place in a text the user can open. line is 1-based; 0 means the file as a whole.
struct SourcePlace {
  std::string file;
  std::size_t line = 0;

  friend bool operator==(const SourcePlace&, const SourcePlace&) = default;
};

struct Error {
  ErrorKind kind = ErrorKind::internal;
  SourcePlace place;
  std::string message;  // what is wrong and what to do about it, one line, no full stop at the end
};

// "file:line: message"; parts that are unknown are left out.
[[nodiscard]] std::string to_string(const Error& error);

// A remark that does not stop the work; shown as "file:line: warning: message".
struct Diagnostic {
  SourcePlace place;
  std::string message;
};

[[nodiscard]] std::string to_string(const Diagnostic& diagnostic);

template <class T>
using Result = tl::expected<T, Error>;

using Status = tl::expected<void, Error>;

[[nodiscard]] inline tl::unexpected<Error> fail(ErrorKind kind, SourcePlace place,
                                                std::string message) {
  return tl::unexpected<Error>(Error{kind, std::move(place), std::move(message)});
}

[[nodiscard]] inline tl::unexpected<Error> fail(ErrorKind kind, std::string message) {
  return fail(kind, SourcePlace{}, std::move(message));
}

}  // namespace unflex
