#include "unflex/platform/process.hpp"

#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace unflex::platform {

void prepare_process() {}

long process_number() { return 1; }

bool is_terminal(int descriptor) { return descriptor >= 0 && ::isatty(descriptor) == 1; }

bool takes_escape_sequences(int descriptor) {
  const char* const terminal = std::getenv("TERM");
  const bool is_dumb = terminal == nullptr || std::string_view(terminal) == "dumb";
  return !is_dumb && is_terminal(descriptor);
}

unsigned columns_of(int /*descriptor*/) { return 0; }

}  // namespace unflex::platform
