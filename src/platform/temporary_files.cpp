#include "temporary_files.hpp"

#include <cerrno>
#include <random>
#include <string_view>
#include <utility>

#include "unflex/platform/names.hpp"

namespace unflex::platform {
namespace {

// The ending keeps temporary files apart from names that people choose, such as .unflex-backup.
constexpr std::string_view kBeginning = ".unflex-";
constexpr std::string_view kEnding = ".tmp";
constexpr std::size_t kRandomLetters = 6;

std::string random_name() {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789";
  std::random_device random;
  std::string name(kBeginning);
  for (std::size_t i = 0; i < kRandomLetters; ++i) {
    name += kLetters[random() % kLetters.size()];
  }
  return name.append(kEnding);
}

}  // namespace

tl::expected<LockedFile, int> make_temporary_file(const std::string& folder,
                                                  FileDescriptor (*make)(const std::string& name)) {
  for (;;) {
    std::string name = joined(folder, random_name());
    FileDescriptor file = make(name);
    if (file.valid()) {
      return LockedFile{std::move(name), std::move(file)};
    }
    if (errno != EEXIST) {
      return tl::unexpected(errno);
    }
  }
}

bool is_temporary_name(std::string_view name) {
  return name.size() == kBeginning.size() + kRandomLetters + kEnding.size() &&
         name.starts_with(kBeginning) && name.ends_with(kEnding);
}

}  // namespace unflex::platform
