#include <array>
#include <fcntl.h>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host-tests/support/temporary_folder.hpp"
#include "in_process.hpp"

// What has no end, or no beginning, is no input: a command would wait for it, or read it, for ever.
namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::vector<std::vector<std::string>> readersOf(const std::string& input, const std::string& output) {
  return {{"verify", input},
          {"export", input, "-o", output},
          {"unpack", input, output},
          {"pack", input, output},
          {"clock", input, output, "--period-ns", "1000000"},
          {"replay", input, "--once"},
          {"report", input, "-o", output},
          {"plan", "delay-known-sphere", "--machine", input},
          {"interference", "--cell", input, "--tool", "1", "--gcode", input},
          {"solve", input},
          {"provision", input},
          {"-u", "file:" + input, "info"},
          {"-u", "file:" + input, "status"},
          {"-u", "file:" + input, "watch"},
          {"-u", "file:" + input, "record", "-o", output}};
}

TEST(PlainInput, IsNoPipeWithANameAndNoDevice) {
  const support::TemporaryFolder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const auto& input : {pipe, std::string{"/dev/zero"}}) {
    for (const auto& words : readersOf(input, folder.file("out"))) {
      SCOPED_TRACE(testing::PrintToString(words));
      const auto done = probebox(words);
      EXPECT_NE(done.status, 0);
      EXPECT_THAT(done.err, HasSubstr(words.front() == "interference" ? "" : input));
      EXPECT_FALSE(std::filesystem::exists(folder.file("out")));
    }
  }
  EXPECT_THAT(probebox({"verify", pipe}).err, HasSubstr(pipe + ": cannot be read (it is a pipe, not a file)"));
  EXPECT_THAT(probebox({"report", "/dev/zero", "-o", folder.file("out")}).err,
              AllOf(HasSubstr("/dev/zero"), HasSubstr("a device")));
}

TEST(PlainInput, IsAPipeThatTheShellHasOpened) {
  const auto packed = probebox({"pack", "-", "-"}, "sample,x_nm\n1,5\n2,6\n3,7\n");
  ASSERT_EQ(packed.status, 0) << packed.err;
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  ASSERT_EQ(::write(ends[1], packed.out.data(), packed.out.size()), static_cast<ssize_t>(packed.out.size()));
  ::close(ends[1]);
  const auto done = probebox({"unpack", "/dev/fd/" + std::to_string(ends[0]), "-"});
  ::close(ends[0]);
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_EQ(done.out, "sample,x_nm\n1,5\n2,6\n3,7\n");
}

}  // namespace
}  // namespace probebox::command
