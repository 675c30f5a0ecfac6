// The resources that the process and its children have taken so far; 0 where the system does not
// tell.
#pragma once

namespace unflex::platform {

[[nodiscard]] double processor_s();
// The largest memory of the process, or of its largest child if that had more.
[[nodiscard]] double peak_memory_mb();

}  // namespace unflex::platform
