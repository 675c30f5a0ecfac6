// From a log of a heating to gains.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "app/program.hpp"
#include "paths.hpp"
#include "report/documented_keys.hpp"

namespace unflex::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Simulated, with noise of 0.2 °C: 2 °C per count, lags of 300 and 2.5 s, dead time 5 s, 25 °C
// around it; nothing for 10 s, full power for 100 s, then 90 counts.
std::string heating() { return read_file(std::string(test_paths::kData) + "/hotend_heating.csv"); }

struct Row {
  double time_s = 0.0;
  double temperature_c = 0.0;
  double power = 0.0;
};

std::vector<Row> rows_of(const std::string& table) {
  std::istringstream lines(table);
  std::string line;
  std::getline(lines, line);
  std::vector<Row> rows;
  char comma = 0;
  for (Row row; lines >> row.time_s >> comma >> row.temperature_c >> comma >> row.power;) {
    rows.push_back(row);
  }
  return rows;
}

// The heating as Klipper would have logged it.
std::string klippy_log() {
  std::ostringstream text;
  text << "Start printer\n";
  for (const Row& row : rows_of(heating())) {
    text << "Stats " << 1000.0 + row.time_s
         << ": gcodein=0  extruder: target=200 temp=" << row.temperature_c
         << " pwm=" << row.power / 255.0 << " sysload=0.10\n";
  }
  return text.str();
}

// The heating with a fan that blows at the hotend for a while.
std::string disturbed() {
  std::ostringstream text;
  text << "time,temperature,power\n";
  for (const Row& row : rows_of(heating())) {
    const double lost_c = row.time_s > 300.0 && row.time_s < 600.0 ? 60.0 : 0.0;
    text << row.time_s << ',' << row.temperature_c - lost_c << ',' << row.power << '\n';
  }
  return text.str();
}

class Hotend : public ProgramTest {
 protected:
  Hotend() { write_file(path("log.csv"), heating()); }

  // The last line of stderr, of a command that fails.
  [[nodiscard]] std::string refusal(std::vector<std::string> arguments, int exit_code) const {
    arguments.insert(arguments.begin(), "hotend");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  }
};

TEST_F(Hotend, TellsModelStepAndGains) {
  const Outcome outcome = run({"hotend", "log.csv", "--heater-watts", "40"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out, read_file(std::string(test_paths::kData) + "/hotend_heating.txt"));
}

TEST_F(Hotend, GivesLinesThatAPrinterFileTakes) {
  const Outcome outcome = run({"hotend", "log.csv", "--heater-watts", "40", "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("[hotend]\ngain_c = "));
  write_file(path("p.toml"), outcome.out);
  ASSERT_EQ(run({"hotend", "--printer", "p.toml", "--report", "p.json"}).exit_code, 0);
  ASSERT_EQ(run({"hotend", "log.csv", "--heater-watts", "40", "--report", "l.json"}).exit_code, 0);
  const auto by_printer = nlohmann::json::parse(read_file(path("p.json")));
  const auto by_log = nlohmann::json::parse(read_file(path("l.json")));
  EXPECT_TRUE(by_printer["log"].is_null());
  EXPECT_TRUE(by_printer["model"]["gain_c"]["low"].is_null());
  EXPECT_NEAR(by_printer["rules"][0]["gains"]["p"].get<double>(),
              by_log["rules"][0]["gains"]["p"].get<double>(), 0.01);
  EXPECT_NEAR(by_printer["rules"][0]["worst_under_load_c"].get<double>(),
              by_log["rules"][0]["worst_under_load_c"].get<double>(), 0.01);
}

TEST_F(Hotend, WritesAReportWhoseKeysAreDocumented) {
  ASSERT_EQ(run({"hotend", "log.csv", "--heater-watts", "40", "--report", "r.json"}).exit_code, 0);
  const auto json = nlohmann::json::parse(read_file(path("r.json")));
  const nlohmann::json& dead_time_s = json["model"]["dead_time_s"];
  EXPECT_LE(dead_time_s["low"], 5.0);
  EXPECT_GE(dead_time_s["high"], 5.0);
  EXPECT_NEAR(json["model"]["time_constant_s"]["value"].get<double>(), 300.0, 9.0);
  EXPECT_EQ(json["log"]["curve"]["measured_c"].size(), json["log"]["curve"]["fitted_c"].size());
  EXPECT_EQ(json["rules"].size(), 6U);
  std::set<std::string> keys;
  report::collect_keys(json, "", keys);
  EXPECT_EQ(report::documented_keys(std::string(test_paths::kDocs) + "/hotend.md", "Report"), keys);
}

TEST_F(Hotend, WritesAPageOfItsOwn) {
  write_file(path("<b>&.csv"), heating());
  ASSERT_EQ(run({"hotend", "<b>&.csv", "--heater-watts", "40", "--report", "r.html"}).exit_code, 0);
  const std::string page = read_file(path("r.html"));
  for (const std::string_view part : {"&lt;b&gt;&amp;.csv", "<svg", "Measured and fitted",
                                      "Simulated step", "M301 P", "[hotend]", "<td>zn-pi</td>"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  EXPECT_THAT(page, Not(HasSubstr("<b>&")));
  EXPECT_THAT(page, Not(HasSubstr("http://")));
}

TEST_F(Hotend, TakesWhatKlipperLogs) {
  write_file(path("klippy.log"), klippy_log());
  const Outcome outcome = run({"hotend", "klippy.log", "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("[hotend]\ngain_c = "));
  EXPECT_THAT(refusal({"klippy.log", "--heater", "extruder1"}, 2),
              HasSubstr("has no Stats line with 'extruder1: target='; name the heater"));
}

TEST_F(Hotend, TakesAPowerOfAnyScale) {
  std::ostringstream text;
  text << "time;temperature;power\n";
  for (const Row& row : rows_of(heating())) {
    text << row.time_s << ';' << row.temperature_c << ';' << row.power / 2.55 << '\n';
  }
  write_file(path("percent.csv"), text.str());
  const Outcome percent = run({"hotend", "percent.csv", "--power", "100", "-q"});
  EXPECT_EQ(percent.exit_code, 0) << percent.err;
  EXPECT_EQ(percent.out, run({"hotend", "log.csv", "-q"}).out);
  EXPECT_EQ(refusal({"log.csv", "--power", "100"}, 2),
            "log.csv:9: has a power of 255, which is not within 0 and 100; say what full power is "
            "in this log\n");
}

TEST_F(Hotend, TunesByATest) {
  const Outcome outcome = run({"hotend", "--ku", "35", "--pu", "30", "--rule", "zn"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("> zn          21.00   1.4000    78.75\n"),
                                 HasSubstr("M301 P21.000 I1.4000 D78.750\n")));
  EXPECT_THAT(outcome.out, Not(HasSubstr("M307")));
  EXPECT_THAT(outcome.out, Not(HasSubstr("simc")));
  const Outcome usual = run({"hotend", "--ku", "35", "--pu", "30", "-q"});
  EXPECT_THAT(usual.out, StartsWith("# Klipper: [extruder] of printer.cfg\ncontrol = pid\n"
                                    "pid_kp = 15.909\n"));
}

TEST_F(Hotend, TakesTheRuleThatIsAskedFor) {
  const Outcome outcome = run({"hotend", "log.csv", "--rule", "CC", "--target", "150"});
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("°C by cc: peak 15"), HasSubstr("\n> cc ")));
}

TEST_F(Hotend, HasTheWordsOfABed) {
  std::string log = klippy_log();
  for (std::size_t at = 0; (at = log.find("extruder:", at)) != std::string::npos;) {
    log.replace(at, 9, "heater_bed:");
  }
  write_file(path("klippy.log"), log);
  const Outcome outcome = run({"hotend", "klippy.log", "--heater", "heater_bed", "--target", "60"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("[heater_bed]"), HasSubstr("\nM304 P"),
                                 HasSubstr("\nM307 H0 "), Not(HasSubstr("[hotend]"))));
}

TEST_F(Hotend, WarnsOfAHeaterThatIsTooWeak) {
  const Outcome outcome =
      run({"hotend", "log.csv", "--heater-watts", "20", "--flow", "40", "--target", "250"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err,
            "log.csv: warning: the heater cannot hold 250 °C while 40 mm³/s melt; print slower or "
            "colder\n");
}

TEST_F(Hotend, GivesNoGainsForALogWithoutAModel) {
  write_file(path("fan.csv"), disturbed());
  Outcome outcome = run({"hotend", "fan.csv", "--report", "r.html"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("no model of it is to be trusted"),
                                 HasSubstr("\n  closest fit "), Not(HasSubstr("M301"))));
  EXPECT_THAT(outcome.err, StartsWith("fan.csv: is not this model: "));
  EXPECT_THAT(outcome.err, HasSubstr("stay unexplained; log a heating from the cold"));
  EXPECT_THAT(read_file(path("r.html")), HasSubstr("<strong>Not used:</strong>"));
  outcome = run({"hotend", "fan.csv", "-q"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
}

TEST_F(Hotend, SaysWhatItCannotUse) {
  write_file(path("empty.csv"), "");
  EXPECT_EQ(refusal({"empty.csv"}, 2),
            "empty.csv: has no rows; give a table of time,temperature,power, klippy.log or a "
            "serial log\n");
  EXPECT_THAT(refusal({"."}, 2), StartsWith(".: is a directory"));
  EXPECT_THAT(refusal({"no.csv"}, 2), StartsWith("no.csv: cannot read: "));
  write_file(path("print.gcode"), small_print());
  EXPECT_THAT(refusal({"print.gcode"}, 2), HasSubstr(": names no column 'time'; begin the table"));
  write_file(path("room.csv"), "time,temperature,humidity\n0,21,40\n");
  EXPECT_THAT(refusal({"room.csv"}, 2), StartsWith("room.csv:1: names no column 'power'; "));
  write_file(path("serial.log"),
             "2024-01-01 12:00:00,123 - Recv: T:199.7 /200.0\n"
             "2024-01-01 12:00:02,123 - Recv: T:199.8 /200.0\n");
  EXPECT_THAT(refusal({"serial.log"}, 2),
              StartsWith("serial.log:1: has a temperature but no power '@:', nor has any other "));
  write_file(path("short.csv"), heating().substr(0, 200));
  EXPECT_THAT(refusal({"short.csv"}, 2), StartsWith("short.csv"));
  std::string cut = heating();
  cut.replace(cut.find("\n1.5,"), 5, "\nnan,");
  write_file(path("cut.csv"), cut);
  EXPECT_EQ(refusal({"cut.csv"}, 2), "cut.csv:3: has no number for time; give one in each row\n");
}

TEST_F(Hotend, SaysThatStdoutIsFull) {
  const Outcome outcome = run({"hotend", "log.csv"}, "", fill_stdout);
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_EQ(outcome.err, "stdout: cannot write: No space left on device; make room there\n");
}

TEST_F(Hotend, ReadsFromAPipe) {
  const Outcome outcome = run({"hotend", "-", "-q"}, heating());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, run({"hotend", "log.csv", "-q"}).out);
}

}  // namespace
}  // namespace unflex::app
