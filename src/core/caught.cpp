#include "unflex/core/caught.hpp"

#include <fmt/core.h>

#include <new>
#include <string>
#include <system_error>

namespace unflex {
namespace {

constexpr const char* kRemedy = "give -j a smaller number, or end other programs";

std::string text_of(const std::exception& exception) {
  if (dynamic_cast<const std::bad_alloc*>(&exception) != nullptr) {
    return fmt::format("out of memory; {}", kRemedy);
  }
  const auto* const system = dynamic_cast<const std::system_error*>(&exception);
  if (system != nullptr && system->code() == std::errc::resource_unavailable_try_again) {
    return fmt::format("the system gives no more threads; {}", kRemedy);
  }
  return fmt::format("internal error: {}", exception.what());
}

}  // namespace

Error error_of(const std::exception& exception) {
  return {ErrorKind::internal, {}, text_of(exception)};
}

}  // namespace unflex
