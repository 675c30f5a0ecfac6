#include "batch_shard.hpp"

#include <fmt/core.h>

#include <charconv>
#include <cstdint>
#include <cstdlib>

#include "console.hpp"
#include "unflex/core/sha256.hpp"

namespace unflex::app {
namespace {

constexpr std::string_view kAuto = "auto";

std::optional<unsigned> whole(std::string_view text) {
  unsigned number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(number)
                                                                  : std::nullopt;
}

std::optional<unsigned> number_in(const Variable& variable, const std::string& name) {
  const std::optional<std::string> text = variable(name);
  return text ? whole(*text) : std::nullopt;
}

// The shard that Slurm gives the process, counted from 1. Tasks of a job array count in steps.
std::optional<Shard> shard_of_slurm(const Variable& variable) {
  const auto task = number_in(variable, "SLURM_ARRAY_TASK_ID");
  const auto tasks = number_in(variable, "SLURM_ARRAY_TASK_COUNT");
  if (task && tasks) {
    const unsigned first = number_in(variable, "SLURM_ARRAY_TASK_MIN").value_or(0);
    const unsigned step = number_in(variable, "SLURM_ARRAY_TASK_STEP").value_or(1);
    return Shard{(*task - first) / (step > 0 ? step : 1) + 1, *tasks};
  }
  const auto process = number_in(variable, "SLURM_PROCID");
  const auto processes = number_in(variable, "SLURM_NTASKS");
  if (process && processes) {
    return Shard{*process + 1, *processes};
  }
  return std::nullopt;
}

tl::unexpected<Error> wrong(std::string_view text, std::string_view why) {
  return fail(ErrorKind::usage, fmt::format("--shard {}: {}", one_line(text), why));
}

}  // namespace

Result<Shard> shard_of(std::string_view text, const Variable& variable) {
  const std::size_t slash = text.find('/');
  const std::string_view number = text.substr(0, slash);
  const std::string_view count = slash == std::string_view::npos ? "" : text.substr(slash + 1);
  std::optional<Shard> shard;
  if (number == kAuto) {
    shard = shard_of_slurm(variable);
    if (slash != std::string_view::npos) {
      const auto of_kubernetes = number_in(variable, "JOB_COMPLETION_INDEX");
      if (!shard && of_kubernetes) {
        shard = Shard{*of_kubernetes + 1, 1};
      }
      if (shard) {
        shard->count = whole(count).value_or(0);
      }
    }
    if (!shard) {
      return wrong(text,
                   "no number is in the environment; Slurm sets SLURM_ARRAY_TASK_ID or "
                   "SLURM_PROCID, and for auto/N a Kubernetes indexed job JOB_COMPLETION_INDEX");
    }
  } else {
    shard = Shard{whole(number).value_or(0), whole(count).value_or(0)};
  }
  if (shard->number == 0 || shard->count == 0 || shard->number > shard->count) {
    return wrong(text, "is to be I/N, with I from 1 to N, or auto");
  }
  return *shard;
}

bool has(const Shard& shard, std::string_view print) {
  std::uint64_t number = 0;
  const std::string hash = sha256(print).substr(0, 16);
  std::from_chars(hash.data(), hash.data() + hash.size(), number, 16);
  return number % shard.count == shard.number - 1;
}

std::optional<std::string> environment_variable(const std::string& name) {
  const char* const value = std::getenv(name.c_str());
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

}  // namespace unflex::app
