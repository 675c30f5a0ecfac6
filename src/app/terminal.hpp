// What the terminal behind a descriptor can show.
#pragma once

namespace unflex::app {

// A terminal that redraws a line when it is told to; not one of TERM=dumb.
[[nodiscard]] bool can_redraw(int fd);

// A terminal that may get colours: NO_COLOR (https://no-color.org) is unset or empty.
[[nodiscard]] bool can_colour(int fd);

}  // namespace unflex::app
