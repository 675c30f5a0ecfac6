#include "machine_records.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "inputs.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"

namespace unflex::app {
namespace {

// The part of a file's name that tells the machine; empty if none does.
std::string machine_in_name(const std::string& name) {
  for (const std::string_view mark :
       {"resonances", "calibration_data", "raw_data", "inputshaper"}) {
    const std::size_t at = name.find(mark);
    if (at != std::string::npos && at > 0) {
      return name.substr(0, at - 1);
    }
  }
  return {};
}

struct RecordFile {
  std::string name;
  std::string below;  // the folder it is in, below the folder of all records
};

// Adds the files of a folder and those below it. Returns 0 or the errno.
int add_files(const std::string& folder, const std::string& below, std::vector<RecordFile>& files) {
  const auto entries = platform::entries_of(folder);
  if (!entries) {
    return entries.error();
  }
  for (const platform::FolderEntry& entry : *entries) {
    const std::string name = platform::joined(folder, entry.name);
    const std::string ending = platform::ending_of(name);
    if (entry.kind == platform::FileKind::folder && !entry.is_link) {
      if (const int error = add_files(name, platform::joined(below, entry.name), files)) {
        return error;
      }
    } else if (entry.kind == platform::FileKind::file &&
               (ending == ".csv" || ending == ".stdata")) {
      files.push_back({name, below});
    }
  }
  return 0;
}

Result<std::vector<identify::DataSet>> read_file(const std::string& file) {
  Result<Input> input = Input::open(file);
  if (!input) {
    return tl::unexpected(input.error());
  }
  const Result<std::string> bytes = input->read_all();
  return bytes ? identify::parse_records(*bytes, file)
               : Result<std::vector<identify::DataSet>>(tl::unexpected(bytes.error()));
}

}  // namespace

Result<std::vector<MachineRecords>> read_machines(const std::string& folder) {
  std::vector<RecordFile> files;
  if (const int error = add_files(folder, "", files); error != 0) {
    return fail(ErrorKind::input, {folder, 0},
                fmt::format("cannot read the folder: {}", errno_text(error)));
  }
  std::ranges::sort(files, {}, &RecordFile::name);
  std::map<std::string, MachineRecords> by_name;
  for (const RecordFile& file : files) {
    Result<std::vector<identify::DataSet>> sets = read_file(file.name);
    if (!sets) {
      return tl::unexpected(sets.error());
    }
    const std::string own = machine_in_name(platform::last_part(file.name));
    const std::string name = file.below.empty() ? own
                             : own.empty()      ? file.below
                                                : file.below + "/" + own;
    MachineRecords& machine = by_name[name];
    machine.name = name.empty() ? platform::last_part(folder) : name;
    for (identify::DataSet& set : *sets) {
      if (set.axis) {
        machine.axes[*set.axis == identify::Axis::x ? 0 : 1].push_back(std::move(set));
      }
    }
  }
  std::vector<MachineRecords> machines;
  for (auto& [name, machine] : by_name) {
    if (!machine.axes[0].empty() && !machine.axes[1].empty()) {
      machines.push_back(std::move(machine));
    }
  }
  if (machines.empty()) {
    return fail(
        ErrorKind::input, {folder, 0},
        "holds no machine with records of both axes; put each machine's into a folder of "
        "its own, with names as Klipper gives them: resonances_x_*.csv, resonances_y_*.csv");
  }
  return machines;
}

}  // namespace unflex::app
