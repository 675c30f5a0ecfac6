// Writes metadata of binary G-code as comments of a text, and finds them there again.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "unflex/container/metadata.hpp"
#include "unflex/core/error.hpp"

namespace unflex::container {

// nullopt if a line is not key=value.
[[nodiscard]] std::optional<KeyValues> key_values(std::string_view lines);
[[nodiscard]] std::string lines_of(const KeyValues& values);

// The text before the G-code and the text after it, in the layout of PrusaSlicer's own conversion.
[[nodiscard]] std::string head_text(const Metadata& metadata);
[[nodiscard]] std::string tail_text(const Metadata& metadata);

// Goes through the lines of a text and tells which are metadata and which G-code.
class MetadataLines {
 public:
  // origin: as in make_bgcode_packer().
  explicit MetadataLines(const Metadata* origin);
  // For a second pass through the text: `surveyed` knows which comment is the last of its key.
  MetadataLines(const Metadata* origin, const MetadataLines& surveyed);

  // Whether the line (without its end) belongs into a G-code block: not blank, and not metadata.
  // Errors have only a message.
  [[nodiscard]] Result<bool> is_gcode(std::string_view line);

  // The metadata that were found. Call it once, after the last line.
  [[nodiscard]] Result<Metadata> take();

 private:
  enum class Section { none, thumbnail, config, json_config };
  using Values = std::map<std::string, std::string, std::less<>>;

  [[nodiscard]] Result<bool> is_metadata(std::string_view comment);
  [[nodiscard]] bool begins_section(std::string_view comment);
  [[nodiscard]] bool begins_thumbnail(std::string_view comment);
  [[nodiscard]] Result<bool> continue_section(std::string_view comment);
  [[nodiscard]] Status end_thumbnail();
  [[nodiscard]] bool take_value(std::string_view comment);
  [[nodiscard]] bool take_producer(std::string_view comment);
  [[nodiscard]] Metadata sorted() const;

  const Metadata* origin_;
  std::set<std::string, std::less<>> head_keys_;  // keys that are metadata before the first command
  std::set<std::string, std::less<>> tail_keys_;  // keys that are metadata after it
  bool in_head_ = true;
  Section section_ = Section::none;
  bool had_config_ = false;
  bool had_json_config_ = false;
  std::size_t expected_digits_ = 0;  // base64 digits of the thumbnail being read
  Values head_;
  Values tail_;
  using Counts = std::map<std::string, std::size_t, std::less<>>;
  Counts tail_counts_;               // how often a key came after the first command
  std::optional<Counts> tail_ends_;  // how often it will have come at the end
  Metadata found_;
};

}  // namespace unflex::container
