// Reading gzip: RFC 1952, with any number of members.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "unflex/container/container.hpp"

namespace unflex::container {

inline constexpr std::string_view kGzipMagic = "\x1f\x8b";

[[nodiscard]] std::unique_ptr<Unpacker> make_gzip_unpacker(std::string name);

}  // namespace unflex::container
