#include "unflex/platform/folders.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "unflex/platform/files.hpp"

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;

}  // namespace

bool same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) {
    return false;
  }
  const tl::expected<FileState, int> state_a = state_of(a);
  const tl::expected<FileState, int> state_b = state_of(b);
  if (state_a && state_b && state_a->device == state_b->device &&
      state_a->number == state_b->number) {
    return true;
  }
  // At least one does not exist yet: compare where they would be.
  return canonical_name(a) == canonical_name(b);
}

tl::expected<std::vector<FolderEntry>, int> entries_of(const std::string& folder) {
  std::error_code failed;
  std::vector<FolderEntry> entries;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    std::error_code unknown;
    FolderEntry entry{.name = at->path().filename().string(),
                      .is_link = at->is_symlink(unknown),
                      .kind = {},
                      .bytes = 0};
    if (const tl::expected<FileState, int> state = state_of(at->path().string())) {
      entry.kind = state->kind;
      entry.bytes = state->bytes;
    }
    entries.push_back(std::move(entry));
  }
  if (failed) {
    return tl::unexpected(failed.value());
  }
  std::ranges::sort(entries, {}, &FolderEntry::name);
  return entries;
}

int make_folders(const std::string& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  return failed.value();
}

}  // namespace unflex::platform
