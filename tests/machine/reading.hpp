// Settings read from the fixtures in tests/data/printer.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "paths.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {

inline std::string fixture(const std::string& name) {
  return std::string(test_paths::kData) + "/printer/" + name;
}

inline std::map<std::string, SettingRow> by_key(const Settings& settings) {
  std::map<std::string, SettingRow> map;
  for (SettingRow& row : rows(settings)) {
    map[row.key] = row;
  }
  return map;
}

// Value and place, with the place's file by its name alone: "4200 printer.cfg:11".
inline std::string told(const Settings& settings, const std::string& key) {
  const SettingRow row = by_key(settings).at(key);
  return row.value + " " + std::filesystem::path(row.origin).filename().string();
}

// A directory that is deleted after the test.
class PrinterFiles : public ::testing::Test {
 protected:
  PrinterFiles()
      : directory_(std::filesystem::path(::testing::TempDir()) /
                   (std::string("unflex_printer_files_") +
                    ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(directory_);
  }
  ~PrinterFiles() override { std::filesystem::remove_all(directory_); }

  std::string write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = directory_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
    return file.string();
  }

 private:
  std::filesystem::path directory_;
};

}  // namespace unflex::machine
