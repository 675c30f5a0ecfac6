#include "unflex/platform/process.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

#include "unflex/platform/descriptors.hpp"

namespace unflex::platform {

// /dev/null is opened the wrong way round, so that using it is still an error.
void prepare_standard_streams() {
  for (const int fd : {kStandardInput, kStandardOutput, kStandardError}) {
    if (::fcntl(fd, F_GETFD) < 0) {
      static_cast<void>(::open("/dev/null", fd == kStandardInput ? O_WRONLY : O_RDONLY));
    }
  }
}

long process_number() { return ::getpid(); }

bool is_terminal(int descriptor) { return descriptor >= 0 && ::isatty(descriptor) == 1; }

bool takes_escape_sequences(int descriptor) {
  const char* const terminal = std::getenv("TERM");
  const bool is_dumb = terminal != nullptr && std::string_view(terminal) == "dumb";
  return !is_dumb && is_terminal(descriptor);
}

unsigned columns_of(int descriptor) {
  winsize size{};
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

}  // namespace unflex::platform
