// Reads slicers' comments about the lines that follow: kind of feature (gcode/feature.hpp), new
// layer (gcode/layer_mark.hpp).
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

namespace unflex::record {

class FeatureLog {
 public:
  // The next line of the file.
  void read(std::string_view content, std::size_t number);

  struct At {
    std::size_t feature = 0;
    std::size_t layers_begun = 0;  // comments that begin a layer so far
  };
  // The feature and layer that a line belongs to. The line must have been read. Lines must not
  // decrease from call to call.
  [[nodiscard]] At at(std::size_t number);

  // Names by feature number. 0 stands for lines before any comment. At most 48 are told apart; all
  // further names share the last number.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  [[nodiscard]] std::size_t number_of(std::string_view name);

  struct Change {
    std::size_t line;
    At at;
  };
  std::vector<std::string> names_{""};
  At last_;
  At current_;
  std::deque<Change> changes_;
};

}  // namespace unflex::record
