#include "unflex/platform/process.hpp"

#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace unflex::platform {

// The host tells where one is; C's library takes names from there.
void prepare_process() {
  if (const char* const place = std::getenv("PWD")) {
    static_cast<void>(::chdir(place));
  }
}

long process_number() { return 1; }

bool is_terminal(int descriptor) { return descriptor >= 0 && ::isatty(descriptor) == 1; }

bool takes_escape_sequences(int descriptor) {
  const char* const terminal = std::getenv("TERM");
  const bool is_dumb = terminal == nullptr || std::string_view(terminal) == "dumb";
  return !is_dumb && is_terminal(descriptor);
}

unsigned columns_of(int /*descriptor*/) { return 0; }

}  // namespace unflex::platform
