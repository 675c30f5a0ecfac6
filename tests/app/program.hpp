// Runs the program as a shell would, and gives every test a directory of its own.
#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace unflex::app {

struct Outcome {
  int exit_code = -1;  // 128 + signal if a signal killed it
  std::string out;
  std::string err;
};

// Whether a command on a print that names no printer file is told resonances of 45 Hz, which
// compensate does not guess.
enum class Dynamics { given, as_typed };

// The arguments with resonances of 45 Hz behind the command, if it works on a print and no printer
// file is named.
[[nodiscard]] std::vector<std::string> with_dynamics(std::vector<std::string> arguments);

// A started program whose stdout and stderr go to files.
class Program {
 public:
  // `input` becomes stdin; the program runs in `directory`. prepare: called in the new process just
  // before the program starts, for example to limit its memory.
  Program(const std::filesystem::path& directory, const std::vector<std::string>& arguments,
          const std::string& input = "", const std::function<void()>& prepare = {},
          Dynamics dynamics = Dynamics::given);
  void signal(int number) const;
  [[nodiscard]] pid_t pid() const { return child_; }
  [[nodiscard]] Outcome wait();

 private:
  std::filesystem::path scratch_;
  pid_t child_ = -1;
};

// For `prepare`, if the program may be stopped while it writes. When coverage.sh counts lines, the
// incomplete counts of such a program would spoil those of all others.
void leave_uncounted();

// For `prepare`: makes stdout full.
void fill_stdout();

[[nodiscard]] std::string read_file(const std::filesystem::path& file);
void write_file(const std::filesystem::path& file, const std::string& text);

class ProgramTest : public ::testing::Test {
 protected:
  ProgramTest();
  ~ProgramTest() override;

  [[nodiscard]] std::filesystem::path path(const std::string& name) const {
    return directory_ / name;
  }
  // The names in the test's directory, sorted.
  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] Outcome run(const std::vector<std::string>& arguments,
                            const std::string& input = "",
                            const std::function<void()>& prepare = {}) const {
    return Program(directory_, arguments, input, prepare).wait();
  }
  [[nodiscard]] Outcome run_as_typed(const std::vector<std::string>& arguments) const {
    return Program(directory_, arguments, "", {}, Dynamics::as_typed).wait();
  }
  [[nodiscard]] const std::filesystem::path& directory() const { return directory_; }

 private:
  std::filesystem::path directory_;
};

// A print of two small squares, with everything a slicer does between moves.
[[nodiscard]] std::string small_print();

// A print of `count` larger squares, one run each.
[[nodiscard]] std::string squares(int count);

}  // namespace unflex::app
