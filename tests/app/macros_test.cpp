// Klipper's macros that let a pause wait for the end of a compensated run, and the lines that call
// them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "app/program.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kCheckpoint = "UNFLEX_CHECKPOINT";

class Macros : public ProgramTest {
 protected:
  Macros() { write_file(path("in.gcode"), small_print()); }

  std::string written(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"printer", "macros", "-o", "-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  }
};

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + what.size())) {
    ++found;
  }
  return found;
}

// The names in the text that follow the mark.
std::set<std::string> words_after(const std::string& text, const std::string& mark) {
  std::set<std::string> words;
  for (std::size_t at = text.find(mark); at != std::string::npos;
       at = text.find(mark, at + mark.size())) {
    const std::size_t from = at + mark.size();
    const std::size_t end =
        text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_", from);
    words.insert(text.substr(from, end - from));
  }
  return words;
}

// The lines of a macro's section, from its heading to the next one.
std::string section(const std::string& text, const std::string& name) {
  const std::size_t from = text.find("\n[gcode_macro " + name + "]\n");
  EXPECT_NE(from, std::string::npos) << name;
  return text.substr(from, text.find("\n[", from + 1) - from);
}

TEST_F(Macros, AreOnesThatKlipperCanRead) {
  const std::string text = written();
  EXPECT_THAT(text, StartsWith("# Written by unflex "));
  EXPECT_THAT(text, HasSubstr("\n[pause_resume]\n"));
  // The name of each section, without regard to case, is a command, and no name occurs twice.
  EXPECT_EQ(words_after(text, "\n[gcode_macro "),
            (std::set<std::string>{"UNFLEX_CHECKPOINT", "pAUSE", "cANCEL_PRINT", "rESUME",
                                   "UNFLEX_LIMITS", "_UNFLEX_LEAVE", "_UNFLEX_RETURN",
                                   "_UNFLEX_SHAPER"}));
  EXPECT_EQ(count(text, "\n[gcode_macro "), 8U);
  EXPECT_EQ(words_after(text, "rename_existing: "),
            (std::set<std::string>{"UNFLEX_BASE_PAUSE", "UNFLEX_BASE_CANCEL_PRINT",
                                   "UNFLEX_BASE_RESUME"}));
  EXPECT_EQ(count(text, "{% if "), count(text, "{% endif %}"));
  EXPECT_EQ(count(text, "{% for "), count(text, "{% endfor %}"));
  EXPECT_EQ(count(text, "{"), count(text, "}"));
  // Klipper starts a comment at either mark, wherever it stands.
  EXPECT_THAT(text, Not(HasSubstr(";")));
  EXPECT_THAT(text, Not(HasSubstr("@")));
  EXPECT_THAT(text, Not(HasSubstr("~")));
}

TEST_F(Macros, SetOnlyVariablesThatTheCheckpointHas) {
  const std::string text = written();
  const std::set<std::string> set = words_after(text, "VARIABLE=");
  EXPECT_EQ(words_after(text, "MACRO="), std::set<std::string>{kCheckpoint});
  const std::set<std::string> known = words_after(section(text, kCheckpoint), "variable_");
  for (const std::string& name : set) {
    EXPECT_EQ(known.count(name), 1U) << name;
  }
  std::set<std::string> read = words_after(text, " own.");
  read.erase("");  // from the end of a sentence in a comment
  for (const std::string& name : read) {
    EXPECT_EQ(known.count(name), 1U) << name;
  }
}

// Commands that stop the machine or end its look-ahead are in macros of their own, which the
// checkpoint calls only if a pause waits.
TEST_F(Macros, StopNothingAtACheckpoint) {
  const std::string checkpoint = section(written(), kCheckpoint);
  for (const char* stops :
       {"M400", "G4", "SET_INPUT_SHAPER", "SET_VELOCITY_LIMIT", "G1", "_UNFLEX"}) {
    EXPECT_THAT(checkpoint, Not(HasSubstr(stops)));
  }
}

TEST_F(Macros, ParkAtRestWithThePrintersOwnLimits) {
  const std::string text = written();
  for (const char* name : {"pAUSE", "cANCEL_PRINT"}) {
    const std::string macro = section(text, name);
    const std::size_t leaves = macro.find("_UNFLEX_LEAVE\n");
    ASSERT_NE(leaves, std::string::npos);
    EXPECT_LT(leaves, macro.find("UNFLEX_BASE_", leaves));
  }
  const std::string leave = section(text, "_UNFLEX_LEAVE");
  const std::size_t rests = leave.find("M400\n");
  ASSERT_NE(rests, std::string::npos);
  EXPECT_LT(rests, leave.find("ACCEL={back.max_accel}"));
  EXPECT_LT(leave.find("ACCEL={back.max_accel}"), leave.find("_UNFLEX_SHAPER\n"));
  const std::string resume = section(text, "rESUME");
  EXPECT_LT(resume.find("UNFLEX_BASE_RESUME {rawparams}"), resume.find("_UNFLEX_RETURN"));
}

TEST_F(Macros, GoToAFileAndSayWhatToDoWithIt) {
  const Outcome outcome = run({"printer", "macros", "-o", "macros.cfg"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out,
            "macros.cfg: include it at the end of printer.cfg, and set emit.checkpoints = true\n");
  EXPECT_EQ(read_file(path("macros.cfg")), written());
  EXPECT_EQ(run({"printer", "macros", "-o", "macros.cfg", "-q"}).out, "");
}

TEST_F(Macros, AreRefusedWhereNoMacroCanDeferAPause) {
  for (const char* firmware : {"marlin", "rrf"}) {
    const Outcome outcome = run({"printer", "macros", "-o", "macros.cfg", "--set",
                                 std::string("printer.firmware=") + firmware});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("docs/pausing.md says where to pause"));
    EXPECT_FALSE(std::filesystem::exists(path("macros.cfg")));
  }
}

TEST_F(Macros, AreCalledByLinesThatChangeNothingElse) {
  const std::vector<std::string> shaped = {"--set", "printer.input_shaper_freq_x_hz=45", "--set",
                                           "printer.input_shaper_freq_y_hz=40"};
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), shaped.begin(), shaped.end());
    return arguments;
  };
  ASSERT_EQ(
      run(with({"compensate", "in.gcode", "-o", "plain.gcode", "--report", "p.json"})).exit_code,
      0);
  ASSERT_EQ(run(with({"compensate", "in.gcode", "-o", "out.gcode", "--report", "c.json", "--set",
                      "emit.checkpoints=true"}))
                .exit_code,
            0);
  std::istringstream lines(read_file(path("out.gcode")));
  std::string stripped;
  std::size_t runs = 0;
  std::size_t begun = 0;
  std::size_t reached = 0;
  for (std::string line; std::getline(lines, line);) {
    runs += line == ";unflex run" ? 1 : 0;
    begun += line == kCheckpoint + " RUN=1 SHAPER_FREQ_X=45 SHAPER_FREQ_Y=40" ? 1 : 0;
    reached += line == kCheckpoint + " SHAPER_FREQ_X=45 SHAPER_FREQ_Y=40" ? 1 : 0;
    stripped += line.starts_with(kCheckpoint) ? "" : line + "\n";
  }
  EXPECT_GT(runs, 0U);
  EXPECT_EQ(begun, runs);
  EXPECT_EQ(reached, runs);
  EXPECT_EQ(stripped, read_file(path("plain.gcode")));

  // verify knows these lines even without the key.
  const Outcome verified =
      run(with({"verify", "out.gcode", "--against", "in.gcode", "--report", "v.json"}));
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_EQ(verified.err, "");
  const auto p = nlohmann::json::parse(read_file(path("p.json")));
  for (const char* name : {"c.json", "v.json"}) {
    const auto report = nlohmann::json::parse(read_file(path(name)));
    EXPECT_EQ(report["deviation"], p["deviation"]);
    EXPECT_EQ(report["print_time_s"], p["print_time_s"]);
  }
}

}  // namespace
}  // namespace unflex::app
