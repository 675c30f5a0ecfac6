#include "new_prints.hpp"

#include <utility>

namespace unflex::app {
namespace {

std::optional<platform::FileState> state_of(const std::optional<std::string>& name) {
  if (!name) {
    return std::nullopt;
  }
  const auto state = platform::state_of(*name);
  return state ? std::optional(*state) : std::nullopt;
}

}  // namespace

bool NewPrints::take(const std::string& name, const State& state) {
  const auto last = seen_.find(name);
  const auto done = done_.find(name);
  const bool is_settled = last != seen_.end() && last->second == state;
  if (!is_settled || (done != done_.end() && done->second == state)) {
    return false;
  }
  done_[name] = state;
  return true;
}

void NewPrints::keep_new(BatchFiles& files, const std::optional<std::string>& printer_file) {
  const std::optional<platform::FileState> printer_of_all = state_of(printer_file);
  std::map<std::string, State> seen;
  std::erase_if(files.prints, [&](const BatchPrint& print) {
    const auto input = platform::state_of(print.input);
    if (!input) {
      return true;
    }
    const State state{*input, print.printer_file ? state_of(print.printer_file) : printer_of_all};
    seen[print.name] = state;
    return !take(print.name, state);
  });
  seen_ = std::move(seen);
  std::erase_if(files.passed_by,
                [&](const Diagnostic& remark) { return !told_.insert(to_string(remark)).second; });
  std::erase_if(files.unreadable,
                [&](const Error& error) { return !told_.insert(to_string(error)).second; });
}

}  // namespace unflex::app
