// How a signal reaches the process.
#pragma once

namespace unflex::platform {

// Functions that each system implements.
//
// Calls remember_signal() for each signal that asks the process to end, and give_up() some time
// after the first. Writing to a closed pipe and the like is an error from here on.
void start_catching();
void call_off_giving_up();
// Both call nothing but what a signal handler may call.
bool remove_at_once(const char* name);
[[noreturn]] void end_at_once(int exit_code);

// Notes a signal. Returns whether it is the first.
bool remember_signal(int signal);
[[noreturn]] void give_up();

}  // namespace unflex::platform
