// Streams of bytes by a descriptor, such as a pipe.
#pragma once

#include <memory>

#include "unflex/core/byte_stream.hpp"

namespace unflex::platform {

// The descriptor must outlive what is returned.
[[nodiscard]] std::shared_ptr<ByteSource> descriptor_source(int descriptor);
[[nodiscard]] std::shared_ptr<ByteSink> descriptor_sink(int descriptor);

}  // namespace unflex::platform
