#include "unflex/platform/catching.hpp"

namespace unflex::platform {

void catching(const std::function<void()>& work,
              const std::function<void(const std::exception&)>& caught) {
  try {
    work();
  } catch (const std::exception& thrown) {
    caught(thrown);
  }
}

}  // namespace unflex::platform
