// Files that take another's place when they are whole, and files of which nothing is left. Errors
// are numbers as in errno.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "unflex/platform/descriptors.hpp"

namespace unflex::platform {

// The folder for files that are soon removed, and the environment variable that chooses the folder.
[[nodiscard]] std::string temporary_directory();
extern const std::string_view kTemporaryDirectoryVariable;

// A file that is kept only while it is open. The descriptor reads and writes.
[[nodiscard]] tl::expected<FileDescriptor, int> open_unnamed_file(const std::string& folder);

struct LockedFile {
  std::string name;
  FileDescriptor file;  // reads and writes
};

// Makes a file with a temporary name that nobody has. Others cannot lock it while it is open, if
// the file system has locks.
[[nodiscard]] tl::expected<LockedFile, int> make_locked_file(const std::string& folder);
// Whether a name without folder has the form of such a temporary name: ".unflex-", six letters,
// ".tmp".
[[nodiscard]] bool is_temporary_name(std::string_view name);

enum class Removal { done, in_use, not_ours };
// Removes a file that this user made and nobody has locked.
[[nodiscard]] Removal remove_unless_locked(const std::string& name);
bool remove_file(const std::string& name);

enum class Claim { alone, with_others };
// A claim on a folder, which ends with the descriptor. The error is EWOULDBLOCK if another process
// has a claim that excludes this one. Where folders cannot be claimed, as on some network file
// systems, the claim counts as given.
[[nodiscard]] tl::expected<FileDescriptor, int> claim_folder(const std::string& folder,
                                                             Claim claim);

// 0 if the file may be written.
[[nodiscard]] int check_writable(const std::string& name);
// Gives an open file the owner (if that is allowed) and the permissions of the file that it is to
// replace, or those of a new file. 0 if that was done.
[[nodiscard]] int take_over_permissions(int descriptor, const std::string& replaced);
// Puts what was written on the disk. 0 if that was done.
[[nodiscard]] int sync_file(int descriptor);
// Gives a file the name of another one in the same folder, at once. 0 if that was done.
[[nodiscard]] int replace_file(const std::string& from, const std::string& to);
// Puts the folder's names on the disk. Failures are ignored.
void sync_folder(const std::string& folder);

// A name of the file that a descriptor was redirected to, "" if it is none.
[[nodiscard]] std::string name_of_descriptor(int descriptor);
// Whether a name leads to a file by a descriptor that is open, as /dev/stdout does.
[[nodiscard]] bool leads_to_descriptor(const std::string& name);

}  // namespace unflex::platform
