#include "shell_words.hpp"

#include "characters.hpp"

namespace unflex::gcode {

bool ShellWords::next(std::string& token) {
  token.clear();
  while (cursor_ < text_.size() && is_blank(text_[cursor_])) {
    ++cursor_;
  }
  bool any = false;
  while (cursor_ < text_.size()) {
    const char c = text_[cursor_];
    if (is_blank(c) || c == '#' || c == ';') {
      return any;
    }
    any = true;
    if (c == '"' || c == '\'') {
      if (!read_quoted(token)) {
        return false;
      }
    } else if (c == '\\') {
      if (cursor_ + 1 == text_.size()) {
        unclosed_ = true;
        return false;
      }
      token.push_back(text_[cursor_ + 1]);
      cursor_ += 2;
    } else {
      token.push_back(c);
      ++cursor_;
    }
  }
  return any;
}

bool ShellWords::read_quoted(std::string& token) {
  const char quote = text_[cursor_++];
  while (cursor_ < text_.size()) {
    const char c = text_[cursor_++];
    if (c == quote) {
      return true;
    }
    // Within double quotes a backslash protects only a quote or another backslash.
    const bool escapes = quote == '"' && c == '\\' && cursor_ < text_.size() &&
                         (text_[cursor_] == '"' || text_[cursor_] == '\\');
    token.push_back(escapes ? text_[cursor_++] : c);
  }
  unclosed_ = true;
  return false;
}

}  // namespace unflex::gcode
