// The modes of a machine that is masses on the drives of its motors.
#pragma once

#include <optional>

#include "unflex/dynamics/mode_frame.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {

// The modes of masses on drives:
//
//   M = diag(m_x, m_y, m_z) + Gᵀ diag(m_i) G     K = Gᵀ diag(k_i) G     C = Gᵀ diag(c_i) G
//
//   m_x   tool, and what moves with it along X alone     G    rows of the motors
//   m_i, k_i, c_i   carriage, stiffness and damping of a motor's drive
//
// An error of kind input if something that swings has no mass or no stiffness, or does not swing.
[[nodiscard]] Result<dynamics::ModeFrame> frame_of_masses(const Settings& settings);

// Those of the settings; nullopt where each axis swings by itself.
[[nodiscard]] std::optional<dynamics::ModeFrame> mode_frame(const Settings& settings);

}  // namespace unflex::machine
