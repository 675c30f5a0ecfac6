#include "stage_form_steps.hpp"

namespace unflex::compensate {

template class StageForm<1>;

}  // namespace unflex::compensate
