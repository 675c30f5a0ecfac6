// Exceptions of other people's libraries, also where the compiler's own cannot be caught.
#pragma once

#include <exception>
#include <functional>

namespace unflex::platform {

// Calls `work`, and hands what it throws to `caught`. In WebAssembly, what the work had on its
// stack is then lost, memory and files too.
void catching(const std::function<void()>& work,
              const std::function<void(const std::exception&)>& caught);

}  // namespace unflex::platform
