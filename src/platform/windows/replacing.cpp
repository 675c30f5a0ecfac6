#include "unflex/platform/replacing.hpp"

#include <io.h>
#include <windows.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "../temporary_files.hpp"
#include "open_shared.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"
#include "utf16.hpp"

namespace unflex::platform {
namespace {

// A slicer, a scanner for viruses or an indexer may hold a file for a moment.
constexpr int kTries = 50;
constexpr std::chrono::milliseconds kBetweenTries{100};

HANDLE handle_of(int descriptor) { return reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)); }

FileDescriptor make_new_file(const std::string& name) {
  return open_shared(name, GENERIC_READ | GENERIC_WRITE, CREATE_NEW);
}

FileDescriptor make_passing_file(const std::string& name) {
  return open_shared(name, GENERIC_READ | GENERIC_WRITE, CREATE_NEW,
                     FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE);
}

// Locks a byte far behind what any file holds, since a locked byte cannot be read.
bool lock(int descriptor, Claim claim = Claim::alone) {
  OVERLAPPED place{};
  place.OffsetHigh = 0x7fffffff;
  const DWORD kind = claim == Claim::alone ? LOCKFILE_EXCLUSIVE_LOCK : 0;
  return LockFileEx(handle_of(descriptor), kind | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &place) != 0;
}

// Replaces a file that others have open, where they let it be removed. Windows 10 can do that.
bool replace_open_file(const std::string& from, const std::string& to) {
  constexpr DWORD kReplace = 1;  // FILE_RENAME_FLAG_REPLACE_IF_EXISTS
  constexpr DWORD kPosix = 2;    // FILE_RENAME_FLAG_POSIX_SEMANTICS
  constexpr auto kRenameInfoEx = static_cast<FILE_INFO_BY_HANDLE_CLASS>(22);
  const FileDescriptor file = open_shared(from, DELETE, OPEN_EXISTING);
  const std::wstring name = path_of(to).native();
  std::vector<char> room(sizeof(FILE_RENAME_INFO) + sizeof(wchar_t) * name.size());
  auto* const rename = reinterpret_cast<FILE_RENAME_INFO*>(room.data());
  // Older headers call the flags ReplaceIfExists.
  constexpr DWORD kFlags = kReplace | kPosix;
  std::memcpy(rename, &kFlags, sizeof kFlags);
  rename->FileNameLength = static_cast<DWORD>(sizeof(wchar_t) * name.size());
  std::memcpy(rename->FileName, name.data(), rename->FileNameLength);
  return file.valid() && SetFileInformationByHandle(handle_of(file.get()), kRenameInfoEx, rename,
                                                    static_cast<DWORD>(room.size())) != 0;
}

}  // namespace

const std::string_view kTemporaryDirectoryVariable = "TMP";

std::string temporary_directory() {
  std::error_code failed;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(failed);
  return failed ? "." : name_of(folder);
}

tl::expected<FileDescriptor, int> open_unnamed_file(const std::string& folder) {
  return make_temporary_file(folder, &make_passing_file).map([](LockedFile made) {
    return std::move(made.file);
  });
}

tl::expected<LockedFile, int> make_locked_file(const std::string& folder) {
  return make_temporary_file(folder, &make_new_file).map([](LockedFile made) {
    lock(made.file.get());
    return made;
  });
}

Removal remove_unless_locked(const std::string& name) {
  const FileDescriptor file = open_shared(name, GENERIC_READ, OPEN_EXISTING);
  const bool is_free = file.valid() && lock(file.get());
  return is_free && remove_file(name) ? Removal::done : Removal::in_use;
}

bool remove_file(const std::string& name) { return DeleteFileW(path_of(name).c_str()) != 0; }

// A folder cannot be locked, so a file in it stands for it as long as a claim lasts.
tl::expected<FileDescriptor, int> claim_folder(const std::string& folder, Claim claim) {
  FileDescriptor claimed = open_shared(joined(folder, ".unflex-batch.lock"), GENERIC_READ,
                                       OPEN_ALWAYS, FILE_FLAG_DELETE_ON_CLOSE);
  if (!claimed.valid()) {
    return tl::unexpected(errno);
  }
  if (!lock(claimed.get(), claim)) {
    return tl::unexpected(EWOULDBLOCK);
  }
  return claimed;
}

int check_writable(const std::string& name) {
  return open_shared(name, GENERIC_WRITE, OPEN_EXISTING).valid() ? 0 : errno;
}

// A new file takes its folder's permissions.
int take_over_permissions(int /*descriptor*/, const std::string& /*replaced*/) { return 0; }

int sync_file(int descriptor) { return _commit(descriptor) == 0 ? 0 : errno; }

int replace_file(const std::string& from, const std::string& to) {
  for (int i = 1;; ++i) {
    if (MoveFileExW(path_of(from).c_str(), path_of(to).c_str(),
                    MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0) {
      return 0;
    }
    const int error = last_error();
    if (replace_open_file(from, to)) {
      return 0;
    }
    if (i == kTries || (error != EBUSY && error != EACCES)) {
      return error;
    }
    std::this_thread::sleep_for(kBetweenTries);
  }
}

// Names are written through as they are given.
void sync_folder(const std::string& /*folder*/) {}

std::string name_of_descriptor(int descriptor) {
  const tl::expected<FileState, int> state = state_of(descriptor);
  if (!state || state->kind != FileKind::file) {
    return "";
  }
  std::wstring name(1U << 15U, L'\0');
  const DWORD length = GetFinalPathNameByHandleW(handle_of(descriptor), name.data(),
                                                 static_cast<DWORD>(name.size()), 0);
  name.resize(length < name.size() ? length : 0);
  return name_of(name);
}

// No name leads to a descriptor here.
bool leads_to_descriptor(const std::string& /*name*/) { return false; }

}  // namespace unflex::platform
