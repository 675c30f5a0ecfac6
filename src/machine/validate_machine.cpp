// Checks of motors, and of what changes an axis' frequencies.
#include <fmt/core.h>

#include <algorithm>
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
  if (draft.is_firmware_plain) {
    return {};
  }
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

// Checks that the legs of a tripteron are told as a whole, and of a tripteron alone.
Status check_legs(const Draft& draft) {
  constexpr std::array<std::string_view, 6> kLegs = {
      "kinematics.bars_mm",         "kinematics.rail_y_mm",       "kinematics.rail_z_mm",
      "kinematics.tool_joint_a_mm", "kinematics.tool_joint_b_mm", "kinematics.tool_joint_c_mm"};
  const KinematicsSettings& k = draft.settings.kinematics;
  const std::array<bool, kLegs.size()> given = {
      k.bars_mm.has_value(),          k.rail_y_mm.has_value(),
      k.rail_z_mm.has_value(),        k.tool_joint_mm[0].has_value(),
      k.tool_joint_mm[1].has_value(), k.tool_joint_mm[2].has_value()};
  const auto first_given = std::ranges::find(given, true);
  if (first_given == given.end()) {
    return k.elbow_deg ? Status(conflict(draft, {"kinematics.elbow_deg"},
                                         "kinematics.elbow_deg is of the legs' bars; give "
                                         "kinematics.bars_mm too"))
                       : Status{};
  }
  const std::string_view told = kLegs[static_cast<std::size_t>(first_given - given.begin())];
  if (k.type != Kinematics::tripteron) {
    return conflict(draft, {told, "kinematics.type"},
                    fmt::format("{} is given, but kinematics.type is \"{}\", which has no such "
                                "legs; take one of them away, or make the type \"tripteron\"",
                                told, to_string(k.type)));
  }
  const auto missing = std::ranges::find(given, false);
  if (missing != given.end()) {
    return conflict(draft, {told},
                    fmt::format("{} is given, but {} is not; the reach of the legs takes both",
                                told, kLegs[static_cast<std::size_t>(missing - given.begin())]));
  }
  return {};
}

// Checks the elbows' angles, and that the rails run along X, as the legs' planes need it.
Status check_reach(const Draft& draft) {
  const KinematicsSettings& k = draft.settings.kinematics;
  if (k.elbow_deg && (k.elbow_deg->min < 0.0 || k.elbow_deg->max > 180.0)) {
    return conflict(
        draft, {"kinematics.elbow_deg"},
        fmt::format("kinematics.elbow_deg is [{}, {}], and must be within 0, a straight "
                    "leg, and 180, a folded one",
                    k.elbow_deg->min, k.elbow_deg->max));
  }
  for (std::size_t i = 0; i < kJoints.size(); ++i) {
    if (k.bars_mm && k.joints[i] && (*k.joints[i])[0] == 0.0) {
      return conflict(draft, {kJoints[i]},
                      fmt::format("{} does not move its slider along X with the tool, which a leg "
                                  "in a plane would; correct its first number, or leave out "
                                  "kinematics.bars_mm",
                                  kJoints[i]));
    }
  }
  return {};
}

}  // namespace

Status check_machine(const Draft& draft) {
  return check_kinematics(draft)
      .and_then([&] { return check_joints(draft); })
      .and_then([&] { return check_legs(draft); })
      .and_then([&] { return check_reach(draft); })
      .and_then([&] { return check_maps(draft); });
}

}  // namespace unflex::machine
