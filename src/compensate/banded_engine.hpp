// The banded engine with a form of one's choice.
#pragma once

#include <memory>

#include "unflex/compensate/axis_window.hpp"

namespace unflex::compensate {

enum class BandedForm {
  fitting,  // flat where it suits and succeeds, else stages
  flat,
  stages,
};

[[nodiscard]] std::unique_ptr<Engine> make_banded_engine(BandedForm form);

}  // namespace unflex::compensate
