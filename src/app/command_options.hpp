// Parts that the options of several commands share.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "unflex/app/run_config.hpp"

namespace unflex::app {

inline constexpr unsigned kMaxWorkers = 256;

// A number above 0.
[[nodiscard]] CLI::Validator positive();

// A temperature in °C, up to `most`.
[[nodiscard]] CLI::Validator temperature(double most);

// A whole number from 1 to `most`. CLI::Range would show its own words in the help.
[[nodiscard]] CLI::Validator counting_number(unsigned most);

// One of some words, in small or capital letters. CLI::Transformer would show the numbers behind
// them in the help, and take these too.
template <class T>
[[nodiscard]] CLI::Validator word_for(std::vector<std::pair<std::string_view, T>> choices) {
  return {[choices = std::move(choices)](std::string& text) {
            std::string words;
            for (const auto& [word, value] : choices) {
              if (CLI::detail::to_lower(text) == word) {
                text = fmt::format("{}", static_cast<int>(value));
                return std::string{};
              }
              words += fmt::format("{}{}", words.empty() ? "" : ", ", word);
            }
            return fmt::format("'{}' is none of {}", text, words);
          },
          ""};
}

// The number that was given to an option. All options with numbers use this function. CLI11 would
// read a long double: its last bit differs between systems, and WASI's library ends the program
// there.
[[nodiscard]] double number_of(const std::string& option, const std::string& text);

// An option with a number.
CLI::Option* add_number(CLI::App& command, const std::string& name,
                        std::function<void(double)> take, const std::string& help);

template <class T>
CLI::Option* add_number(CLI::App& command, const std::string& name, T& value,
                        const std::string& help) {
  return add_number(
      command, name, [&value](double number) { value = number; }, help);
}

// --set.
void add_overrides(CLI::App& command, RunConfig& config);

// --printer and --set.
void add_settings(CLI::App& command, RunConfig& config);

inline constexpr const char* kReportOrPage =
    "Write a report, FILE.json or FILE.html, or JSON to stdout with -";

inline constexpr const char* kNoSummary = "No summary and no progress bar";

// Adds --printer, --set, --report and -q. The help of the last two is `report` and `quiet`.
void add_common_options(CLI::App& command, RunConfig& config, const char* report = kReportOrPage,
                        const char* quiet = kNoSummary);

// -j.
void add_jobs(CLI::App& command, RunConfig& config);

}  // namespace unflex::app
