#include "unflex/platform/replacing.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "unflex/platform/names.hpp"

namespace unflex::platform {
namespace {

int outcome(int result) { return result == 0 ? 0 : errno; }

// Makes a file that reads and writes, with a name that nobody has.
tl::expected<LockedFile, int> make_file(const std::string& folder, std::string_view beginning,
                                        std::string_view ending) {
  for (;;) {
    constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789";
    unsigned char random[6] = {};
    static_cast<void>(::getentropy(random, sizeof random));
    std::string name = joined(folder, beginning);
    for (const unsigned char number : random) {
      name += kLetters[number % kLetters.size()];
    }
    name += ending;
    FileDescriptor file(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL, 0666));
    if (file.valid()) {
      return LockedFile{std::move(name), std::move(file)};
    }
    if (errno != EEXIST) {
      return tl::unexpected(errno);
    }
  }
}

}  // namespace

const std::string_view kTemporaryDirectoryVariable = "TMPDIR";

std::string temporary_directory() {
  const char* const chosen = std::getenv("TMPDIR");
  return chosen != nullptr && *chosen != '\0' ? chosen : "/tmp";
}

tl::expected<FileDescriptor, int> open_unnamed_file(const std::string& folder) {
  return make_file(folder, ".unflex-", ".tmp").map([](LockedFile made) {
    remove_file(made.name);
    return std::move(made.file);
  });
}

// There are no locks.
tl::expected<LockedFile, int> make_locked_file(const std::string& folder,
                                               std::string_view beginning,
                                               std::string_view ending) {
  return make_file(folder, beginning, ending);
}

// Nobody knows whether it is in use.
Removal remove_unless_locked(const std::string& /*name*/) { return Removal::not_ours; }

bool remove_file(const std::string& name) { return ::unlink(name.c_str()) == 0; }

tl::expected<FileDescriptor, int> claim_folder(const std::string& folder, Claim /*claim*/) {
  FileDescriptor claimed(::open(folder.c_str(), O_RDONLY | O_DIRECTORY));
  if (!claimed.valid()) {
    return tl::unexpected(errno);
  }
  return claimed;
}

// The host tells when it is written.
int check_writable(const std::string& /*name*/) { return 0; }

int take_over_permissions(int /*descriptor*/, const std::string& /*replaced*/) { return 0; }

int sync_file(int descriptor) { return outcome(::fsync(descriptor)); }

int replace_file(const std::string& from, const std::string& to) {
  return outcome(std::rename(from.c_str(), to.c_str()));
}

void sync_folder(const std::string& /*folder*/) {}

std::string name_of_descriptor(int /*descriptor*/) { return ""; }

bool leads_to_descriptor(const std::string& /*name*/) { return false; }

}  // namespace unflex::platform
