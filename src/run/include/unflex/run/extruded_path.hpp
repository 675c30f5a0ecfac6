// The share of the extruded path that is compensated, and the reasons that keep the rest as it was
// sliced.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/firmware.hpp"
#include "unflex/report/report.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::run {

class ExtrudedPath {
 public:
  explicit ExtrudedPath(Firmware firmware) : firmware_(firmware) {}

  // Adds a piece that is kept. Pieces come in the order of the file.
  void keep(const Piece& piece);
  // Adds a run that is compensated.
  void compensate(const Piece& piece);

  [[nodiscard]] const report::ExtrudedPath& path() const { return path_; }
  // In the order of their first lines.
  [[nodiscard]] const std::vector<report::UnknownCommand>& unknown_commands() const {
    return unknown_;
  }

 private:
  void keep_moves(const Piece& piece, const gcode::Event& event);
  void note_command(const gcode::Event& event);

  Firmware firmware_;
  report::ExtrudedPath path_;
  std::vector<report::UnknownCommand> unknown_;
  std::map<std::string, std::size_t> places_;  // in unknown_, by command
  std::optional<std::size_t> lost_by_;  // index in unknown_ of the command that lost the position
};

// Warnings for the user: commands that cost extruded path, and a low compensated share.
[[nodiscard]] std::vector<std::string> remarks(const report::ExtrudedPath& path,
                                               const std::vector<report::UnknownCommand>& unknown,
                                               const std::string& input_name);

}  // namespace unflex::run
