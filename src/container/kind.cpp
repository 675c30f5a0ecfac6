#include <algorithm>
#include <string>

#include "bgcode_format.hpp"
#include "bgcode_reader.hpp"
#include "gzip.hpp"
#include "unflex/container/container.hpp"

namespace unflex::container {

Kind detect(std::string_view head) {
  if (head.starts_with(kGzipMagic)) {
    return Kind::gzip;
  }
  return head.starts_with(kBgcodeMagic) ? Kind::bgcode : Kind::text;
}

Kind kind_of_name(std::string_view name) {
  std::string lower(name);
  std::ranges::transform(lower, lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (lower.ends_with(".gz")) {
    return Kind::gzip;
  }
  return lower.ends_with(".bgcode") || lower.ends_with(".bgc") ? Kind::bgcode : Kind::text;
}

std::unique_ptr<Unpacker> make_unpacker(Kind kind, std::string name) {
  switch (kind) {
    case Kind::gzip:
      return make_gzip_unpacker(std::move(name));
    case Kind::bgcode:
      return std::make_unique<BgcodeUnpacker>(std::move(name));
    case Kind::text:
      break;
  }
  return nullptr;
}

}  // namespace unflex::container
