// The part of a folder that one of several machines works on.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// The value of a variable of the environment, if it is set.
using Variable = std::function<std::optional<std::string>(const std::string& name)>;

// The shard that --shard names. "2/8" is the second of eight. "auto" takes both numbers from Slurm:
// the task of a job array, or of srun. "auto/8" takes the shard's number from Slurm or from a
// Kubernetes indexed job. An error of kind usage if the text names no shard.
[[nodiscard]] Result<Shard> shard_of(std::string_view text, const Variable& variable);

// Whether the print belongs to the shard. That depends on its name alone, so that machines agree
// even if one of them sees a print that another does not.
[[nodiscard]] bool has(const Shard& shard, std::string_view print);

// Reads the environment of the process.
[[nodiscard]] std::optional<std::string> environment_variable(const std::string& name);

}  // namespace unflex::app
