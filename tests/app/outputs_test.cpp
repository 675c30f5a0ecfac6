// Files that appear complete or not at all.

#include "outputs.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <istream>
#include <memory>
#include <sstream>

#include "app/program.hpp"
#include "inputs.hpp"

namespace unflex::app {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Outputs = ProgramTest;

TEST_F(Outputs, AppearOnCommitOnly) {
  Result<Output> output = Output::open(path("new").string());
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->write("text\n"));
  EXPECT_FALSE(std::filesystem::exists(path("new")));
  ASSERT_TRUE(output->commit());
  EXPECT_EQ(read_file(path("new")), "text\n");
  EXPECT_THAT(names(), ElementsAre("new"));
}

TEST_F(Outputs, VanishWithoutCommit) {
  write_file(path("old"), "old\n");
  {
    Result<Output> output = Output::open(path("old").string());
    ASSERT_TRUE(output);
    ASSERT_TRUE(output->write("new\n"));
  }
  EXPECT_EQ(read_file(path("old")), "old\n");
  EXPECT_THAT(names(), ElementsAre("old"));
}

TEST_F(Outputs, AreNotRemovedByForkedChildren) {
  Result<Output> output = Output::open(path("new").string());
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->write("text\n"));
  const pid_t child = ::fork();
  if (child == 0) {
    { const Output taken = std::move(*output); }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(output->commit());
  EXPECT_EQ(read_file(path("new")), "text\n");
}

TEST_F(Outputs, HaveThePermissionsTheUserGivesNewFiles) {
  const mode_t mask = ::umask(027);
  Result<Output> output = Output::open(path("new").string());
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->commit());
  ::umask(mask);
  EXPECT_EQ(std::filesystem::status(path("new")).permissions(), std::filesystem::perms(0640));
}

TEST_F(Outputs, MayHaveNamesAsLongAsNamesCanBe) {
  const std::string name(255, 'n');
  Result<Output> output = Output::open(path(name).string());
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->commit());
  EXPECT_THAT(names(), ElementsAre(name));
}

TEST_F(Outputs, ToAPipeAreCopiedOnCommit) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  Result<Output> output = Output::open(path("pipe").string());
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->write("text\n"));
  const pid_t reader = ::fork();
  if (reader == 0) {
    ::_exit(read_file(path("pipe")) == "text\n" ? 0 : 1);
  }
  EXPECT_TRUE(output->commit());
  int status = 0;
  ::waitpid(reader, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(std::filesystem::is_fifo(path("pipe")));
}

TEST_F(Outputs, LeaveNothingWhereTheyCannotBe) {
  EXPECT_FALSE(Output::open(path("none/new").string()));
  EXPECT_THAT(names(), IsEmpty());
}

// Redirects the program's stream `to` to this file.
std::function<void()> redirected(const std::string& file, int flags, int to) {
  return [=] { ::dup2(::open(file.c_str(), flags | O_CLOEXEC), to); };
}

// When a shell redirects a stream, the program does not learn the file's name.
TEST_F(Outputs, AreNotTheInputByAStreamEither) {
  write_file(path("in.gcode"), small_print());
  const auto expect_refusal = [&](const Outcome& outcome, const std::string& message) {
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.err, message);
    EXPECT_EQ(read_file(path("in.gcode")), small_print());
  };
  const auto appends = redirected(path("in.gcode"), O_WRONLY | O_APPEND, STDOUT_FILENO);
  const auto reads = redirected(path("in.gcode"), O_RDONLY, STDIN_FILENO);
  expect_refusal(run({"compensate", "in.gcode", "-o", "-"}, "", appends),
                 "-: is the input too; to replace it give --in-place\n");
  expect_refusal(run({"compensate", "-", "-o", "in.gcode"}, "", reads),
                 "in.gcode: is the input too; to replace it give --in-place\n");
  expect_refusal(run({"inspect", "in.gcode", "--report", "-"}, "", appends),
                 "-: is read or written already; give the report a name of its own\n");
  expect_refusal(run({"printer", "init", "--from", "-", "-o", "in.gcode"}, "", reads),
                 "in.gcode: is what it is made from too; give it a name of its own\n");
}

TEST_F(Outputs, DoNotReplaceWhatADescriptorWritesTo) {
  write_file(path("in.gcode"), small_print());
  write_file(path("all"), "precious\n");
  const Outcome outcome = run({"compensate", "in.gcode", "-o", "/dev/stdout"}, "",
                              redirected(path("all"), O_WRONLY | O_APPEND, STDOUT_FILENO));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err,
            "/dev/stdout: leads to a file that is open already; give its name, or - for stdout\n");
  EXPECT_EQ(read_file(path("all")), "precious\n");
}

TEST_F(Outputs, DoNotReplaceALinkThatLeadsNowhere) {
  std::filesystem::create_symlink("card/out.gcode", path("out.gcode"));
  const Result<Output> output = Output::open(path("out.gcode").string());
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().message,
            "is a link that leads nowhere; make what it leads to, or remove it");
}

// Otherwise anyone who may write to the folder could block all other users with such a pipe.
TEST_F(Outputs, DoNotWaitForAPipeWithTheNameOfATemporaryFile) {
  ASSERT_EQ(::mkfifo(path(".unflex-ffffff.tmp").c_str(), 0600), 0);
  Result<Output> output = Output::open(path("new").string());
  ASSERT_TRUE(output);
  ASSERT_TRUE(output->commit());
  EXPECT_THAT(names(), ElementsAre(".unflex-ffffff.tmp", "new"));
}

TEST_F(ProgramTest, ReadsAPipeAsASeekableFileWithoutAName) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const pid_t writer = ::fork();
  if (writer == 0) {
    write_file(path("pipe"), small_print());
    ::_exit(0);
  }
  Result<Input> input = Input::open(path("pipe").string());
  ASSERT_TRUE(input);
  const Status seekable = input->make_seekable();
  ::waitpid(writer, nullptr, 0);
  ASSERT_TRUE(seekable) << to_string(seekable.error());
  for (int time = 0; time < 2; ++time) {
    std::ostringstream text;
    text << input->text()->read()->rdbuf();
    EXPECT_EQ(text.str(), small_print());
  }
  EXPECT_EQ(input->name(), path("pipe").string());
}

TEST_F(ProgramTest, SeesAsMuchOfALongHeadInAPipeAsInAFile) {
  std::string text;
  while (text.size() < machine::kMaxHeadBytes + 200'000) {
    text += "; comment without end\n";
  }
  write_file(path("file"), text);
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const pid_t writer = ::fork();
  if (writer == 0) {
    const int pipe = ::open(path("pipe").c_str(), O_WRONLY);
    for (std::size_t at = 0; at < text.size(); at += 60'000) {
      static_cast<void>(
          ::write(pipe, text.data() + at, std::min(text.size() - at, std::size_t{60'000})));
    }
    ::_exit(0);
  }
  Result<Input> file = Input::open(path("file").string());
  Result<Input> pipe = Input::open(path("pipe").string());
  ASSERT_TRUE(file && pipe);
  ASSERT_TRUE(file->make_readable() && pipe->make_readable());
  const Result<machine::PrintText> of_file = file->look();
  const Result<machine::PrintText> of_pipe = pipe->look();
  pipe = fail(ErrorKind::input, "closed, so that the writer ends");
  ::waitpid(writer, nullptr, 0);
  ASSERT_TRUE(of_file && of_pipe);
  EXPECT_TRUE(of_file->head == of_pipe->head)
      << of_file->head.size() << " " << of_pipe->head.size();
  EXPECT_TRUE(of_pipe->head.ends_with("end\n"));
}

}  // namespace
}  // namespace unflex::app
