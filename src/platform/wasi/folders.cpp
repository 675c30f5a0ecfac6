#include "unflex/platform/folders.hpp"

#include <dirent.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>

#include "unflex/platform/files.hpp"
#include "unflex/platform/names.hpp"

namespace unflex::platform {
bool same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) {
    return false;
  }
  const tl::expected<FileState, int> state_a = state_of(a);
  const tl::expected<FileState, int> state_b = state_of(b);
  // The host may give all files the number 0.
  if (state_a && state_b && state_a->number != 0) {
    return state_a->device == state_b->device && state_a->number == state_b->number;
  }
  return canonical_name(a) == canonical_name(b);
}

tl::expected<std::vector<FolderEntry>, int> entries_of(const std::string& folder) {
  DIR* const all = ::opendir(folder.c_str());
  if (all == nullptr) {
    return tl::unexpected(errno);
  }
  std::vector<FolderEntry> entries;
  while (const dirent* const found = ::readdir(all)) {
    FolderEntry entry{.name = found->d_name, .is_link = false, .kind = {}, .bytes = 0};
    if (entry.name == "." || entry.name == "..") {
      continue;
    }
    const std::string name = joined(folder, entry.name);
    entry.is_link = is_link(name);
    if (const tl::expected<FileState, int> state = state_of(name)) {
      entry.kind = state->kind;
      entry.bytes = state->bytes;
    }
    entries.push_back(std::move(entry));
  }
  ::closedir(all);
  std::ranges::sort(entries, {}, &FolderEntry::name);
  return entries;
}

int make_folders(const std::string& folder) {
  if (folder.empty()) {
    return 0;
  }
  if (const auto state = state_of(folder)) {
    return state->kind == FileKind::folder ? 0 : ENOTDIR;
  }
  const std::string above = folder_of(folder);
  if (const int error = above == folder ? 0 : make_folders(above); error != 0) {
    return error;
  }
  return ::mkdir(folder.c_str(), 0777) == 0 || errno == EEXIST ? 0 : errno;
}

}  // namespace unflex::platform
