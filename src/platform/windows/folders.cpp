#include "unflex/platform/folders.hpp"

#include <io.h>
#include <windows.h>

#include <algorithm>
#include <system_error>

#include "open_shared.hpp"
#include "unflex/platform/files.hpp"
#include "utf16.hpp"

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;

std::uint64_t joined_halves(DWORD high, DWORD low) { return (std::uint64_t{high} << 32U) | low; }

// The state of the object behind a handle. An object that is no file on a disk is a device or a
// pipe.
tl::expected<FileState, int> state_of_handle(HANDLE handle) {
  if (GetFileType(handle) != FILE_TYPE_DISK) {
    return FileState{};
  }
  BY_HANDLE_FILE_INFORMATION is{};
  if (GetFileInformationByHandle(handle, &is) == 0) {
    return tl::unexpected(last_error());
  }
  // In 100 ns.
  constexpr std::uint64_t kTicksPerSecond = 10'000'000;
  const std::uint64_t written =
      joined_halves(is.ftLastWriteTime.dwHighDateTime, is.ftLastWriteTime.dwLowDateTime);
  const bool is_folder = (is.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
  return FileState{is_folder ? FileKind::folder : FileKind::file,
                   is.dwVolumeSerialNumber,
                   joined_halves(is.nFileIndexHigh, is.nFileIndexLow),
                   joined_halves(is.nFileSizeHigh, is.nFileSizeLow),
                   static_cast<std::int64_t>(written / kTicksPerSecond),
                   static_cast<std::int64_t>(100 * (written % kTicksPerSecond))};
}

}  // namespace

tl::expected<FileState, int> state_of(const std::string& name) {
  // Without any right but to look; a folder too.
  const FileDescriptor file = open_shared(name, 0, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS);
  if (!file.valid()) {
    return tl::unexpected(errno);
  }
  return state_of(file.get());
}

tl::expected<FileState, int> state_of(int descriptor) {
  tl::expected<FileState, int> state =
      state_of_handle(reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)));
  // Whoever started the program may have opened a standard stream without the right to look at it.
  return state || descriptor > kStandardError ? state : FileState{};
}

bool is_link(const std::string& name) {
  std::error_code unknown;
  return fs::is_symlink(path_of(name), unknown);
}

bool is_taken(const std::string& name) {
  std::error_code unknown;
  return fs::exists(fs::symlink_status(path_of(name), unknown));
}

bool same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) {
    return false;
  }
  const tl::expected<FileState, int> state_a = state_of(a);
  const tl::expected<FileState, int> state_b = state_of(b);
  if (state_a && state_b) {
    return state_a->kind != FileKind::other && state_a->device == state_b->device &&
           state_a->number == state_b->number;
  }
  // At least one does not exist yet: compare where they would be.
  return canonical_name(a) == canonical_name(b);
}

tl::expected<std::vector<FolderEntry>, int> entries_of(const std::string& folder) {
  std::error_code failed;
  std::vector<FolderEntry> entries;
  for (fs::directory_iterator at(path_of(folder), failed), end; !failed && at != end;
       at.increment(failed)) {
    std::error_code unknown;
    FolderEntry entry{.name = name_of(at->path().filename()),
                      .is_link = at->is_symlink(unknown),
                      .kind = {},
                      .bytes = 0};
    if (const tl::expected<FileState, int> state = state_of(name_of(at->path()))) {
      entry.kind = state->kind;
      entry.bytes = state->bytes;
    }
    entries.push_back(std::move(entry));
  }
  if (failed) {
    return tl::unexpected(failed.default_error_condition().value());
  }
  std::ranges::sort(entries, {}, &FolderEntry::name);
  return entries;
}

int make_folders(const std::string& folder) {
  std::error_code failed;
  fs::create_directories(path_of(folder), failed);
  return failed ? failed.default_error_condition().value() : 0;
}

void remove_empty_folder(const std::string& folder) { RemoveDirectoryW(path_of(folder).c_str()); }

}  // namespace unflex::platform
