// RepRapFirmware's meta commands, expressions and comments with a meaning.
#pragma once

#include <cstddef>
#include <string_view>

namespace unflex::gcode {

enum class MetaCommand {
  none,
  harmless,  // var, global, set, echo, skip: change neither motion nor modes
  block,     // if, elif, else, while: the lines indented below may run or not, or many times
  jump,      // break, continue, abort
};

// GCodeBuffer/StringParser.cpp, ProcessConditionalGCode: a word in lower case that begins the line.
[[nodiscard]] MetaCommand meta_command(std::string_view content);

// Blanks before the command; a tab leads to the next multiple of four.
[[nodiscard]] std::size_t indentation(std::string_view content);

// Whether braces outside quotes and comments make part of the line an expression.
[[nodiscard]] bool has_expression(std::string_view content);

// Whether a meta command may ask for limits, factors, modes or places: the object model's move,
// state and tools.
[[nodiscard]] bool reads_machine(std::string_view content);

// GCodes3.cpp, ProcessWholeLineComment: a comment that begins or ends an object. If the object has
// been cancelled, motion up to the next such comment is left out.
[[nodiscard]] bool labels_object(std::string_view comment);

}  // namespace unflex::gcode
