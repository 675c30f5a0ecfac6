// A folder of prints through the whole program.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/program.hpp"

namespace unflex::app {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class BatchTest : public ProgramTest {
 protected:
  void add(const std::string& name, const std::string& text = small_print()) const {
    fs::create_directories(path(name).parent_path());
    write_file(path(name), text);
  }

  [[nodiscard]] std::vector<std::string> batch(std::vector<std::string> options = {}) const {
    options.insert(options.begin(), {"batch", "in", "-o", "out", "--engine", "banded"});
    return options;
  }

  [[nodiscard]] nlohmann::json summary() const {
    return nlohmann::json::parse(read_file(path("s.json")));
  }

  // Name and state of each print.
  std::map<std::string, std::string> states(std::vector<std::string> options = {}) {
    options.insert(options.end(), {"--summary", "s.json"});
    last_ = run(batch(std::move(options)));
    std::map<std::string, std::string> all;
    const nlohmann::json told = summary();
    for (const auto& print : told["prints"]) {
      all[print["name"]] = print["state"];
    }
    return all;
  }

  [[nodiscard]] const Outcome& last() const { return last_; }

  // All files below the folder, except those of the batch itself.
  [[nodiscard]] std::vector<std::string> files_in(const std::string& folder) const {
    std::vector<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(path(folder))) {
      if (!entry.is_directory() && entry.path().filename() != ".unflex-batch.json") {
        found.push_back(entry.path().lexically_relative(path(folder)).string());
      }
    }
    std::ranges::sort(found);
    return found;
  }

  // Identifies the file on disk; writing it again gives a new identity.
  [[nodiscard]] ino_t identity(const std::string& name) const {
    struct stat status {};
    EXPECT_EQ(::stat(path(name).c_str(), &status), 0) << name;
    return status.st_ino;
  }

 private:
  Outcome last_;
};

using States = std::map<std::string, std::string>;

TEST_F(BatchTest, MirrorsTheFolderWithTheBytesOfCompensate) {
  add("in/a.gcode");
  add("in/deep/er/b.GCO", squares(3));
  add("in/deep/c.g", squares(1));
  add("in/readme.txt", "not a print");
  add("in/.hidden/d.gcode");
  add("in/._a.gcode", "what another system leaves");
  const Outcome outcome = run(batch({"-j", "3"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(files_in("out"), ElementsAre("a.gcode", "deep/c.g", "deep/er/b.GCO"));
  for (const std::string name : {"a.gcode", "deep/c.g", "deep/er/b.GCO"}) {
    const Outcome alone = run({"compensate", "in/" + name, "-o", "-", "--engine", "banded"});
    EXPECT_EQ(read_file(path("out/" + name)), alone.out) << name;
  }
  EXPECT_THAT(outcome.out, AllOf(StartsWith("print "), HasSubstr("\ndeep/er/b.GCO "),
                                 HasSubstr("\n3 prints: 3 done, 0 unchanged, 0 failed, in ")));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("[1/3] done "), HasSubstr("[3/3] done ")));
}

TEST_F(BatchTest, DoesAgainOnlyWhatChanged) {
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    add(std::string("in/") + name + ".g");
  }
  ASSERT_EQ(run(batch()).exit_code, 0);
  EXPECT_EQ(states(), (States{{"a.g", "unchanged"},
                              {"b.g", "unchanged"},
                              {"c.g", "unchanged"},
                              {"d.g", "unchanged"},
                              {"e.g", "unchanged"}}));
  EXPECT_GT(summary()["prints"][0]["deviation"]["contour_max_mm"]["uncompensated"], 0.01);

  // b: another input with the same size and time. c: a newer input with the same content. d: the
  // output is missing. e: the output was changed.
  const auto time = fs::last_write_time(path("in/b.g"));
  std::string text = small_print();
  text.replace(text.find("Y26"), 3, "Y27");
  write_file(path("in/b.g"), text);
  fs::last_write_time(path("in/b.g"), time);
  fs::last_write_time(path("in/c.g"), time + std::chrono::hours(1));
  fs::remove(path("out/d.g"));
  write_file(path("out/e.g"), read_file(path("out/e.g")) + "G28\n");
  EXPECT_EQ(states(), (States{{"a.g", "unchanged"},
                              {"b.g", "done"},
                              {"c.g", "unchanged"},
                              {"d.g", "done"},
                              {"e.g", "done"}}));
  EXPECT_EQ(states().at("b.g"), "unchanged");
}

TEST_F(BatchTest, DoesAllAgainForOtherSettings) {
  add("in/a.g");
  add("printer.toml",
      "[limits]\nmax_accel_mm_s2 = 3000\n[dynamics]\nx.freq_hz = 45\ny.freq_hz = 45\n"
      "freq_error = 0\n");
  EXPECT_EQ(states({"--printer", "printer.toml"}).at("a.g"), "done");
  // Equal settings from another source.
  EXPECT_EQ(states({"--set", "limits.max_accel_mm_s2=3000"}).at("a.g"), "unchanged");
  EXPECT_EQ(states({"--set", "limits.max_accel_mm_s2=3001"}).at("a.g"), "done");
  EXPECT_EQ(states({"--set", "limits.max_accel_mm_s2=3001", "--report", "pages"}).at("a.g"),
            "done");
  EXPECT_THAT(files_in("pages"), ElementsAre("a.g.html"));
  EXPECT_EQ(states({"--set", "limits.max_accel_mm_s2=3001", "--report", "pages"}).at("a.g"),
            "unchanged");
  write_file(path("pages/a.g.html"), "");
  EXPECT_EQ(states({"--set", "limits.max_accel_mm_s2=3001", "--report", "pages"}).at("a.g"),
            "done");
}

TEST_F(BatchTest, TakesThePrinterFileOfTheFolderOfAPrint) {
  add("top.toml", "[dynamics]\nx.freq_hz = 45\ny.freq_hz = 45\nfreq_error = 0\n");
  add("in/printer.toml", "[dynamics]\nx.freq_hz = 99\n");  // stands back behind --printer
  add("in/big/printer.toml", "[dynamics]\nx.freq_hz = 60\ny.freq_hz = 60\nfreq_error = 0\n");
  add("in/a.gcode");
  add("in/big/parts/b.gcode");
  const Outcome outcome = run(batch({"--printer", "top.toml"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const auto& [name, printer] : {std::pair<std::string, std::string>("a.gcode", "top.toml"),
                                      {"big/parts/b.gcode", "in/big/printer.toml"}}) {
    const Outcome alone =
        run({"compensate", "in/" + name, "-o", "-", "--engine", "banded", "--printer", printer});
    EXPECT_EQ(read_file(path("out/" + name)), alone.out) << name;
  }
  add("in/big/printer.toml", "[dynamics]\nx.freq = 60\n");
  const Outcome wrong = run(batch({"--printer", "top.toml"}));
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("in/big/printer.toml:2: "));
}

TEST_F(BatchTest, DoesAllAgainWhereItsMemoryIsDamaged) {
  add("in/a.g");
  EXPECT_EQ(states().at("a.g"), "done");
  const std::string good = read_file(path("out/.unflex-batch.json"));
  for (const std::string& bad :
       {good.substr(0, good.size() / 2), std::string("[]"), std::string()}) {
    write_file(path("out/.unflex-batch.json"), bad);
    EXPECT_EQ(states().at("a.g"), "done");
    EXPECT_EQ(states().at("a.g"), "unchanged");
  }
}

TEST_F(BatchTest, GoesOnAfterAFailure) {
  add("in/a.g");
  add("in/b.g", "nothing to print\n");
  add("in/c.g");
  ASSERT_EQ(run({"compensate", "in/c.g", "--in-place"}).exit_code, 0);
  EXPECT_EQ(states(), (States{{"a.g", "done"}, {"b.g", "failed"}, {"c.g", "failed"}}));
  EXPECT_EQ(last().exit_code, 2);
  EXPECT_THAT(last().err, AllOf(HasSubstr("in/b.g: there is no G-code command"),
                                HasSubstr("this file was already compensated")));
  EXPECT_THAT(files_in("out"), ElementsAre("a.g"));
  EXPECT_EQ(summary()["exit_code"], 2);
  EXPECT_EQ(summary()["totals"]["failed"], 2);
  EXPECT_THAT(summary()["prints"][1]["error"].get<std::string>(), StartsWith("in/b.g: "));
}

TEST_F(BatchTest, FailsWhereThePathIsLeft) {
  add("in/a.g");
  EXPECT_EQ(states({"--max-deviation", "1"}).at("a.g"), "done");
  EXPECT_EQ(last().exit_code, 0);
  EXPECT_EQ(states({"--max-deviation", "0.9"}).at("a.g"), "unchanged");
  EXPECT_EQ(states({"--max-deviation", "0.00001"}).at("a.g"), "failed");
  EXPECT_EQ(last().exit_code, 3);
  EXPECT_THAT(last().err, HasSubstr("more than --max-deviation"));
  const Outcome xml = run(batch({"--max-deviation", "0.00001", "--summary", "s.xml", "-q"}));
  EXPECT_EQ(xml.exit_code, 3);
  EXPECT_EQ(xml.out, "");
  EXPECT_THAT(read_file(path("s.xml")), HasSubstr("<failure message="));
}

TEST_F(BatchTest, WritesNamesSafely) {
  const std::string hostile = "a&<b>\"\x01\xff\n.g";
  add("in/" + hostile);
  EXPECT_EQ(run(batch({"--summary", "s.xml"})).exit_code, 0);
  EXPECT_THAT(read_file(path("s.xml")),
              HasSubstr("name=\"a&amp;&lt;b&gt;&quot;\uFFFD\uFFFD&#10;.g\""));
  const Outcome again = run(batch());
  EXPECT_THAT(again.out, HasSubstr("0 done, 1 unchanged"));
  EXPECT_THAT(again.err, HasSubstr("a&<b>\"?\xff .g"));
}

TEST_F(BatchTest, KnowsItsOwnFolderWithinTheOther) {
  add("in/a.g");
  EXPECT_EQ(run({"batch", "in", "-o", "in/out", "--report", "in/pages"}).exit_code, 0);
  EXPECT_EQ(run({"batch", "in", "-o", "in/out", "--report", "in/pages"}).exit_code, 0);
  EXPECT_THAT(files_in("in"), ElementsAre("a.g", "out/a.g", "pages/a.g.html"));
}

TEST_F(BatchTest, FollowsLinksToPrintsAndNotToFolders) {
  add("in/a.g");
  fs::create_directory_symlink(path("in"), path("in/loop"));
  fs::create_symlink(path("in/a.g"), path("in/b.g"));
  const Outcome outcome = run(batch());
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("in/loop: warning: is a link to a folder"));
  EXPECT_THAT(files_in("out"), ElementsAre("a.g", "b.g"));
}

TEST_F(BatchTest, WritesItsSummaryIntoTheFolderItMakes) {
  add("in/a.g");
  const Outcome first = run({"batch", "in", "-o", "new/out", "--summary", "new/out/s.json"});
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(files_in("new/out"), ElementsAre("a.g", "s.json"));
}

TEST_F(BatchTest, LeavesNoFolderWhereItRefuses) {
  add("in/a.g");
  for (const char* folder : {"new/deep/out", "new/", "./new"}) {
    const Outcome outcome = run({"batch", "in", "-o", folder, "--summary", "nowhere/s.json"});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.err, StartsWith("nowhere/s.json: the directory nowhere does not exist"));
    EXPECT_FALSE(fs::exists(path("new"))) << folder;
  }
  fs::create_directories(path("new/deep"));
  EXPECT_EQ(run({"batch", "in", "-o", "new/deep", "--summary", "nowhere/s.json"}).exit_code, 1);
  EXPECT_TRUE(fs::exists(path("new/deep"))) << "it was there before";
}

TEST_F(BatchTest, NamesWhatItCannotMake) {
  add("in/a.g");
  add("in/b/c.g");
  add("out/b");
  add("in/p.json",
      "[limits]\nmax_accel_mm_s2 = 3000\n[dynamics]\nx.freq_hz = 45\ny.freq_hz = 45\n");
  EXPECT_EQ(states(), (States{{"a.g", "done"}, {"b/c.g", "failed"}}));
  EXPECT_THAT(last().err, HasSubstr("out/b/c.g: cannot make its folder: Not a directory"));
  EXPECT_EQ(run(batch({"--printer", "in/p.json", "--summary", "in/p.json"})).err,
            "in/p.json: is read or written already; give the summary a name of its own\n");
  EXPECT_THAT(run(batch({"--summary", "out/.unflex-batch.json"})).err,
              HasSubstr("is read or written already; give the summary a name of its own\n"));
}

TEST_F(BatchTest, RefusesToReplaceAPrintByAPage) {
  add("in/a.g");
  const std::string print = read_file(path("in/a.g"));
  fs::create_directories(path("pages"));
  fs::create_symlink("../in/a.g", path("pages/a.g.html"));
  fs::create_symlink("../in/a.g", path("pages/a.html"));
  const Outcome outcome = run(batch({"--report", "pages"}));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("is a print too, by a link; give --report a folder without "
                                     "links\n"));
  EXPECT_EQ(read_file(path("in/a.g")), print);
}

TEST_F(BatchTest, RefusesToReplaceAPageByAnother) {
  add("in/a/x.g");
  add("in/b/x.g");
  fs::create_directories(path("pages/a"));
  fs::create_directory_symlink("a", path("pages/b"));
  const Outcome outcome = run(batch({"--report", "pages"}));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err,
            "pages/b/x.g.html: would come from in/a/x.g and from in/b/x.g; give --report a folder "
            "without links\n");
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(BatchTest, RefusesNamesThatDifferInCapitalsAlone) {
  add("in/sub/Part.gcode");
  add("in/Sub/part.gcode");
  const Outcome outcome = run(batch());
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err,
            "in/sub/Part.gcode: differs from in/Sub/part.gcode in capitals alone, and many folders "
            "and cards hold only one of the two; rename one\n");
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(BatchTest, NamesWhatItCannotRead) {
  add("in/a.g");
  fs::create_symlink("nowhere.g", path("in/b.g"));
  ASSERT_EQ(::mkfifo(path("in/c.g").c_str(), 0600), 0);
  EXPECT_EQ(states(), (States{{"a.g", "done"}, {"b.g", "failed"}}));
  EXPECT_EQ(last().exit_code, 2);
  EXPECT_THAT(last().err, AllOf(HasSubstr("in/b.g: is a link that leads to no file"),
                                HasSubstr("in/c.g: warning: is neither a file nor a folder")));
  if (::geteuid() == 0) {
    GTEST_SKIP() << "root may read every folder";
  }
  add("in/shut/d.g");
  fs::permissions(path("in/shut"), fs::perms::none);
  EXPECT_EQ(states().at("shut"), "failed");
  fs::permissions(path("in/shut"), fs::perms::owner_all);
  EXPECT_THAT(last().err, HasSubstr("in/shut: cannot read the folder: Permission denied"));
}

TEST_F(BatchTest, RefusesWhatWouldDestroy) {
  add("in/a.g");
  add("in/in/a.g");
  add("in/in/in/a.g");
  struct Refused {
    std::vector<std::string> arguments;
    int exit_code;
    std::string message;
  };
  const std::vector<Refused> all = {
      {{"batch", "in", "-o", "in"}, 1, "in: is the folder of the prints too"},
      {{"batch", "in", "-o", "./in/../in"}, 1, "./in/../in: is the folder of the prints too"},
      {{"batch", "in/in", "-o", "in"}, 1, "in/in/a.g: would replace the print in/in/a.g"},
      {{"batch", "nowhere", "-o", "out"}, 2, "nowhere: there is no such folder"},
      {{"batch", "in/a.g", "-o", "out"}, 2, "in/a.g: is not a folder"},
      {{"batch", "in"}, 1, "unflex: --output is required"},
      {{"batch", "in", "-o", "-"}, 1, "unflex: batch works on folders"},
      {{"batch", "in", "-o", "out", "--summary", "s.txt"}, 1, "unflex: --summary s.txt: the name"},
      {{"batch", "in", "-o", "out", "--set", "a.b=1"}, 1, "--set a.b=1: "},
  };
  fs::create_directory(path("empty"));
  for (const Refused& refused : all) {
    const Outcome outcome = run(refused.arguments);
    EXPECT_EQ(outcome.exit_code, refused.exit_code) << outcome.err;
    EXPECT_THAT(outcome.err, StartsWith(refused.message));
  }
  const Outcome empty = run({"batch", "empty", "-o", "out"});
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_EQ(empty.err, "empty: holds no print (*.gcode, *.gco, *.g, *.bgcode, *.gcode.gz)\n");
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(BatchTest, RefusesToReplaceAPrintThroughALink) {
  add("in/a/x.g");
  fs::create_directories(path("out"));
  fs::create_directory_symlink(path("in/a"), path("out/a"));
  const Outcome replace = run(batch());
  EXPECT_EQ(replace.exit_code, 1);
  EXPECT_THAT(replace.err, StartsWith("out/a/x.g: would replace the print in/a/x.g"));
  EXPECT_EQ(read_file(path("in/a/x.g")), small_print());

  add("in/b/x.g");
  add("elsewhere/y.g");
  fs::remove(path("out/a"));
  fs::create_directory_symlink(path("elsewhere"), path("out/a"));
  fs::create_directory_symlink(path("elsewhere"), path("out/b"));
  const Outcome twice = run(batch());
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_THAT(twice.err, StartsWith("out/b/x.g: would come from in/a/x.g and from in/b/x.g"));
}

// Waits until the output exists.
bool wait_for(const fs::path& file) {
  const auto deadline = steady_clock::now() + std::chrono::seconds(30);
  while (!fs::exists(file) && steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return fs::exists(file);
}

// A temporary file shows that the work on a print has begun.
bool wait_for_temporary(const fs::path& folder) {
  const auto deadline = steady_clock::now() + std::chrono::seconds(30);
  while (steady_clock::now() < deadline) {
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
      const std::string name = entry->path().filename().string();
      if (name.starts_with(".unflex-") && name != ".unflex-batch.json") {
        return true;
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

TEST_F(BatchTest, EndsSoonWhenAskedAndLeavesNothingHalfDone) {
  add("in/sub/long.g", squares(4000));
  add("in/sub/long2.g", squares(4000));
  Program program(directory(), batch({"-j", "2"}));
  ASSERT_TRUE(wait_for_temporary(path("out/sub")));
  const auto asked = steady_clock::now();
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  EXPECT_LT(steady_clock::now() - asked, std::chrono::milliseconds(500));
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_EQ(outcome.err,
            "unflex: interrupted; what is finished stays, the same batch again does the rest\n");
  EXPECT_TRUE(files_in("out").empty());
}

TEST_F(BatchTest, KilledAndStartedAgainDoesOnlyWhatIsMissing) {
  // The longest print starts first; the short ones are done meanwhile.
  add("in/long.g", squares(400));
  add("in/short.g", squares(20));
  add("in/shorter.g", squares(10));
  {
    Program program(directory(), batch({"-j", "2"}), "", leave_uncounted);
    // The batch remembers a print before it begins the next one.
    ASSERT_TRUE(wait_for(path("out/shorter.g")));
    program.signal(SIGKILL);
    EXPECT_EQ(program.wait().exit_code, 128 + SIGKILL);
  }
  ASSERT_FALSE(fs::exists(path("out/long.g"))) << "too fast to be killed half-way";
  // A temporary file as a killed print leaves it.
  write_file(path("out/.unflex-AbCdEf.tmp"), "half a print");
  const ino_t kept = identity("out/short.g");
  const States states_now = states();
  EXPECT_EQ(last().exit_code, 0);
  EXPECT_EQ(states_now.at("short.g"), "unchanged");
  EXPECT_EQ(states_now.at("long.g"), "done");
  EXPECT_EQ(identity("out/short.g"), kept);
  EXPECT_THAT(files_in("out"), ElementsAre("long.g", "short.g", "shorter.g"));
  EXPECT_EQ(states().at("long.g"), "unchanged");
}

TEST_F(BatchTest, HasAFolderToItself) {
  add("in/long.g", squares(4000));
  Program first(directory(), batch());
  ASSERT_TRUE(wait_for_temporary(path("out")));
  const Outcome second = run(batch());
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_THAT(second.err, StartsWith("out: another unflex batch works in this folder"));
  first.signal(SIGTERM);
  EXPECT_EQ(first.wait().exit_code, 143);
}

}  // namespace
}  // namespace unflex::app
