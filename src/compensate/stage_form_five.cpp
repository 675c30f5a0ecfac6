#include "stage_form_steps.hpp"

namespace unflex::compensate {

template class StageForm<5>;

}  // namespace unflex::compensate
