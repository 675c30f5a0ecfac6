#include "text_line.hpp"

#include <algorithm>
#include <charconv>
#include <sstream>
#include <utility>

namespace unflex::testing {
namespace {

constexpr std::string_view kDigits = "0123456789";
constexpr std::string_view kCapitals = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";

bool is_digit(char c) { return kDigits.find(c) != std::string_view::npos; }
bool is_capital(char c) { return kCapitals.find(c) != std::string_view::npos; }

std::size_t end_of(const std::string& text, std::string_view run, std::size_t begin) {
  return std::min(text.find_first_not_of(run, begin), text.size());
}

std::string stripped(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r"), text.size()));
  return std::string(text.substr(0, text.find_last_not_of(" \t\r") + 1));
}

}  // namespace

double kept(Firmware firmware, double value) {
  return firmware == Firmware::klipper ? value : static_cast<double>(static_cast<float>(value));
}

std::string capitals(std::string text) {
  std::ranges::transform(text, text.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  return text;
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

TextLine::TextLine(Firmware firmware, std::string_view text) : firmware_(firmware) {
  const std::string line = stripped(text.substr(0, text.find(';')));
  if (firmware == Firmware::klipper) {
    parse_klipper(line);
  } else {
    parse_others(line);
  }
}

// gcode.py, _process_commands: the line is split before and after each run of letters. The first
// two pieces make the command, spaces and zeros included, so that neither "G 1" nor "G01" is G1.
void TextLine::parse_klipper(const std::string& line) {
  const std::string run = std::string(kCapitals) + "_";
  const std::string upper = capitals(line);
  std::size_t key = std::min(upper.find_first_of(run + "*"), upper.size());
  std::string before = upper.substr(0, key);
  while (key < upper.size()) {
    const std::size_t value = upper[key] == '*' ? key + 1 : end_of(upper, run, key);
    const std::size_t next = std::min(upper.find_first_of(run + "*", value), upper.size());
    const std::string name = upper.substr(key, value - key);
    if (command_.empty() && (key != 0 || name != "N")) {
      command_ = stripped(std::exchange(before, "") + upper.substr(key, next - key));
    }
    words_[name] = stripped(upper.substr(value, next - value));
    key = next;
  }
  if (command_.size() < 2 || is_digit(command_[1])) {
    return;
  }
  words_.clear();  // _get_extended_params
  const std::size_t at = upper.find(command_);
  const std::size_t end = at == 0 ? line.size() : std::min(line.rfind('*'), line.size());
  const std::size_t begin = at + command_.size();
  std::istringstream pairs(line.substr(begin, end - begin));
  for (std::string pair; pairs >> pair && pair[0] != '#';) {
    const std::size_t equals = std::min(pair.find('='), pair.size() - 1);
    words_[capitals(pair.substr(0, equals))] = pair.substr(equals + 1);
  }
}

// Marlin: parser.cpp, parse(), without GCODE_CASE_INSENSITIVE, the default. Small letters are
// therefore no words. If a word is there twice, the last one counts.
// RepRapFirmware: StringParser.cpp, Put(), DecodeCommand(), FindParameters() and Seen(). An
// asterisk ends only a line with a line number, an E right after a digit is an exponent, nothing in
// quotes is a word, and the first of two equal words counts.
void TextLine::parse_others(std::string line) {
  const bool marlin = firmware_ == Firmware::marlin;
  if (!marlin) {
    line = capitals(line);
  }
  const bool numbered = line.size() > 1 && line[0] == 'N' && is_digit(line[1]);
  if (numbered) {
    line = stripped(line.substr(end_of(line, kDigits, 1)));
  }
  if (marlin || numbered) {
    line = stripped(line.substr(0, line.find('*')));
  }
  command_ = line.substr(0, line.find(' '));
  const std::size_t digits = marlin ? end_of(line, " ", 1) : std::size_t{1};
  if (line.size() <= digits || !is_digit(line[digits]) || !is_capital(line[0])) {
    return;
  }
  std::size_t begin = end_of(line, kDigits, digits);
  const std::size_t leading = line.find_first_not_of('0', digits);
  command_ = line[0] + (leading < begin ? line.substr(leading, begin - leading) : "0");
  if (begin < line.size() && line[begin] == '.') {
    command_ += line.substr(begin, 2);
    begin += 2;
  }
  bool quoted = false;
  for (std::size_t i = begin; i < line.size(); ++i) {
    quoted = quoted != (line[i] == '"');
    if ((quoted && !marlin) || !is_capital(line[i])) {
      continue;
    }
    const std::string word(1, line[i]);
    if (marlin) {
      words_[word] = line.substr(i + 1);
    } else if ((word == "G" || word == "M") && command_ != "M117") {
      has_second_command_ = true;
      return;
    } else if (word != "E" || i == begin || !is_digit(line[i - 1])) {
      words_.try_emplace(word, line.substr(i + 1));
    }
  }
}

bool TextLine::has_any_of(std::string_view letters) const {
  return std::ranges::any_of(letters, [&](char letter) { return has(std::string(1, letter)); });
}

std::string TextLine::text(std::string_view word) const {
  const auto found = words_.find(word);
  const std::string text = found == words_.end() ? "" : found->second;
  return text.starts_with('"') ? text.substr(1, text.find('"', 1) - 1) : text;
}

// Klipper requires that the whole word is a number (gcode.py, get), RepRapFirmware only its
// beginning (StringParser.cpp, ReadFloatValue()). Marlin ignores words that are no numbers
// (parser.h, seenval()).
std::optional<double> TextLine::number(std::string_view word) const {
  if (!has(word)) {
    return std::nullopt;
  }
  const std::string number = stripped(text(word));
  const char* const first = number.data() + (number.starts_with('+') ? 1 : 0);
  const char* const last = number.data() + number.size();
  const bool exponents = firmware_ == Firmware::rrf;
  double value = 0.0;
  const auto [end, error] = std::from_chars(
      first, last, value, exponents ? std::chars_format::general : std::chars_format::fixed);
  if (error == std::errc() && (end == last || firmware_ != Firmware::klipper)) {
    return kept(firmware_, value);
  }
  if (firmware_ == Firmware::marlin) {
    return std::nullopt;
  }
  throw Refused{};
}

}  // namespace unflex::testing
