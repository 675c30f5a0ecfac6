#include "unflex/app/run.hpp"
#include "unflex/platform/process.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

int main(int argc, char** argv) {
#ifdef __GLIBC__
  // What a long run needs goes back to the system when it is written. Left alone, glibc keeps ever
  // larger blocks, and a print takes up to a third more memory.
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
#endif
  return unflex::app::run_program(unflex::platform::arguments_of(argc, argv));
}
