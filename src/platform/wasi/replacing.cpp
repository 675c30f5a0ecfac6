#include "unflex/platform/replacing.hpp"

#include <fcntl.h>

#include <cerrno>

#include "../posix_and_wasi/file_calls.hpp"
#include "../temporary_files.hpp"

namespace unflex::platform {

// There are no locks.
tl::expected<LockedFile, int> make_locked_file(const std::string& folder) {
  return make_temporary_file(folder, &make_new_file);
}

// Nobody knows whether it is in use.
Removal remove_unless_locked(const std::string& /*name*/) { return Removal::not_ours; }

tl::expected<FileDescriptor, int> claim_folder(const std::string& folder, Claim /*claim*/) {
  FileDescriptor claimed(::open(folder.c_str(), O_RDONLY | O_DIRECTORY));
  if (!claimed.valid()) {
    return tl::unexpected(errno);
  }
  return claimed;
}

// The host tells only when the file is written.
int check_writable(const std::string& /*name*/) { return 0; }

int take_over_permissions(int /*descriptor*/, const std::string& /*replaced*/) { return 0; }

void sync_folder(const std::string& /*folder*/) {}

std::string name_of_descriptor(int /*descriptor*/) { return ""; }

bool leads_to_descriptor(const std::string& /*name*/) { return false; }

}  // namespace unflex::platform
