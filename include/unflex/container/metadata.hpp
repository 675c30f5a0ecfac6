// The metadata of a binary G-code file, which stand beside its G-code.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace unflex::container {

struct Thumbnail {
  std::uint16_t format = 0;  // 0 PNG, 1 JPG, 2 QOI
  std::uint16_t width = 0;
  std::uint16_t height = 0;
  std::string data;
};

using KeyValues = std::vector<std::pair<std::string, std::string>>;

struct Metadata {
  std::string file;   // lines key=value: producer and the like; empty: no such block
  KeyValues printer;  // what a printer shows and checks before it prints
  std::vector<Thumbnail> thumbnails;
  KeyValues print;          // times, filament
  std::string slicer;       // lines key=value: all settings
  std::string slicer_json;  // all settings as JSON; empty: no such block
};

}  // namespace unflex::container
