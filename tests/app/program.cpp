#include "app/program.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "paths.hpp"

namespace unflex::app {
namespace {

constexpr int kCannotStart = 127;

std::filesystem::path make_directory() {
  // Do not use $TMPDIR, which some tests set for the program.
  std::string name = "/tmp/unflex_test_XXXXXX";
  EXPECT_NE(::mkdtemp(name.data()), nullptr);
  return name;
}

[[noreturn]] void become_program(const std::filesystem::path& directory,
                                 const std::filesystem::path& scratch, std::vector<char*> argv,
                                 const std::function<void()>& prepare) {
  const int in = ::open((scratch / "in").c_str(), O_RDONLY);
  const int out = ::open((scratch / "out").c_str(), O_WRONLY | O_CREAT, 0600);
  const int err = ::open((scratch / "err").c_str(), O_WRONLY | O_CREAT, 0600);
  if (::dup2(in, 0) != 0 || ::dup2(out, 1) != 1 || ::dup2(err, 2) != 2 ||
      ::chdir(directory.c_str()) != 0) {
    ::_exit(kCannotStart);
  }
  if (prepare) {
    prepare();
  }
  ::execv(test_paths::kProgram, argv.data());
  ::_exit(kCannotStart);
}

}  // namespace

std::vector<std::string> with_dynamics(std::vector<std::string> arguments) {
  const bool is_on_print =
      !arguments.empty() && (arguments[0] == "compensate" || arguments[0] == "batch" ||
                             arguments[0] == "verify" || arguments[0] == "inspect");
  if (is_on_print && std::ranges::find(arguments, "--printer") == arguments.end()) {
    // Exact frequencies, which take the least time. A later --set overrides this one.
    arguments.insert(arguments.begin() + 1,
                     {"--set", "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45", "--set",
                      "dynamics.freq_error=0"});
  }
  return arguments;
}

Program::Program(const std::filesystem::path& directory, const std::vector<std::string>& arguments,
                 const std::string& input, const std::function<void()>& prepare, Dynamics dynamics)
    : scratch_(make_directory()) {
  write_file(scratch_ / "in", input);
  std::vector<std::string> words =
      dynamics == Dynamics::given ? with_dynamics(arguments) : arguments;
  words.insert(words.begin(), "unflex");
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  child_ = ::fork();
  if (child_ == 0) {
    become_program(directory, scratch_, argv, prepare);
  }
}

void Program::signal(int number) const { ::kill(child_, number); }

Outcome Program::wait() {
  int status = 0;
  ::waitpid(child_, &status, 0);
  Outcome outcome{.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
                  .out = read_file(scratch_ / "out"),
                  .err = read_file(scratch_ / "err")};
  std::filesystem::remove_all(scratch_);
  return outcome;
}

void leave_uncounted() {
  if (const char* const elsewhere = std::getenv("UNFLEX_UNCOUNTED")) {
    ::setenv("GCOV_PREFIX", elsewhere, 1);
  }
}

void fill_stdout() { ::dup2(::open("/dev/full", O_WRONLY | O_CLOEXEC), STDOUT_FILENO); }

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

ProgramTest::ProgramTest() : directory_(make_directory()) {}

ProgramTest::~ProgramTest() { std::filesystem::remove_all(directory_); }

std::vector<std::string> ProgramTest::names() const {
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
    found.push_back(entry.path().filename().string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string small_print() {
  std::string text =
      "; a small print\n"
      "G28\nG90\nM83\nM104 S200\nG1 Z0.2 F600\nG1 X20 Y20 F6000\n";
  for (const char* z : {"0.2", "0.4"}) {
    text += std::string("G1 Z") + z +
            " F600\n"
            "M106 S128\n"
            "G1 X26 Y20 E0.24 F3000\n"
            "G1 X26 Y26 E0.24\n"
            "M73 P50 R1\n"
            "G1 X20 Y26 E0.24\n"
            "G1 X20 Y20 E0.24\n"
            "G1 E-1 F2400\n"
            "G1 X23 Y23 F9000\n"
            "G1 E1 F2400\n"
            "G1 X20 Y20 F9000\n";
  }
  return text + "M107\nM84\n";
}

std::string squares(int count) {
  std::string text = "G28\nG90\nM83\nG1 X20 Y20 F6000\n";
  for (int i = 0; i < count; ++i) {
    text += "G1 X40 Y20 E0.8 F3000\nG1 X40 Y40 E0.8\nG1 X20 Y40 E0.8\nG1 X20 Y20 E0.8\nG1 E-1\n";
  }
  return text;
}

}  // namespace unflex::app
