// New prints in a folder that is watched.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include "batch_files.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::app {

// Finds prints that are new or have changed, or whose printer file has changed. A print is taken
// once it is unchanged from one look to the next, since an upload takes time.
class NewPrints {
 public:
  // Keeps only the prints to work on now, and the remarks not yet reported. printer_file: for
  // prints that have none of their own.
  void keep_new(BatchFiles& files, const std::optional<std::string>& printer_file);

 private:
  struct State {
    platform::FileState print;
    std::optional<platform::FileState> printer;

    [[nodiscard]] bool operator==(const State&) const = default;
  };

  // Whether the print is due. If it is, it counts as worked on from now on.
  [[nodiscard]] bool take(const std::string& name, const State& state);

  std::map<std::string, State> seen_;  // at the last look
  std::map<std::string, State> done_;  // when it was worked on
  std::set<std::string> told_;
};

}  // namespace unflex::app
