// The settings as the emitter wants them.
#pragma once

#include <string>

#include "unflex/emit/emit_options.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::run {

[[nodiscard]] emit::EmitOptions emit_options(const machine::Settings& settings,
                                             std::string version);

}  // namespace unflex::run
