#include "new_prints.hpp"

#include <utility>

namespace unflex::app {

bool NewPrints::take(const std::string& name, const platform::FileState& state) {
  const auto last = seen_.find(name);
  const auto done = done_.find(name);
  const bool is_settled = last != seen_.end() && last->second == state;
  if (!is_settled || (done != done_.end() && done->second == state)) {
    return false;
  }
  done_[name] = state;
  return true;
}

void NewPrints::keep_new(BatchFiles& files) {
  std::map<std::string, platform::FileState> seen;
  std::erase_if(files.prints, [&](const BatchPrint& print) {
    const auto state = platform::state_of(print.input);
    if (!state) {
      return true;
    }
    seen[print.name] = *state;
    return !take(print.name, *state);
  });
  seen_ = std::move(seen);
  std::erase_if(files.passed_by,
                [&](const Diagnostic& remark) { return !told_.insert(to_string(remark)).second; });
  std::erase_if(files.unreadable,
                [&](const Error& error) { return !told_.insert(to_string(error)).second; });
}

}  // namespace unflex::app
