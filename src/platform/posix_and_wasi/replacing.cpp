#include "unflex/platform/replacing.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "../temporary_files.hpp"
#include "file_calls.hpp"

namespace unflex::platform {

const std::string_view kTemporaryDirectoryVariable = "TMPDIR";

std::string temporary_directory() {
  const char* const chosen = std::getenv("TMPDIR");
  return chosen != nullptr && *chosen != '\0' ? chosen : "/tmp";
}

FileDescriptor make_new_file(const std::string& name) {
  return FileDescriptor(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
}

tl::expected<FileDescriptor, int> open_unnamed_file(const std::string& folder) {
  return make_temporary_file(folder, &make_new_file).map([](LockedFile made) {
    remove_file(made.name);
    return std::move(made.file);
  });
}

bool remove_file(const std::string& name) { return ::unlink(name.c_str()) == 0; }

int sync_file(int descriptor) { return outcome(::fsync(descriptor)); }

int replace_file(const std::string& from, const std::string& to) {
  return outcome(std::rename(from.c_str(), to.c_str()));
}

}  // namespace unflex::platform
