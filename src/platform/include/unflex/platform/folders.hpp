// The objects behind names (a file, a folder, a link), and the contents of folders.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace unflex::platform {

enum class FileKind { file, folder, other };

// The state of a file. It changes when the file is written to or replaced.
struct FileState {
  FileKind kind = FileKind::other;
  std::uint64_t device = 0;
  std::uint64_t number = 0;
  std::uint64_t bytes = 0;
  std::int64_t written_s = 0;
  std::int64_t written_ns = 0;

  [[nodiscard]] bool operator==(const FileState&) const = default;
};

// The state of the object that a name leads to, also by links, or of an open file. The error is an
// errno.
[[nodiscard]] tl::expected<FileState, int> state_of(const std::string& name);
[[nodiscard]] tl::expected<FileState, int> state_of(int descriptor);

[[nodiscard]] bool is_link(const std::string& name);
// Whether the name is taken, if only by a link that leads nowhere.
[[nodiscard]] bool is_taken(const std::string& name);

// Whether both names lead to one file, existing or not. An empty name leads to none.
[[nodiscard]] bool same_file(const std::string& a, const std::string& b);

struct FolderEntry {
  std::string name;  // without its folder
  bool is_link = false;
  std::optional<FileKind> kind;  // of what it leads to; unset if that is nothing
  std::uint64_t bytes = 0;       // of a file
};

// The entries, sorted by name, or the errno.
[[nodiscard]] tl::expected<std::vector<FolderEntry>, int> entries_of(const std::string& folder);

// Makes the folder, and all missing folders above it. 0 or the errno.
[[nodiscard]] int make_folders(const std::string& folder);
// Removes the folder if it is empty.
void remove_empty_folder(const std::string& folder);

}  // namespace unflex::platform
