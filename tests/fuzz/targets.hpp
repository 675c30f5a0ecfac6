// The targets of fuzzing: each function takes any bytes and throws Broken if something that must
// hold of every input does not.
//
// Bytes that choose a variant come first. Only their value counts, so that a file of the corpus can
// be written by hand: '0' is the first variant, '1' the second, and so on.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace unflex::fuzz {

class Broken final : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

inline void require(bool holds, const std::string& otherwise) {
  if (!holds) {
    throw Broken(otherwise);
  }
}

// Lines of G-code, their meaning to a firmware, and its plan of them. First byte: see GcodeVariant.
void gcode(std::string_view bytes);
// A whole print. First byte: see CompensateVariant.
void compensate(std::string_view bytes);
// Descriptions of a printer. First byte: as a file, at the head of a print, in a stream, as --set.
void settings(std::string_view bytes);
// Containers of G-code. First byte: unpacked from gzip, from binary G-code, packed in either.
void container(std::string_view bytes);
// Records of accelerometers. First byte: the name of the file.
void records(std::string_view bytes);

}  // namespace unflex::fuzz
