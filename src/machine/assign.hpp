// Values on their way from a source to the member behind a key.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "draft.hpp"

namespace unflex::machine {

struct NamedValue;

// A value that was converted from another unit, without the rounding noise of the conversion:
// firmwares keep seven digits.
[[nodiscard]] double as_written(double value);

// A value that a source may hold for a key. monostate stands for a value that no key takes.
struct Value {
  Value(double number);
  Value(bool flag);
  Value(std::string text);
  Value(const char* text);
  Value(const Range& range);
  Value(std::vector<Value> list);
  Value(std::vector<NamedValue> table);
  [[nodiscard]] static Value other(std::string kind);

  std::variant<std::monostate, double, bool, std::string, std::vector<Value>,
               std::vector<NamedValue>>
      content;
  std::string kind;  // in words, for messages
};

// A value of a table.
struct NamedValue {
  std::string name;
  Value value;
};

// Constructors stand here because the variant needs NamedValue to be complete.
inline Value::Value(double number) : content(number), kind("a number") {}
inline Value::Value(bool flag) : content(flag), kind("true or false") {}
inline Value::Value(std::string text) : content(text), kind("the text \"" + text + "\"") {}
inline Value::Value(const char* text) : Value(std::string(text)) {}
inline Value::Value(std::vector<Value> list) : content(std::move(list)), kind("an array") {}
inline Value::Value(const Range& range)
    : Value(std::vector<Value>{Value(range.min), Value(range.max)}) {}
inline Value::Value(std::vector<NamedValue> table) : content(std::move(table)), kind("a table") {}
inline Value Value::other(std::string kind) {
  Value value(0.0);
  value.content = std::monostate{};
  value.kind = std::move(kind);
  return value;
}

// A key's value and where it was read.
struct Assignment {
  std::string key;
  Value value;
  SourcePlace place;
};

// The settings that a reader has understood in a printer's or a slicer's own form.
struct Reading {
  std::vector<Assignment> assignments;  // if a key occurs twice, the later wins
  std::vector<Note> notes;
  std::vector<Diagnostic> guesses;  // Settings::guesses
  std::string maybe_elsewhere;      // Draft::maybe_elsewhere

  void add(std::string key, Value value, SourcePlace place) {
    assignments.push_back({std::move(key), std::move(value), std::move(place)});
  }
  // Drops the assignments of all keys that begin so.
  void forget(std::string_view beginning) {
    std::erase_if(assignments, [&](const Assignment& assignment) {
      return assignment.key.starts_with(beginning);
    });
  }
  void note(SourcePlace place, std::string message, std::vector<std::string> keys = {}) {
    notes.push_back({{std::move(place), std::move(message)}, std::move(keys)});
  }
  // Takes the damping ratio that an input shaper is made for as the damping ratio of the axis, "x"
  // or "y". A ratio that no printer has brings a note instead.
  void add_shaper_damping(const std::string& axis, double ratio, const SourcePlace& place);
  void guess(SourcePlace place, std::string message) {
    guesses.push_back({std::move(place), std::move(message)});
  }
};

// Stores the value of a key and its place. Returns what is wrong (unknown key, type, bounds), or an
// empty text.
[[nodiscard]] std::string assign(const std::string& name, const Value& value,
                                 const SourcePlace& place, Draft& draft);

// Stores all assignments. What is wrong is an error of kind usage at its place.
[[nodiscard]] Status apply(const Reading& reading, Draft& draft);

}  // namespace unflex::machine
