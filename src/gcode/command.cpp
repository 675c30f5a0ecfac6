#include "unflex/gcode/command.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "characters.hpp"
#include "printer_number.hpp"
#include "shell_words.hpp"
#include "unflex/core/number.hpp"

namespace unflex::gcode {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

template <class Integer>
bool read_number(std::string_view digits, Integer& value) {
  const char* const end = digits.data() + digits.size();
  const auto [stop, failure] = std::from_chars(digits.data(), end, value);
  return failure == std::errc{} && stop == end;
}

bool is_number_character(char c) { return is_digit(c) || c == '.' || c == '+' || c == '-'; }

class Parser {
 public:
  Parser(std::string_view line, Command& command) : line_(line), command_(command) {}

  void run();

 private:
  void read_line_number();
  void read_traditional();
  void read_words();
  void read_word();
  void read_text();
  void read_extended();
  void read_checksum();
  void read_comment() { command_.comment = line_.substr(cursor_ + 1); }
  void skip_blanks();
  void skip_parentheses();
  void skip_string();
  std::string_view take_digits();
  void unreadable(std::size_t from);
  void malformed(std::string problem);

  [[nodiscard]] bool at_end() const { return cursor_ >= line_.size(); }
  [[nodiscard]] char peek() const { return at_end() ? '\0' : line_[cursor_]; }
  // The next character that is no blank, '\0' at the end.
  [[nodiscard]] char peek_past_blanks(std::size_t from) const;
  [[nodiscard]] bool checksum_follows(std::size_t star) const;
  // Whether the line is T-1, which deselects the tool.
  [[nodiscard]] bool deselects_tool() const {
    return to_upper(peek()) == 'T' && line_.substr(cursor_ + 1, 1) == "-" &&
           is_digit(peek_past_blanks(cursor_ + 2));
  }
  [[nodiscard]] std::size_t numbered_checksum() const;

  std::string_view line_;
  Command& command_;
  std::size_t cursor_ = 0;
  std::size_t start_ = 0;  // first character that is no blank; the checksum counts from here
};

void Parser::run() {
  skip_blanks();
  start_ = cursor_;
  while (peek() == '(') {
    command_.spelling.behind_parentheses = true;
    skip_parentheses();
    skip_blanks();
  }
  if (to_upper(peek()) == 'N' && is_digit(peek_past_blanks(cursor_ + 1))) {
    read_line_number();
  }
  if (command_.kind == CommandKind::malformed || at_end()) {
    return;
  }
  const char first = peek();
  if (first == ';') {
    read_comment();
  } else if (first == '*' && checksum_follows(cursor_)) {
    read_checksum();
  } else if (is_letter(first) && (is_digit(peek_past_blanks(cursor_ + 1)) || deselects_tool())) {
    read_traditional();
  } else if (is_letter(first) || first == '_') {
    read_extended();
  } else {
    unreadable(cursor_);
  }
}

void Parser::read_line_number() {
  const std::size_t from = cursor_++;
  skip_blanks();
  std::int64_t number = 0;
  if (read_number(take_digits(), number)) {
    command_.line_number = number;
  }
  if (!command_.line_number || is_number_character(peek()) || peek() == '_') {
    unreadable(from);
  }
  skip_blanks();
}

void Parser::read_traditional() {
  command_.kind = CommandKind::traditional;
  command_.letter = to_upper(line_[cursor_]);
  const std::size_t from = cursor_++;
  command_.spelling.number_apart = is_blank(peek());
  skip_blanks();
  const int sign = peek() == '-' ? -1 : 1;
  cursor_ += sign < 0 ? 1 : 0;
  int number = 0;
  const std::string_view digits = take_digits();
  const bool has_number = read_number(digits, number);
  command_.spelling.number_padded = digits.size() > 1 && digits.front() == '0';
  bool has_subnumber = true;
  if (peek() == '.') {
    ++cursor_;
    has_subnumber = read_number(take_digits(), command_.subnumber);
  }
  if (!has_number || !has_subnumber) {
    malformed(fmt::format("cannot read '{}'", line_.substr(from, cursor_ - from)));
    return;
  }
  command_.number = sign * number;
  const bool takes_text = command_.letter == 'M' && command_.subnumber == -1 &&
                          (number == 117 || number == 118 || number == 23);
  if (takes_text) {
    read_text();
  } else {
    read_words();
  }
}

void Parser::read_words() {
  const std::size_t from = cursor_;
  while (command_.kind != CommandKind::malformed) {
    skip_blanks();
    const char c = peek();
    if (at_end() || c == ';' || (c == '*' && checksum_follows(cursor_))) {
      break;
    }
    if (c == '(') {
      command_.spelling.parentheses = true;
      skip_parentheses();
    } else if (is_letter(c)) {
      read_word();
    } else {
      unreadable(cursor_);
    }
  }
  command_.arguments = trimmed(line_.substr(from, cursor_ - from));
  if (peek() == '*') {
    read_checksum();
  } else if (peek() == ';') {
    read_comment();
  }
}

void Parser::read_word() {
  const std::size_t from = cursor_;
  const char before = line_[from - 1];
  command_.spelling.joined_letters |= is_letter(before) || before == '_';
  command_.spelling.exponent |= to_upper(line_[from]) == 'E' &&
                                (is_digit(before) || before == '.') && !command_.words.empty();
  // We fill the word where it stays. Copying it right after it was written in parts stalls the
  // processor.
  Word& word = command_.words.emplace_back();
  word.letter = to_upper(line_[cursor_++]);
  skip_blanks();
  if (peek() == '"') {
    skip_string();
  } else {
    const std::size_t digits = cursor_;
    while (!at_end() && is_number_character(line_[cursor_])) {
      ++cursor_;
    }
    if (cursor_ != digits) {
      if (const auto number = parse_number(line_.substr(digits, cursor_ - digits));
          number && fits_printers(*number)) {
        word.value.emplace(as_printers_take_it(*number));
      } else {
        unreadable(from);
      }
    }
  }
}

void Parser::read_text() {
  const std::size_t end =
      std::min(std::min(line_.find(';', cursor_), line_.size()), numbered_checksum());
  command_.arguments = trimmed(line_.substr(cursor_, end - cursor_));
  cursor_ = end;
  if (peek() == ';') {
    read_comment();
  } else if (peek() == '*') {
    read_checksum();
  }
}

void Parser::read_extended() {
  const std::size_t from = cursor_;
  while (!at_end() && is_name_character(line_[cursor_])) {
    command_.name.push_back(to_upper(line_[cursor_++]));
  }
  const char next = peek();
  const bool name_ends = at_end() || is_blank(next) || next == ';' || next == '#' ||
                         (next == '*' && command_.line_number.has_value());
  if (!name_ends) {
    unreadable(from);
    return;
  }
  if (command_.name.size() == 1) {
    malformed(fmt::format("'{}' without a number", command_.name));
    return;
  }
  command_.kind = CommandKind::extended;
  const std::string_view rest =
      line_.substr(cursor_, std::min(numbered_checksum(), line_.size()) - cursor_);
  ShellWords tokens(rest);
  std::string token;
  while (tokens.next(token)) {
    if (token.find('=') == std::string::npos) {
      malformed(fmt::format("'{}' is not of the form KEY=VALUE", token));
      return;
    }
  }
  if (tokens.unclosed()) {
    malformed("a quote is not closed");
    return;
  }
  command_.arguments = trimmed(rest.substr(0, tokens.position()));
  cursor_ += tokens.position();
  if (peek() == '*') {
    read_checksum();
  } else if (!at_end()) {
    read_comment();
  }
}

// The checksum is the exclusive or of all bytes before the '*'.
void Parser::read_checksum() {
  int sum = 0;
  for (const char c : line_.substr(start_, cursor_ - start_)) {
    sum ^= static_cast<unsigned char>(c);
  }
  ++cursor_;
  skip_blanks();
  const std::string_view digits = take_digits();
  int checksum = 0;
  if (read_number(digits, checksum)) {
    command_.checksum = checksum;
  }
  if (command_.checksum != sum) {
    malformed(fmt::format("the checksum is {} but should be {}", digits, sum));
  }
  skip_blanks();
  if (peek() == ';') {
    read_comment();
  }
}

// Whether there are digits and nothing else after the '*' at `star`.
bool Parser::checksum_follows(std::size_t star) const {
  std::string_view rest = line_.substr(star + 1);
  rest = trimmed(rest.substr(0, rest.find(';')));
  return !rest.empty() && std::all_of(rest.begin(), rest.end(), is_digit);
}

// Place of the checksum's '*', npos without one. Free text and extended commands may hold a '*' of
// their own, so there only a numbered line has a checksum.
std::size_t Parser::numbered_checksum() const {
  const std::size_t star = command_.line_number ? line_.rfind('*') : std::string_view::npos;
  const bool found = star != std::string_view::npos && star >= cursor_ && checksum_follows(star);
  return found ? star : std::string_view::npos;
}

void Parser::skip_blanks() {
  while (!at_end() && is_blank(line_[cursor_])) {
    ++cursor_;
  }
}

void Parser::skip_parentheses() {
  const std::size_t close = line_.find(')', cursor_);
  cursor_ = close == std::string_view::npos ? line_.size() : close + 1;
}

void Parser::skip_string() {
  const std::size_t from = cursor_;
  const std::size_t close = line_.find('"', cursor_ + 1);
  cursor_ = close == std::string_view::npos ? line_.size() : close + 1;
  if (close == std::string_view::npos) {
    unreadable(from);
  }
}

std::string_view Parser::take_digits() {
  const std::size_t from = cursor_;
  while (!at_end() && is_digit(line_[cursor_])) {
    ++cursor_;
  }
  return line_.substr(from, cursor_ - from);
}

// Deals with characters that form no word. In an M-code they are text or an expression, and a word
// may follow. In any other command they make the line malformed.
void Parser::unreadable(std::size_t from) {
  if (command_.letter == 'M' && command_.number >= 0) {
    command_.spelling.other_text = true;
    const std::size_t close = peek() == '{' ? line_.find('}', cursor_) : std::string_view::npos;
    cursor_ = close != std::string_view::npos ? close + 1 : std::max(cursor_, from + 1);
    return;
  }
  while (!at_end() && !is_blank(line_[cursor_]) && line_[cursor_] != ';') {
    ++cursor_;
  }
  malformed(line_.starts_with(kByteOrderMark)
                ? "a byte order mark, which printers take for part of the command; save without it"
                : fmt::format("cannot read '{}'", line_.substr(from, cursor_ - from)));
}

void Parser::malformed(std::string problem) {
  command_.kind = CommandKind::malformed;
  command_.problem = std::move(problem);
}

char Parser::peek_past_blanks(std::size_t from) const {
  while (from < line_.size() && is_blank(line_[from])) {
    ++from;
  }
  return from < line_.size() ? line_[from] : '\0';
}

}  // namespace

void Command::reset() {
  kind = CommandKind::none;
  letter = '\0';
  number = -1;
  subnumber = -1;
  words.clear();
  name.clear();
  arguments = {};
  spelling = {};
  comment = {};
  line_number.reset();
  checksum.reset();
  problem.clear();
}

std::optional<double> Command::value(char a_letter) const {
  for (auto word = words.rbegin(); word != words.rend(); ++word) {
    if (word->letter == a_letter) {
      return word->value;
    }
  }
  return std::nullopt;
}

bool Command::has(char a_letter) const {
  return std::any_of(words.begin(), words.end(),
                     [a_letter](const Word& word) { return word.letter == a_letter; });
}

bool Command::has_any(std::string_view letters) const {
  return std::any_of(words.begin(), words.end(), [letters](const Word& word) {
    return letters.find(word.letter) != std::string_view::npos;
  });
}

std::optional<std::string> Command::parameter(std::string_view key) const {
  std::optional<std::string> found;
  ShellWords tokens(arguments);
  std::string token;
  while (tokens.next(token)) {
    const std::size_t equals = token.find('=');
    const bool same = equals == key.size() &&
                      std::equal(key.begin(), key.end(), token.begin(),
                                 [](char wanted, char c) { return wanted == to_upper(c); });
    if (same) {
      found = token.substr(equals + 1);
    }
  }
  return found;
}

Command parse(std::string_view line) {
  Command command;
  parse(line, command);
  return command;
}

void parse(std::string_view line, Command& command) {
  constexpr std::size_t kUsualWords = 8;
  command.reset();
  command.words.reserve(kUsualWords);
  Parser(line, command).run();
}

}  // namespace unflex::gcode
