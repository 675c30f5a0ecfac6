#include "terminal.hpp"

#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace unflex::app {

bool can_redraw(int fd) {
  const char* const terminal = std::getenv("TERM");
  const bool dumb = terminal != nullptr && std::string_view(terminal) == "dumb";
  return !dumb && fd >= 0 && ::isatty(fd) == 1;
}

bool can_colour(int fd) {
  const char* const refused = std::getenv("NO_COLOR");
  return (refused == nullptr || *refused == '\0') && can_redraw(fd);
}

}  // namespace unflex::app
