// Files by their names. A name is text in UTF-8 where the system knows what text is, and else
// bytes.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/text_store.hpp"

namespace unflex::platform {

// The text of a file, which is opened when it is read or written.
[[nodiscard]] std::shared_ptr<TextStore> file_store(std::string name);

// Streams of bytes from a file's beginning, which are bad if it cannot be opened. errno tells why.
[[nodiscard]] std::unique_ptr<std::istream> read_file(const std::string& name);
[[nodiscard]] std::unique_ptr<std::ostream> write_file(const std::string& name);  // empties it
[[nodiscard]] std::unique_ptr<std::iostream> change_file(const std::string& name);
// Cuts the file off behind `bytes` bytes. False if that fails.
[[nodiscard]] bool shorten_file(const std::string& name, std::uint64_t bytes);

// The size of the file; nullopt if it is not known.
[[nodiscard]] std::optional<std::uint64_t> file_bytes(const std::string& name);
// Whether there is something by this name, and not merely a link that leads nowhere.
[[nodiscard]] bool exists(const std::string& name);
[[nodiscard]] bool is_directory(const std::string& name);

// The files that match a shell pattern with *, ? and [], sorted. A name without any of these
// characters is found even if it is a link that leads nowhere.
[[nodiscard]] std::vector<std::string> matching_files(const std::string& pattern);
// One name that is the same for all names of a file.
[[nodiscard]] std::string canonical_name(const std::string& name);
// `other`, which may be a pattern, as seen from the directory in which `name` lies.
[[nodiscard]] std::string name_beside(const std::string& name, std::string_view other);

}  // namespace unflex::platform
