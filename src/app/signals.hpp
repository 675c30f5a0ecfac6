// The signals that ask the program to end.
#pragma once

#include <string>

namespace unflex::app {

// From here on SIGINT, SIGTERM and SIGHUP are remembered instead of killing the process, and
// writing to a closed pipe or beyond a size limit is an error instead of a signal. A signal that is
// ignored already (nohup) stays ignored. Should the process not have ended by itself 0.4 s after
// one, it is ended, as a run may take longer to solve; last_words then go to stderr, a line, or
// those for when a result is in place.
void catch_signals(const std::string& last_words, const std::string& last_words_with_result);

// From here on whoever calls it says them, and the process ends by itself.
void say_last_words_yourself();

// Before a result gets its name: with it there, the last words would be wrong.
void expect_a_result();

// Once a result is in place, be it all of a stream.
void note_result();
[[nodiscard]] bool has_result();

// The first of them that came, or 0. What a signal handler tells the rest of the process, and what
// it has to know, cannot live anywhere but in static variables; these are the only ones.
[[nodiscard]] int ending_signal();

// A file that this process must not leave behind if it is ended so, until it is to be kept. There
// is room for a few; more are left.
void remove_if_cut_short(const std::string& file);
void keep_if_cut_short(const std::string& file);

}  // namespace unflex::app
