// The signals that ask the program to end.
#pragma once

#include <string>

namespace unflex::platform {

// From here on SIGINT, SIGTERM and SIGHUP are remembered instead of killing the process, and
// writing to a closed pipe or beyond a size limit is an error instead of a signal. A signal that is
// ignored already (nohup) stays ignored. If the process has not ended by itself 0.4 s after a
// signal, it is ended, since solving a run may take longer. It then writes last_words to stderr,
// one line, or last_words_with_result if a result is in place.
void catch_signals(const std::string& last_words, const std::string& last_words_with_result);

// From here on the caller says the last words, and the process ends by itself.
void say_last_words_yourself();

// To be called before a result gets its name: once it has, last_words would be wrong.
void expect_a_result();

// To be called once a result is in place, also when a stream has got all of it.
void note_result();
[[nodiscard]] bool has_result();

// The first of the signals that came, or 0. A signal handler can share data with the rest of the
// process only by static variables; these are the only ones.
[[nodiscard]] int ending_signal();

// remove_if_cut_short() names a file that this process must not leave behind if a signal ends it,
// until keep_if_cut_short() is called. There is room for a few files; more are left behind.
void remove_if_cut_short(const std::string& file);
void keep_if_cut_short(const std::string& file);

}  // namespace unflex::platform
