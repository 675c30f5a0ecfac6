// RepRapFirmware 3.6 and 3.5, src/GCodes, Movement/Kinematics/Kinematics.h (KinematicsType); 3.4
// for M667, which 3.5 does not know any more.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "command_reader.hpp"
#include "rrf_config.hpp"
#include "rrf_heaters.hpp"
#include "rrf_steps.hpp"
#include "rrf_travel.hpp"
#include "text_lines.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/rrf_meta.hpp"

namespace unflex::machine {
namespace {

// "E400:400" names several drives of which the first one counts here.
std::string firsts_of_lists(std::string_view line) {
  std::string text;
  bool skips = false;
  for (const char c : line) {
    skips = c == ':' || (skips && c != ' ' && c != '\t' && c != ';');
    if (!skips) {
      text.push_back(c);
    }
  }
  return text;
}

// Collects the settings of config.g, line by line.
class RrfConfigReader {
 public:
  explicit RrfConfigReader(const std::string& file) : reader_(Firmware::rrf, file) {}

  Status take(std::string_view line, std::size_t number);
  // All that has been read, with the settings that follow from it.
  Reading finish();

  // Heeds a line that may or may not be carried out: it may set the shaper.
  void doubt(std::string_view line) {
    const gcode::Command command = gcode::parse(line);
    may_set_shaper_ = may_set_shaper_ || command.is('M', 593) || command.is('M', 98);
  }
  void note(const SourcePlace& place, std::string message, std::vector<std::string> keys) {
    reader_.reading.note(place, std::move(message), std::move(keys));
  }
  [[nodiscard]] const std::string& file() const { return reader_.file(); }

 private:
  Status kinematics(const gcode::Command& command, std::string_view arguments,
                    const SourcePlace& place);
  Status machine_of(int number, bool is_old, const SourcePlace& place);
  Status matrix(const std::map<char, std::vector<std::string_view>>& values,
                const SourcePlace& place);
  void add_kinematics();
  void shaper(const SourcePlace& place);

  CommandReader reader_;
  RrfTravel travel_;
  RrfHeaters heaters_;
  RrfSteps steps_;
  bool may_set_shaper_ = false;  // there is an M593, or a file that may have one
  Motors::Rows joints_ = Motors().rows();
  std::optional<SourcePlace> kinematics_at_;  // of the last line that changed the motors
};

Status refuse(const SourcePlace& place, std::string message) {
  return fail(ErrorKind::usage, place, std::move(message));
}

Status RrfConfigReader::take(std::string_view line, std::size_t number) {
  const gcode::Command original = gcode::parse(line);
  const SourcePlace place{file(), number};
  if (original.kind == gcode::CommandKind::none) {
    return {};
  }
  const std::string text = firsts_of_lists(line);
  const gcode::Command command = gcode::parse(text);
  if (command.kind != gcode::CommandKind::traditional || command.letter != 'M') {
    return {};
  }
  const bool is_setting = is_one_of(command.number, {92, 200, 201, 203, 204, 205, 207, 566, 593});
  const bool is_taken = !is_setting || reader_.take(text, command, place);
  heaters_.read(command, place);
  may_set_shaper_ = may_set_shaper_ || command.number == 593 || command.number == 98;
  switch (command.number) {
    case 82:
    case 83:
      // GCodes.cpp, CopyStateFrom after config.g: a print begins in that mode.
      reader_.reading.add("printer.relative_extrusion", command.number == 83, place);
      break;
    case 92:
      if (is_taken) {
        steps_.set(command, place, reader_.reading);
      }
      break;
    case 98:
      reader_.reading.note(place, "M98 runs another file, which unflex does not read");
      break;
    case 208:
      travel_.read(original.arguments, place, reader_.reading);
      break;
    case 350:
      steps_.set_microsteps(command, place, reader_.reading);
      break;
    case 572:
      if (command.value('S') && command.value('D').value_or(0.0) == 0.0) {
        reader_.reading.add("extruder.pressure_advance_s", std::max(0.0, *command.value('S')),
                            place);
      }
      break;
    case 593:
      if (is_taken) {
        shaper(place);
      }
      break;
    case 665:
      return refuse(place, fmt::format("M665 makes this machine a delta, which {}", kNotSupported));
    case 667:
    case 669:
      return kinematics(command, original.arguments, place);
    default:
      break;
  }
  return {};
}

Reading RrfConfigReader::finish() {
  if (!may_set_shaper_) {
    reader_.reading.add("printer.input_shaper_freq_x_hz", 0.0, {file(), 0});
  }
  add_kinematics();
  travel_.add_to(reader_.reading);
  heaters_.add_to(reader_.reading);
  reader_.finish();
  return std::move(reader_.reading);
}

Status RrfConfigReader::kinematics(const gcode::Command& command, std::string_view arguments,
                                   const SourcePlace& place) {
  const std::map<char, std::vector<std::string_view>> values = values_of(arguments);
  const bool is_old = command.number == 667;
  const bool has_matrix = values.contains('X') || values.contains('Y') || values.contains('Z');
  if (is_old && has_matrix) {
    return refuse(place,
                  "M667 gives a matrix of its own, which unflex does not read; give the printer "
                  "M669, which RepRapFirmware has had since 2.03, or kinematics.type and "
                  "kinematics.joint_a to joint_c in a printer file of unflex");
  }
  const char letter = is_old ? 'S' : 'K';
  if (values.contains(letter)) {
    const std::optional<double> value = parse_number(values.at(letter).front());
    if (!value) {
      note(place,
           fmt::format("no number behind {}: this line is not taken, since unflex does not "
                       "evaluate expressions; give kinematics.type with --set",
                       letter),
           {"kinematics.type"});
      return {};
    }
    if (const Status known = machine_of(to_int(*value), is_old, place); !known) {
      return known;
    }
  }
  return is_old ? Status{} : matrix(values, place);
}

// Makes the machine one of those that the firmware has a number for.
Status RrfConfigReader::machine_of(int number, bool is_old, const SourcePlace& place) {
  struct Type {
    int number;
    Kinematics kinematics;
  };
  // KinematicsType of M669. M667 S has the first three alone.
  constexpr std::array kTypes = {Type{0, Kinematics::cartesian}, Type{1, Kinematics::corexy},
                                 Type{2, Kinematics::corexz}, Type{11, Kinematics::hybrid_corexy}};
  constexpr int kLastOfOld = 2;
  const auto type = std::ranges::find(kTypes, number, &Type::number);
  if (type == kTypes.end() || (is_old && number > kLastOfOld)) {
    return refuse(place, fmt::format("kinematics {}{} is a machine that {}", is_old ? 'S' : 'K',
                                     number, kNotSupported));
  }
  joints_ = Motors(type->kinematics, Firmware::rrf).rows();
  kinematics_at_ = place;
  return {};
}

// Takes a matrix of its own: behind each axis' letter the travel of each motor for it. Motors that
// are not named there do nothing for that axis (CoreKinematics::Configure).
Status RrfConfigReader::matrix(const std::map<char, std::vector<std::string_view>>& values,
                               const SourcePlace& place) {
  constexpr std::array kAxes = {'X', 'Y', 'Z'};
  Motors::Rows rows = joints_;
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const auto given = values.find(kAxes[axis]);
    if (given == values.end()) {
      continue;
    }
    for (std::size_t motor = 0; motor < rows.size(); ++motor) {
      rows[motor][axis] = 0.0;
    }
    for (std::size_t motor = 0; motor < given->second.size(); ++motor) {
      const std::optional<double> factor = parse_number(given->second[motor]);
      if (!factor || (motor >= rows.size() && *factor != 0.0)) {
        return refuse(place,
                      fmt::format("M669 {} gives motor {} the factor '{}', which {}", kAxes[axis],
                                  motor, given->second[motor],
                                  factor ? "is more motors than unflex knows" : "is no number"));
      }
      if (motor < rows.size()) {
        rows[motor][axis] = *factor;
      }
    }
  }
  if (rows != joints_) {
    joints_ = rows;
    kinematics_at_ = place;
  }
  return {};
}

void RrfConfigReader::add_kinematics() {
  if (!kinematics_at_) {
    return;
  }
  const auto known = std::ranges::find_if(all_kinematics(), [&](Kinematics kinematics) {
    return kinematics != Kinematics::linear && Motors(kinematics, Firmware::rrf).rows() == joints_;
  });
  const bool is_known = known != all_kinematics().end();
  reader_.reading.add("kinematics.type",
                      std::string(to_string(is_known ? *known : Kinematics::linear)),
                      *kinematics_at_);
  for (std::size_t motor = 0; !is_known && motor < joints_.size(); ++motor) {
    reader_.reading.add(fmt::format("kinematics.joint_{}", "abc"[motor]),
                        std::vector<Value>(joints_[motor].begin(), joints_[motor].end()),
                        *kinematics_at_);
  }
}

void RrfConfigReader::shaper(const SourcePlace& place) {
  const gcode::ModalState& state = reader_.state();
  constexpr double kDefaultDampingRatio = 0.1;  // AxisShaper.h
  if (state.shaper.settings.type.x == "custom") {
    return reader_.reading.note(
        place,
        "a custom shaper cannot be set back after the print; unflex leaves it to "
        "the file's own M593");
  }
  for (const std::string axis : {"x", "y"}) {
    reader_.shaper(axis, state.shaper.freq_hz.x,
                   state.shaper.settings.damping_ratio.x.value_or(kDefaultDampingRatio), place);
  }
  if (state.shaper.freq_hz.x > 0.0) {
    reader_.reading.add("printer.input_shaper_type", state.shaper.settings.type.x, place);
  }
}

// Leaves out what stands in branches (if, elif, else, while), since unflex does not evaluate their
// conditions. Tells at the end of each chain of branches which keys they would have set.
//
// RepRapFirmware: GCodeBuffer/StringParser.cpp, ProcessConditionalGCode: a branch is what is
// indented deeper than the word that begins it.
class Branches {
 public:
  // Whether the line is part of a branch, or begins one.
  bool take(std::string_view line, std::size_t number, RrfConfigReader& reader) {
    const gcode::MetaCommand meta = gcode::meta_command(line);
    if (gcode::parse(line).kind == gcode::CommandKind::none && meta == gcode::MetaCommand::none) {
      return false;  // a comment, which ends nothing
    }
    const std::size_t indent = gcode::indentation(line);
    if (indent_ && indent > *indent_) {
      if (meta == gcode::MetaCommand::none) {
        reader.doubt(line);
        // A line that is refused elsewhere tells of a machine that unflex does not know.
        if (!inside_->take(line, number)) {
          keys_.insert("kinematics.type");
        }
      }
      return true;
    }
    const bool begins = meta == gcode::MetaCommand::block;
    const bool goes_on =
        indent_ && indent == *indent_ && begins && !trimmed(line).starts_with("if");
    if (!goes_on) {
      end(reader);
    }
    if (begins) {
      if (!goes_on) {
        place_ = {reader.file(), number};
      }
      indent_ = indent;
      collect();
      inside_ = reader;
    }
    return begins;
  }

  // No more of the branches follows.
  void end(RrfConfigReader& reader) {
    collect();
    if (!keys_.empty()) {
      const std::vector<std::string> keys(keys_.begin(), keys_.end());
      reader.note(place_,
                  fmt::format("unflex does not evaluate conditions and takes nothing from the "
                              "branches that begin here; give {} with --set",
                              fmt::join(keys, ", ")),
                  keys);
    }
    keys_.clear();
    indent_.reset();
  }

 private:
  // Gathers the keys that the lines of the branch have set.
  void collect() {
    if (!inside_) {
      return;
    }
    const Reading read = inside_->finish();
    for (const Assignment& assignment : read.assignments) {
      if (assignment.place.line > place_.line) {
        keys_.insert(assignment.key);
      }
    }
    for (const Note& note : read.notes) {
      if (note.diagnostic.place.line > place_.line) {
        keys_.insert(note.keys.begin(), note.keys.end());
      }
    }
    inside_.reset();
  }

  std::optional<std::size_t> indent_;
  SourcePlace place_;
  std::optional<RrfConfigReader> inside_;
  std::set<std::string> keys_;
};

}  // namespace

Result<Reading> read_rrf_config(std::string_view text, const std::string& file) {
  RrfConfigReader reader(file);
  Branches branches;
  Status status;
  for_each_line(text, 1, [&](std::string_view line, std::size_t number) {
    if (status && !branches.take(line, number, reader)) {
      status = reader.take(line, number);
    }
  });
  if (!status) {
    return tl::unexpected(status.error());
  }
  branches.end(reader);
  return reader.finish();
}

}  // namespace unflex::machine
