#include "unflex/machine/mode_frame.hpp"

#include <array>

namespace unflex::machine {

Result<dynamics::ModeFrame> frame_of_masses(const Settings& settings) {
  constexpr double kKilogram_g = 1e3;
  const SwingSettings& swing = settings.swing;
  const Motors::Rows rows = settings.motors().rows();
  dynamics::ModeFrame::Masses masses;
  const double tool_g = swing.tool_mass_g.value_or(0.0);
  const std::array<double, 3> axes_g = {tool_g + swing.gantry_mass_g.x,
                                        tool_g + swing.gantry_mass_g.y, tool_g};
  for (std::size_t i = 0; i < axes_g.size(); ++i) {
    masses.mass_kg[i][i] = axes_g[i] / kKilogram_g;
    for (std::size_t j = 0; j < axes_g.size(); ++j) {
      for (std::size_t motor = 0; motor < rows.size(); ++motor) {
        const DriveSettings& drive = swing.drives[motor];
        const double both = rows[motor][i] * rows[motor][j];
        masses.mass_kg[i][j] += both * drive.carriage_mass_g / kKilogram_g;
        masses.stiffness_n_mm[i][j] += both * drive.stiffness_n_mm.value_or(0.0);
        masses.damping_n_s_mm[i][j] += both * drive.damping_n_s_mm;
      }
    }
  }
  return dynamics::ModeFrame::of(masses);
}

std::optional<dynamics::ModeFrame> mode_frame(const Settings& settings) {
  if (!settings.swing.has_masses()) {
    return std::nullopt;
  }
  Result<dynamics::ModeFrame> frame = frame_of_masses(settings);
  return frame ? std::optional(*frame) : std::nullopt;
}

}  // namespace unflex::machine
