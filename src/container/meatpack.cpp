#include "meatpack.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace unflex::container {
namespace {

// A command is two signal bytes and one of these.
constexpr unsigned char kSignal = 0xFF;
constexpr unsigned char kEnablePacking = 251;
constexpr unsigned char kDisablePacking = 250;
constexpr unsigned char kResetAll = 249;
constexpr unsigned char kEnableNoSpaces = 247;
constexpr unsigned char kDisableNoSpaces = 246;

// The characters of the sixteen codes. Without spaces, E takes the place of the space. The last
// code says that the character follows in a byte of its own.
constexpr std::string_view kCharacters = "0123456789. \nGX";
constexpr unsigned kSpaceCode = 11;
constexpr unsigned kLineEndCode = 12;
constexpr unsigned kWhole = 15;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_capital(char c) { return c >= 'A' && c <= 'Z'; }

std::array<std::uint8_t, 256> make_codes() {
  std::array<std::uint8_t, 256> codes;
  codes.fill(kWhole);
  for (std::size_t code = 0; code < kCharacters.size(); ++code) {
    codes[static_cast<unsigned char>(kCharacters[code])] = static_cast<std::uint8_t>(code);
  }
  codes[' '] = kWhole;
  codes['E'] = kSpaceCode;
  return codes;
}

// Whether the command is G and a number, then words of a capital and perhaps a number, each after
// exactly one space. Only this form comes back as it was when its spaces are dropped.
bool is_canonical(std::string_view command) {
  if (command.size() < 2 || command[0] != 'G' || !is_digit(command[1])) {
    return false;
  }
  for (std::size_t i = 1; i < command.size(); ++i) {
    const char c = command[i];
    const bool starts_word = command[i - 1] == ' ';
    if (c == ' ' ? starts_word || i + 1 == command.size()
                 : is_capital(c) != starts_word ||
                       !(is_capital(c) || is_digit(c) || c == '.' || c == '-' || c == '+')) {
      return false;
    }
  }
  return true;
}

std::string_view without_trailing_spaces(std::string_view text) {
  return text.substr(0, text.find_last_not_of(" \t") + 1);
}

class MeatPacker {
 public:
  explicit MeatPacker(bool comments) : comments_(comments) {
    command(kEnablePacking);
    command(kEnableNoSpaces);
  }

  // Packs a line, given without its end.
  void line(std::string_view text) {
    if (text.starts_with(';')) {
      if (comments_) {
        set_packing(false);
        (packed_ += text) += '\n';
      }
      return;
    }
    const std::string_view words = without_trailing_spaces(text.substr(0, text.find(';')));
    const std::string_view rest = comments_ ? text.substr(words.size()) : std::string_view();
    if (words.empty() && rest.empty()) {
      return;
    }
    line_.clear();
    if (is_canonical(words)) {
      for (const char c : words) {
        if (c != ' ') {
          line_ += c;
        }
      }
    } else {
      line_ += words;
    }
    (line_ += rest) += '\n';
    pairs();
  }

  [[nodiscard]] std::string take() {
    if (!comments_) {
      command(kResetAll);
    }
    return std::move(packed_);
  }

 private:
  void command(unsigned char code) {
    packed_ += static_cast<char>(kSignal);
    packed_ += static_cast<char>(kSignal);
    packed_ += static_cast<char>(code);
  }

  void set_packing(bool packing) {
    if (packing_ != packing) {
      command(packing ? kEnablePacking : kDisablePacking);
      packing_ = packing;
    }
  }

  // Packs line_ two characters at a time. A line ends with a whole byte: after a line end in the
  // lower half, the upper half means nothing.
  void pairs() {
    static const std::array<std::uint8_t, 256> codes = make_codes();
    set_packing(true);
    const std::size_t begin = packed_.size();
    for (std::size_t i = 0; i < line_.size(); i += 2) {
      const char first = line_[i];
      const char second = i + 1 < line_.size() ? line_[i + 1] : '\n';
      const unsigned low = codes[static_cast<unsigned char>(first)];
      const unsigned high = codes[static_cast<unsigned char>(second)];
      packed_ += static_cast<char>(high << 4U | low);
      if (low == kWhole) {
        packed_ += first;
      }
      if (high == kWhole) {
        packed_ += second;
      }
    }
    // libbgcode's reader (1.0) makes room for twice the packed bytes and loses characters beyond
    // that. So we add empty lines, as its own writer does: they give room and have no meaning.
    while (2 * (packed_.size() - begin) < most_text()) {
      packed_ += static_cast<char>(kLineEndCode << 4U | kLineEndCode);
    }
  }

  // The length of the line when it is unpacked with a space before each of its words.
  [[nodiscard]] std::size_t most_text() const {
    const auto capitals = std::ranges::count_if(line_, is_capital);
    return line_.size() + (line_.starts_with('G') ? static_cast<std::size_t>(capitals) : 0);
  }

  bool comments_;
  bool packing_ = true;
  std::string line_;
  std::string packed_;
};

// Puts the spaces back between the words of G commands; empty lines vanish.
class SpacedText {
 public:
  void put(char c, bool no_spaces) {
    if (c == '\n') {
      if (column_ > 0) {
        text_ += c;
      }
      column_ = 0;
      spacing_ = false;
      return;
    }
    if (column_ == 1) {
      spacing_ = no_spaces && text_.back() == 'G' && is_digit(c);
    } else if (c == ';' || c == '"') {
      spacing_ = false;
    }
    if (spacing_ && is_capital(c) && text_.back() != ' ') {
      text_ += ' ';
    }
    text_ += c;
    ++column_;
  }

  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  std::string text_;
  std::size_t column_ = 0;
  bool spacing_ = false;
};

class MeatUnpacker {
 public:
  void byte(unsigned char c) {
    if (c == kSignal && signals_ < 2) {
      ++signals_;
      return;
    }
    if (signals_ == 2) {
      signals_ = 0;
      command(c);
      return;
    }
    if (signals_ == 1) {
      signals_ = 0;
      data(kSignal);
    }
    data(c);
  }

  [[nodiscard]] std::string take() { return text_.take(); }

 private:
  void command(unsigned char code) {
    switch (code) {
      case kEnablePacking:
        packing_ = true;
        break;
      case kDisablePacking:
      case kResetAll:
        packing_ = false;
        break;
      case kEnableNoSpaces:
        no_spaces_ = true;
        break;
      case kDisableNoSpaces:
        no_spaces_ = false;
        break;
      default:
        break;
    }
  }

  void put(char c) { text_.put(c, no_spaces_); }

  [[nodiscard]] char character(unsigned code) const {
    return code == kSpaceCode && no_spaces_ ? 'E' : kCharacters[code];
  }

  void data(unsigned char c) {
    if (!packing_) {
      put(static_cast<char>(c));
    } else if (whole_ > 0) {
      --whole_;
      put(static_cast<char>(c));
      if (has_held_) {
        has_held_ = false;
        put(held_);
      }
    } else {
      pair(c & 15U, static_cast<unsigned>(c) >> 4U);
    }
  }

  void pair(unsigned low, unsigned high) {
    if (low == kWhole) {
      whole_ = high == kWhole ? 2 : 1;
      has_held_ = high != kWhole;
      held_ = has_held_ ? character(high) : '\0';
      return;
    }
    put(character(low));
    if (character(low) == '\n') {
      return;
    }
    if (high == kWhole) {
      whole_ = 1;
    } else {
      put(character(high));
    }
  }

  SpacedText text_;
  bool packing_ = false;
  bool no_spaces_ = false;
  unsigned signals_ = 0;
  unsigned whole_ = 0;     // characters to come in bytes of their own
  bool has_held_ = false;  // held_ is put after the first of these characters
  char held_ = '\0';
};

}  // namespace

std::string meatpack(std::string_view lines, bool comments) {
  MeatPacker packer(comments);
  while (!lines.empty()) {
    const std::size_t end = lines.find('\n');
    packer.line(lines.substr(0, end));
    lines.remove_prefix(end == std::string_view::npos ? lines.size() : end + 1);
  }
  return packer.take();
}

std::string unmeatpack(std::string_view packed) {
  MeatUnpacker unpacker;
  for (const char c : packed) {
    unpacker.byte(static_cast<unsigned char>(c));
  }
  return unpacker.take();
}

}  // namespace unflex::container
