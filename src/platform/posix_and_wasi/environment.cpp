#include <string_view>

#include "unflex/platform/process.hpp"

extern char** environ;

namespace unflex::platform {

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

}  // namespace unflex::platform
