// One line of G-code, taken apart.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace unflex::gcode {

// A letter and what follows it, e.g. X12.5, or a bare letter as in "G28 X".
struct Word {
  char letter = '\0';           // upper case
  std::optional<double> value;  // nullopt for a bare letter
};

enum class CommandKind {
  none,         // blank or comment only
  traditional,  // letter and number: G1, M204, T0, M862.3
  extended,     // NAME KEY=VALUE … : Klipper's own commands and macros
  malformed,    // neither: `problem` says why
};

// Spellings of a traditional command that printers read differently.
struct Spelling {
  bool number_apart = false;    // "G 1"
  bool number_padded = false;   // "G01"
  bool joined_letters = false;  // "AX5": a word right behind a letter
  bool exponent = false;        // "Y20E2", "Y2.E1": an E right behind the number of another word
  bool parentheses = false;     // a comment in parentheses among the words
  bool behind_parentheses = false;  // a comment in parentheses before the command
  bool other_text = false;          // M-codes: text that is not a word
};

// The parsed line. Views point into the text handed to parse(), which must outlive the command.
struct Command {
  CommandKind kind = CommandKind::none;
  char letter = '\0';       // traditional: 'G', 'M', 'T' …, upper case
  int number = -1;          // traditional: 1 for G1; below zero only for a tool, T-1
  int subnumber = -1;       // traditional: 3 for M862.3, otherwise -1
  std::vector<Word> words;  // traditional, in the order of the line; without N and checksum
  std::string name;         // extended: the command's name in upper case
  // The text behind the command's name or number, trimmed, without comment and checksum.
  std::string_view arguments;
  Spelling spelling;
  std::string_view comment;                 // text behind ';' (or Klipper's '#'); empty without one
  std::optional<std::int64_t> line_number;  // N word
  std::optional<int> checksum;              // after '*'
  std::string problem;                      // malformed: what is wrong, for a message

  // Makes the command empty again; keeps the storage.
  void reset();
  // True for letter and number, e.g. is('G', 1).
  [[nodiscard]] bool is(char a_letter, int a_number) const {
    return kind == CommandKind::traditional && letter == a_letter && number == a_number;
  }
  // The value of the last word with this letter (a later word overrides an earlier one, as in
  // Klipper), if the word is there and has a value.
  [[nodiscard]] std::optional<double> value(char a_letter) const;
  // Whether a word with this letter is there, with or without a value.
  [[nodiscard]] bool has(char a_letter) const;
  // Whether a word with any of these letters is there.
  [[nodiscard]] bool has_any(std::string_view letters) const;
  // extended: the value of KEY=VALUE, key in upper case, shell-style quotes taken off.
  [[nodiscard]] std::optional<std::string> parameter(std::string_view key) const;
};

// Takes one line (without its line ending) apart. Never fails: a line that cannot be understood
// becomes `malformed`, and the caller should pass it on unchanged.
//
// Reads as printers do: lower case; words with or without spaces between them and between letter
// and value ("G1X1 Y 2"); numbers like ".5", "+1", "-.8"; ';' and '(' ')' comments; a leading N
// word and a trailing '*' checksum (checked: a wrong one is malformed). M117, M118 and M23 take the
// rest of the line as text, so no words are read from it. M-codes carry names and messages (M486
// ACube-1, M862.3 P "MK3S"). In an M-code, a word without a readable number has no value; in any
// other command such text makes the line malformed.
[[nodiscard]] Command parse(std::string_view line);

// Parses into an existing command, whose storage is used again.
void parse(std::string_view line, Command& command);

}  // namespace unflex::gcode
