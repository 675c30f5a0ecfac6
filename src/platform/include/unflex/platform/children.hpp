// Processes that are forked from this one and go on with a part of its work. Only where systems can
// fork.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "unflex/platform/descriptors.hpp"

namespace unflex::platform {

struct Child {
  int number = -1;
  FileDescriptor channel;  // to and from the child
};

// The work of a child, with its end of the channel. True if it ended well.
using ChildWork = std::function<bool(int channel)>;

enum class OnInterrupt { remember, leave_to_parent };

// Forks a process that works and ends. Open streams of this process are not flushed twice, and no
// exception gets out. A child is killed when its parent is. `others` are closed in the child. The
// error is a text.
[[nodiscard]] tl::expected<Child, std::string> fork_child(const ChildWork& work,
                                                          OnInterrupt on_interrupt,
                                                          std::span<const int> others = {});

// Which of the channels have something to read, be it the end; none if nothing comes in time or if
// a signal comes.
[[nodiscard]] std::vector<std::size_t> ready_channels(std::span<const int> channels,
                                                      std::chrono::milliseconds most);

// A message is its length and its bytes. False when the other side is gone.
[[nodiscard]] bool send_message(int channel, std::string_view message);
[[nodiscard]] bool receive_message(int channel, std::string& message);

// How a child ended: "" if well, else what happened to it.
[[nodiscard]] std::string wait_for_end(const Child& child);
// Whether the child has ended. If it has, its number is free again.
[[nodiscard]] bool has_ended(const Child& child);
void ask_to_end(const Child& child);
void kill_child(const Child& child);  // and waits for its end

}  // namespace unflex::platform
