#include "unflex/platform/process.hpp"

#include <fcntl.h>
#include <io.h>
#include <windows.h>

// Needs windows.h.
#include <shellapi.h>

#include <cstdlib>
#include <string_view>

#include "unflex/platform/descriptors.hpp"
#include "utf16.hpp"

#ifndef ENABLE_VIRTUAL_TERMINAL_PROCESSING
#define ENABLE_VIRTUAL_TERMINAL_PROCESSING 4
#endif

namespace unflex::platform {
namespace {

HANDLE handle_of(int descriptor) { return reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)); }

}  // namespace

void prepare_process() {
  // A console shows bytes as UTF-8.
  SetConsoleOutputCP(CP_UTF8);
  // A call with a descriptor that is closed would end the program.
  _set_invalid_parameter_handler(
      [](const wchar_t*, const wchar_t*, const wchar_t*, unsigned, std::uintptr_t) {});
  for (const int fd : {kStandardInput, kStandardOutput, kStandardError}) {
    if (_setmode(fd, _O_BINARY) < 0) {
      static_cast<void>(_open("NUL", fd == kStandardInput ? _O_WRONLY : _O_RDONLY));
    }
  }
}

// main() gets the arguments in the system's old code page.
std::vector<std::string> arguments_of(int /*count*/, char** /*arguments*/) {
  std::vector<std::string> words;
  int count = 0;
  wchar_t** const all = CommandLineToArgvW(GetCommandLineW(), &count);
  for (int i = 1; i < count; ++i) {
    words.push_back(utf8(all[i]));
  }
  LocalFree(all);
  return words;
}

std::vector<std::pair<std::string, std::string>> environment() {
  std::vector<std::pair<std::string, std::string>> variables;
  wchar_t* const all = GetEnvironmentStringsW();
  for (const wchar_t* at = all; at != nullptr && *at != L'\0';
       at += std::wstring_view(at).size() + 1) {
    const std::string text = utf8(at);
    // Names of the system's own begin with an equals sign.
    if (const std::size_t equals = text.find('=', 1); equals != std::string::npos) {
      variables.emplace_back(text.substr(0, equals), text.substr(equals + 1));
    }
  }
  FreeEnvironmentStringsW(all);
  return variables;
}

long process_number() { return static_cast<long>(GetCurrentProcessId()); }

bool is_terminal(int descriptor) {
  DWORD mode = 0;
  return descriptor >= 0 && GetConsoleMode(handle_of(descriptor), &mode) != 0;
}

bool takes_escape_sequences(int descriptor) {
  DWORD mode = 0;
  return descriptor >= 0 && GetConsoleMode(handle_of(descriptor), &mode) != 0 &&
         SetConsoleMode(handle_of(descriptor), mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

unsigned columns_of(int descriptor) {
  CONSOLE_SCREEN_BUFFER_INFO screen{};
  return GetConsoleScreenBufferInfo(handle_of(descriptor), &screen) != 0
             ? static_cast<unsigned>(screen.srWindow.Right - screen.srWindow.Left + 1)
             : 0;
}

}  // namespace unflex::platform
