#include "batch_shard.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/program.hpp"
#include "new_prints.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;
using Environment = std::map<std::string, std::string>;

Result<Shard> shard(const std::string& text, const Environment& environment = {}) {
  return shard_of(text, [&](const std::string& name) {
    const auto found = environment.find(name);
    return found == environment.end() ? std::nullopt : std::optional(found->second);
  });
}

std::string told(const Result<Shard>& shard) {
  return shard ? fmt::format("{}/{}", shard->number, shard->count) : shard.error().message;
}

TEST(Shards, AreGivenByNumberAndCount) {
  EXPECT_EQ(told(shard("2/8")), "2/8");
  EXPECT_EQ(told(shard("1/1")), "1/1");
  for (const std::string wrong :
       {"0/8", "9/8", "2", "2/", "/8", "-1/8", "2/8/1", "a/b", "2/0", " 2/8"}) {
    EXPECT_THAT(told(shard(wrong)), HasSubstr("is to be I/N")) << wrong;
  }
}

TEST(Shards, AreGivenBySlurm) {
  EXPECT_EQ(told(shard("auto", {{"SLURM_ARRAY_TASK_ID", "7"},
                                {"SLURM_ARRAY_TASK_COUNT", "3"},
                                {"SLURM_ARRAY_TASK_MIN", "5"},
                                {"SLURM_ARRAY_TASK_STEP", "2"},
                                {"SLURM_PROCID", "0"},
                                {"SLURM_NTASKS", "1"}})),
            "2/3");
  EXPECT_EQ(told(shard("auto", {{"SLURM_PROCID", "3"}, {"SLURM_NTASKS", "4"}})), "4/4");
  EXPECT_THAT(told(shard("auto")), HasSubstr("no number is in the environment"));
}

TEST(Shards, AreGivenByKubernetes) {
  EXPECT_EQ(told(shard("auto/5", {{"JOB_COMPLETION_INDEX", "4"}})), "5/5");
  EXPECT_THAT(told(shard("auto", {{"JOB_COMPLETION_INDEX", "4"}})),
              HasSubstr("no number is in the environment"));
  EXPECT_THAT(told(shard("auto/4", {{"JOB_COMPLETION_INDEX", "4"}})), HasSubstr("is to be I/N"));
  EXPECT_THAT(told(shard("auto/x", {{"JOB_COMPLETION_INDEX", "4"}})), HasSubstr("is to be I/N"));
}

TEST(Shards, HaveEachPrintOnceAndMuchTheSameNumber) {
  constexpr unsigned kCount = 4;
  std::map<unsigned, int> prints;
  for (int i = 0; i < 1000; ++i) {
    const std::string name = fmt::format("parts/lid{}.gcode", i);
    int owners = 0;
    for (unsigned number = 1; number <= kCount; ++number) {
      if (has({number, kCount}, name)) {
        ++owners;
        ++prints[number];
      }
    }
    EXPECT_EQ(owners, 1) << name;
  }
  for (const auto& [number, count] : prints) {
    EXPECT_NEAR(count, 250, 60) << number;
  }
}

class FolderOfShards : public ProgramTest {
 protected:
  FolderOfShards() {
    std::filesystem::create_directory(path("in"));
    for (int i = 0; i < 6; ++i) {
      write_file(path(fmt::format("in/{}.gcode", i)), small_print());
    }
  }
  std::vector<std::string> batch(const std::vector<std::string>& options) {
    std::vector<std::string> all = {"batch", "in", "-o", "out", "-q", "--summary", "s.json"};
    all.insert(all.end(), options.begin(), options.end());
    return all;
  }
  // {done, unchanged, failed}
  std::vector<int> totals() {
    const auto json = nlohmann::json::parse(read_file(path("s.json")))["totals"];
    return {json["done"], json["unchanged"], json["failed"]};
  }
};

TEST_F(FolderOfShards, IsDoneOnceByAllOfThem) {
  int done = 0;
  for (const std::string shard : {"1/3", "2/3", "3/3"}) {
    ASSERT_EQ(run(batch({"--shard", shard})).exit_code, 0);
    EXPECT_EQ(nlohmann::json::parse(read_file(path("s.json")))["shard"], shard);
    done += totals()[0];
  }
  EXPECT_EQ(done, 6);
  // A batch of all tells of all, and knows what shards did; so do other shards.
  ASSERT_EQ(run(batch({})).exit_code, 0);
  EXPECT_EQ(totals(), (std::vector{0, 6, 0}));
  ASSERT_EQ(run(batch({"--shard", "1/1"})).exit_code, 0);
  EXPECT_EQ(totals(), (std::vector{0, 6, 0}));
  // What is lost is done again by whoever has it.
  std::filesystem::remove(path("out/3.gcode"));
  ASSERT_EQ(run(batch({"--shard", "1/1"})).exit_code, 0);
  EXPECT_EQ(totals(), (std::vector{1, 5, 0}));
}

TEST_F(FolderOfShards, IsWatchedForWhatComes) {
  std::vector<BatchPrint> prints;
  NewPrints news;
  const auto look = [&] {
    BatchFiles files;
    for (int i = 0; i < 2; ++i) {
      const std::string name = fmt::format("{}.gcode", i);
      files.prints.push_back({.name = name,
                              .input = path("in/" + name).string(),
                              .output = "",
                              .report = {},
                              .printer_file = {},
                              .bytes = 0});
    }
    news.keep_new(files, path("printer.toml"));
    return files.prints.size();
  };
  EXPECT_EQ(look(), 0U);  // may still be written
  EXPECT_EQ(look(), 2U);
  EXPECT_EQ(look(), 0U);
  write_file(path("in/1.gcode"), small_print() + "; more\n");
  EXPECT_EQ(look(), 0U);
  EXPECT_EQ(look(), 1U);
  // What failed by its printer's file is tried again when that is mended.
  write_file(path("printer.toml"), "[printer]\n");
  EXPECT_EQ(look(), 0U);
  EXPECT_EQ(look(), 2U);
  EXPECT_EQ(look(), 0U);
}

TEST_F(FolderOfShards, IsWatchedUntilASignalComes) {
  Program program(directory(),
                  {"batch", "in", "-o", "out", "--watch", "-j", "1", "--engine", "banded", "--set",
                   "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45"});
  const auto comes = [&](const std::string& name) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!std::filesystem::exists(path(name)) && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return std::filesystem::exists(path(name));
  };
  for (int i = 0; i < 6; ++i) {
    EXPECT_TRUE(comes(fmt::format("out/{}.gcode", i)));
  }
  // A print that fails by a printer's file of its own does not hold up the others.
  std::filesystem::create_directory(path("in/bad"));
  write_file(path("in/bad/printer.toml"), "[printer]\nfirmware = \"none\"\n");
  write_file(path("in/bad/bad.gcode"), small_print() + "; longer, so it comes first\n");
  write_file(path("in/late.gcode"), small_print());
  EXPECT_TRUE(comes("out/late.gcode"));
  write_file(path("in/bad/printer.toml"), "");
  EXPECT_TRUE(comes("out/bad/bad.gcode"));
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 128 + SIGINT);
  EXPECT_THAT(outcome.err, HasSubstr("unflex: waiting for prints in in\n"));
  EXPECT_THAT(outcome.err, HasSubstr("late.gcode: "));
  EXPECT_THAT(outcome.err, HasSubstr("in/bad/printer.toml:2: "));
}

}  // namespace
}  // namespace unflex::app
