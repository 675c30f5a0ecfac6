// Loaded before the C library (LD_PRELOAD). Lists calls that matter to files, processes and clocks,
// makes them fail or kills the program, as the environment says.
//
//   FAULT_LIST=FILE        a line there for each fsync and rename
//   FAULT_KILL=CALL        die of SIGKILL before the first such call: fsync, rename, fsync-folder
//   FAULT_FAIL=CALL        the call fails with EIO instead; also fork and socketpair,
//                          and inflate for want of memory
//   FAULT_SIGNAL=CALL      SIGINT comes before each such call (the calls of FAULT_KILL)
//   FAULT_CHANGE=FILE      somebody else adds a line to FILE before each rename
//   FAULT_UNREADABLE=NAME  reads of files whose name ends so fail with EIO behind 64 KiB
//   FAULT_CLOCK=1          each look at the calendar's clock finds it an hour earlier

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>

namespace {

constexpr long kReadable_bytes = 1L << 16;
constexpr time_t kHour_s = 3600;

template <class Function>
Function* original(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

bool asks(const char* variable, std::string_view call) {
  const char* const value = std::getenv(variable);
  return value != nullptr && call == value;
}

// Whether the call is to fail.
bool meet(std::string_view call) {
  if (const char* const list = std::getenv("FAULT_LIST")) {
    if (std::FILE* const file = std::fopen(list, "a")) {
      std::fprintf(file, "%s\n", call.data());
      std::fclose(file);
    }
  }
  if (asks("FAULT_KILL", call)) {
    ::raise(SIGKILL);
  }
  if (asks("FAULT_SIGNAL", call)) {
    ::raise(SIGINT);
  }
  return asks("FAULT_FAIL", call);
}

void change_file() {
  const char* const changed = std::getenv("FAULT_CHANGE");
  if (std::FILE* const file = changed != nullptr ? std::fopen(changed, "a") : nullptr) {
    std::fputs("M400\n", file);
    std::fclose(file);
  }
}

int failure() {
  errno = EIO;
  return -1;
}

// Seconds by which the clock has been set back.
time_t lateness_s() {
  static time_t late_s = 0;
  return std::getenv("FAULT_CLOCK") != nullptr ? late_s += kHour_s : 0;
}

bool is_unreadable(int fd) {
  const char* const end = std::getenv("FAULT_UNREADABLE");
  if (end == nullptr || ::lseek(fd, 0, SEEK_CUR) < kReadable_bytes) {
    return false;
  }
  char link[64];
  char name[4096];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t length = ::readlink(link, name, sizeof name);
  return length > 0 && std::string_view(name, static_cast<std::size_t>(length)).ends_with(end);
}

}  // namespace

extern "C" {

int fsync(int fd) {
  struct stat status {};
  const bool is_folder = ::fstat(fd, &status) == 0 && S_ISDIR(status.st_mode);
  return meet(is_folder ? "fsync-folder" : "fsync") ? failure() : original<int(int)>("fsync")(fd);
}

int rename(const char* from, const char* to) noexcept {
  change_file();
  return meet("rename") ? failure() : original<int(const char*, const char*)>("rename")(from, to);
}

pid_t fork() noexcept {
  return asks("FAULT_FAIL", "fork") ? failure() : original<pid_t()>("fork")();
}

int socketpair(int domain, int type, int protocol, int* pair) noexcept {
  return asks("FAULT_FAIL", "socketpair")
             ? failure()
             : original<int(int, int, int, int*)>("socketpair")(domain, type, protocol, pair);
}

// Replaces zlib's function.
int inflate(void* stream, int flush) {
  constexpr int kOutOfMemory = -4;
  return asks("FAULT_FAIL", "inflate") ? kOutOfMemory
                                       : original<int(void*, int)>("inflate")(stream, flush);
}

ssize_t read(int fd, void* block, size_t bytes) {
  return is_unreadable(fd) ? failure()
                           : original<ssize_t(int, void*, size_t)>("read")(fd, block, bytes);
}

// Calls the kernel, because sanitizers read the clock before there is memory to look up a name.
int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const auto result = static_cast<int>(::syscall(SYS_clock_gettime, clock, now));
  if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) {
    now->tv_sec -= lateness_s();
  }
  return result;
}

time_t time(time_t* now) noexcept {
  const time_t result = original<time_t(time_t*)>("time")(nullptr) - lateness_s();
  if (now != nullptr) {
    *now = result;
  }
  return result;
}

}  // extern "C"
