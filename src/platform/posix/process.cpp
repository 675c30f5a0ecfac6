#include "unflex/platform/process.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

#include "unflex/platform/descriptors.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace unflex::platform {

void prepare_process() {
#ifdef __GLIBC__
  // Left alone, glibc keeps ever larger blocks, and a print takes up to a third more memory.
  ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
#endif
  for (const int fd : {kStandardInput, kStandardOutput, kStandardError}) {
    if (::fcntl(fd, F_GETFD) < 0) {
      // The wrong way round, so that using it is still an error.
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
