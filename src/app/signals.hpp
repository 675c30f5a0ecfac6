// The signals that ask the program to end.
#pragma once

namespace unflex::app {

// From here on SIGINT, SIGTERM and SIGHUP are remembered instead of killing the process, and
// writing to a closed pipe or beyond a size limit is an error instead of a signal. A signal that is
// ignored already (nohup) stays ignored.
void catch_signals();

// The first of them that came, or 0. What a signal handler tells the rest of the process cannot
// live anywhere but in a static variable; this is the only one.
[[nodiscard]] int ending_signal();

}  // namespace unflex::app
