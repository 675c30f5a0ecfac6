// Checks of motors, and of what changes an axis' frequencies.
#include <fmt/core.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "conflict.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "validate.hpp"

namespace unflex::machine {
namespace {

// Checks that the firmware can plan for the kinematics.
Status check_kinematics(const Draft& draft) {
  const Settings& s = draft.settings;
  const auto refuse = [&](std::string_view why) {
    return conflict(draft, {"kinematics.type", "printer.firmware"},
                    fmt::format("kinematics.type is \"{}\", which {}; print the sliced file as it "
                                "is on this machine",
                                to_string(s.kinematics.type), why));
  };
  switch (s.kinematics.type) {
    case Kinematics::cartesian:
    case Kinematics::corexy:
    case Kinematics::corexz:
      return {};
    case Kinematics::hybrid_corexy:
      return s.spec().printers.hybrid_corexy_refusal.empty()
                 ? Status{}
                 : refuse(s.spec().printers.hybrid_corexy_refusal);
    case Kinematics::hybrid_corexy_inverted:
    case Kinematics::hybrid_corexz:
      if (!s.spec().printers.has_all_kinematics) {
        return refuse("Klipper alone has");
      }
      return {};
    case Kinematics::tripteron:
    case Kinematics::linear:
      return s.spec().printers.takes_a_matrix ? Status{}
                                              : refuse("takes a matrix that this firmware lacks");
  }
  return {};
}

// Checks that a map of frequencies is for an axis with one frequency.
Status check_maps(const Draft& draft) {
  const auto check = [&](std::string_view axis, const AxisDynamics& dynamics) -> Status {
    if (dynamics.map.empty() || dynamics.modes.empty()) {
      return {};
    }
    const std::string map = fmt::format("dynamics.{}.map", axis);
    const std::string mode = fmt::format("dynamics.{}.mode", axis);
    return conflict(draft, {map, mode},
                    fmt::format("{} tells one frequency at each place, and {} several; take one of "
                                "them away",
                                map, mode));
  };
  return each_in_turn(check, kAxisKeys, draft.settings.dynamics);
}

constexpr std::array<std::string_view, Motors::kCount> kJoints = {
    "kinematics.joint_a", "kinematics.joint_b", "kinematics.joint_c"};

// Checks the rows of a linear machine.
Status check_joints(const Draft& draft) {
  const KinematicsSettings& kinematics = draft.settings.kinematics;
  const bool is_linear = kinematics.type == Kinematics::linear;
  const bool takes_rows = is_linear || kinematics.type == Kinematics::tripteron;
  for (std::size_t i = 0; i < kJoints.size(); ++i) {
    if (kinematics.joints[i] && !takes_rows) {
      return conflict(draft, {kJoints[i], "kinematics.type"},
                      fmt::format("{} is given, but kinematics.type is \"{}\", whose motors are "
                                  "known; take one of them away, or make the type \"linear\"",
                                  kJoints[i], to_string(kinematics.type)));
    }
    if (is_linear && !kinematics.joints[i]) {
      return conflict(draft, {"kinematics.type"},
                      fmt::format("kinematics.type is \"linear\", so {} must be given: the travel "
                                  "of a motor per mm of X, of Y and of Z",
                                  kJoints[i]));
    }
  }
  const std::optional<std::string> fault = Motors::fault(draft.settings.motors().rows());
  return fault ? Status(conflict(draft, {kJoints[0], kJoints[1], kJoints[2], "kinematics.type"},
                                 fmt::format("no machine can have these motors: {}", *fault)))
               : Status{};
}

}  // namespace

Status check_machine(const Draft& draft) {
  return check_kinematics(draft).and_then([&] { return check_joints(draft); }).and_then([&] {
    return check_maps(draft);
  });
}

}  // namespace unflex::machine
