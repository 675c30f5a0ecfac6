#include "stage_form_steps.hpp"

namespace unflex::compensate {

template class StageForm<3>;

}  // namespace unflex::compensate
