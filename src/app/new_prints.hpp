// What comes into a folder that is watched.
#pragma once

#include <map>
#include <set>
#include <string>

#include "batch_files.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::app {

// The prints that have come or changed, by looking again and again. One is taken once it has stayed
// as it is from one look to the next, since an upload takes time.
class NewPrints {
 public:
  // Leaves the prints to be worked on now, and what has not been told yet.
  void keep_new(BatchFiles& files);

 private:
  // Whether the print is to be worked on, which it then is not another time.
  [[nodiscard]] bool take(const std::string& name, const platform::FileState& state);

  std::map<std::string, platform::FileState> seen_;  // at the last look
  std::map<std::string, platform::FileState> done_;  // when it was worked on
  std::set<std::string> told_;
};

}  // namespace unflex::app
