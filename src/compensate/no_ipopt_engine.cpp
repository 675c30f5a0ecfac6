// Substitutes for the Ipopt engine in a library built without Ipopt.
#include "unflex/compensate/axis_window.hpp"

namespace unflex::compensate {

bool has_ipopt_engine() { return false; }

std::unique_ptr<Engine> make_ipopt_engine() { return nullptr; }

}  // namespace unflex::compensate
