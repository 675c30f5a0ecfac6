// The process: its standard streams, its terminal, its environment.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace unflex::platform {

// To be called first. A standard stream that was closed would be given to the next file opened, and
// messages would land in that file. So the stream is replaced by one whose use is an error. Bytes
// go through the streams as they are. The memory that a long run needs goes back to the system when
// the run is written.
void prepare_process();

// Arguments behind the program's name, in UTF-8 where the system knows what text is.
[[nodiscard]] std::vector<std::string> arguments_of(int count, char** arguments);

[[nodiscard]] std::vector<std::pair<std::string, std::string>> environment();

// Tells a process from those it forked.
[[nodiscard]] long process_number();

[[nodiscard]] bool is_terminal(int descriptor);
// Whether the descriptor is a terminal that takes escape sequences for its cursor and colours.
[[nodiscard]] bool takes_escape_sequences(int descriptor);
// The width of a terminal; 0 if it is not known.
[[nodiscard]] unsigned columns_of(int descriptor);

}  // namespace unflex::platform
