#include "machine_records.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "inputs.hpp"

namespace unflex::app {
namespace {

namespace fs = std::filesystem;

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

Result<std::vector<fs::path>> files_in(const std::string& folder) {
  std::error_code failed;
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    const std::string ending = entry->path().extension().string();
    if (entry->is_regular_file() && (ending == ".csv" || ending == ".stdata")) {
      files.push_back(entry->path());
    }
  }
  if (failed) {
    return fail(ErrorKind::input, {folder, 0},
                fmt::format("cannot read the folder: {}", failed.message()));
  }
  std::ranges::sort(files);
  return files;
}

Result<std::vector<identify::DataSet>> read_file(const fs::path& file) {
  Result<Input> input = Input::open(file.string());
  if (!input) {
    return tl::unexpected(input.error());
  }
  const Result<std::string> bytes = input->read_all();
  return bytes ? identify::parse_records(*bytes, file.string())
               : Result<std::vector<identify::DataSet>>(tl::unexpected(bytes.error()));
}

}  // namespace

Result<std::vector<MachineRecords>> read_machines(const std::string& folder) {
  const Result<std::vector<fs::path>> files = files_in(folder);
  if (!files) {
    return tl::unexpected(files.error());
  }
  std::map<std::string, MachineRecords> by_name;
  for (const fs::path& file : *files) {
    Result<std::vector<identify::DataSet>> sets = read_file(file);
    if (!sets) {
      return tl::unexpected(sets.error());
    }
    const fs::path below = fs::relative(file.parent_path(), folder);
    const std::string own = machine_in_name(file.filename().string());
    std::string name = below == "." ? own : below.generic_string();
    name += below != "." && !own.empty() ? "/" + own : "";
    MachineRecords& machine = by_name[name];
    machine.name = name.empty() ? fs::path(folder).filename().string() : name;
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
