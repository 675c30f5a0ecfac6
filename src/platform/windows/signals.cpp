#include <windows.h>

#include <csignal>

#include "../signal_calls.hpp"
#include "utf16.hpp"

namespace unflex::platform {
namespace {

// The time in which the work under way can end by itself.
constexpr DWORD kPatience_ms = 400;

HANDLE called_off = nullptr;

// Runs in a thread of its own. Once it returns from the closing of its window, the process is
// ended.
BOOL WINAPI remember(DWORD event) {
  const bool is_closing = event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT;
  if (remember_signal(is_closing ? SIGTERM : SIGINT) || is_closing) {
    if (WaitForSingleObject(called_off, is_closing ? INFINITE : kPatience_ms) == WAIT_TIMEOUT) {
      give_up();
    }
  }
  return TRUE;
}

}  // namespace

void start_catching() {
  called_off = CreateEventW(nullptr, TRUE, FALSE, nullptr);
  SetConsoleCtrlHandler(remember, TRUE);
}

void call_off_giving_up() {
  if (called_off != nullptr) {
    SetEvent(called_off);
  }
}

bool remove_at_once(const char* name) { return DeleteFileW(path_of(name).c_str()) != 0; }

void end_at_once(int exit_code) {
  TerminateProcess(GetCurrentProcess(), static_cast<UINT>(exit_code));
  for (;;) {
  }
}

}  // namespace unflex::platform
