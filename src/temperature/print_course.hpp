// Reads a print as its hotend meets it: what is laid when, and what is asked of the hotend.
#pragma once

#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/core/text_store.hpp"
#include "unflex/hotend/along_print.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::temperature {

struct PrintCourse {
  hotend::Course course;
  std::vector<hotend::Command> commands;  // of the tool in use, in the order of the text
};

// Plans the text by the firmware's rules. `name` is what errors call it. Errors: it cannot be read;
// the user has cancelled.
[[nodiscard]] Result<PrintCourse> print_course(const TextStore& text, const std::string& name,
                                               const machine::Settings& settings,
                                               Progress& progress);

}  // namespace unflex::temperature
