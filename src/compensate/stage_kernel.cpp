#include "stage_kernel.hpp"

#include "lane_kernels.hpp"

namespace unflex::compensate {

void ModeSteps::clear() {
  for (std::vector<double>& part : own) {
    part.clear();
  }
  for (std::array<std::vector<double>, 2>* of : {&by_accel, &by_jerk}) {
    for (std::vector<double>& part : *of) {
      part.clear();
    }
  }
}

void ModeSteps::add(double omega_h, double zeta) {
  const AxisChain chain(omega_h, zeta);
  const ChainMatrix& growth = chain.growth;
  own[0].push_back(1.0 + growth(0, 0));
  own[1].push_back(growth(0, 1));
  own[2].push_back(growth(1, 0));
  own[3].push_back(1.0 + growth(1, 1));
  by_accel[0].push_back(growth(0, 4) - growth(2, 4));
  by_accel[1].push_back(growth(1, 4) - growth(3, 4));
  by_jerk[0].push_back(chain.input(0) - chain.input(2));
  by_jerk[1].push_back(chain.input(1) - chain.input(3));
}

void StageArrays::resize(std::size_t node_count, std::size_t state_size, std::size_t model_places) {
  nodes = node_count;
  for (LaneArray* of_states : {&states, &state_steps}) {
    of_states->resize(nodes * state_size);
  }
  feedback.resize((nodes - 1) * state_size);
  for (Padded* of_intervals :
       {&inputs, &input_steps, &feedforward, &inverse_curvature, &middle_weight}) {
    of_intervals->resize(nodes - 1);
  }
  node_weight.resize(nodes);
  for (LaneArray* of_models : {&node_aim, &middle_aim, &node_pull, &middle_pull}) {
    of_models->resize(nodes * model_places);
  }
}

std::unique_ptr<StageKernel> make_stage_kernel(std::size_t modes, std::size_t models) {
  return has_four_lanes() ? make_four_lanes_stages(modes, models)
                          : make_two_lanes_stages(modes, models);
}

}  // namespace unflex::compensate
