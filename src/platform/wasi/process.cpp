#include "unflex/platform/process.hpp"

#include <unistd.h>

#include <cstdlib>
#include <string_view>

extern char** environ;

namespace unflex::platform {

void prepare_standard_streams() {}

std::vector<std::string> arguments_of(int count, char** arguments) {
  return {arguments + 1, arguments + count};
}

std::vector<std::pair<std::string, std::string>> environment() {
  std::vector<std::pair<std::string, std::string>> variables;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    if (const std::size_t equals = text.find('='); equals != std::string_view::npos) {
      variables.emplace_back(text.substr(0, equals), text.substr(equals + 1));
    }
  }
  return variables;
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
