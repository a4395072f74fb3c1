#include "drivers/io/rendezvous.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <stdlib.h>
#include <string>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "runtime_directory.hpp"

namespace probebox::io::rendezvous {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Sets an environment variable, or unsets it, for the length of a test.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_{name} {
    if (const char* before = ::getenv(name)) before_ = before;
    set(value);
  }
  ~Environment() { set(before_ ? before_->c_str() : nullptr); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  void set(const char* value) const { value != nullptr ? ::setenv(name_, value, 1) : ::unsetenv(name_); }

  const char* name_;
  std::optional<std::string> before_;
};

TEST(Rendezvous, ListsWhatARunningProcessAnnounced) {
  const command::RuntimeDirectory directory;
  const auto file = announce(::getpid(), {"tcp:127.0.0.1:7627", "serial:/dev/pts/3"});
  ASSERT_TRUE(file) << file.error().what;
  EXPECT_EQ(file->parent_path(), directory.rendezvous());
  const auto found = listed();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found.front().uris, ElementsAre("tcp:127.0.0.1:7627", "serial:/dev/pts/3"));
  withdraw(::getpid());
  EXPECT_THAT(listed(), IsEmpty());
}

// Anybody may put these there; the pid is that of a process that lives.
TEST(Rendezvous, ReadsNothingThatHasNoEnd) {
  const command::RuntimeDirectory directory;
  std::filesystem::create_directories(directory.rendezvous());
  const auto pipe = directory.rendezvous() / "1.uri";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0644), 0);
  const auto device = directory.rendezvous() / (std::to_string(::getppid()) + ".uri");
  std::filesystem::create_symlink("/dev/zero", device);
  ASSERT_TRUE(announce(::getpid(), {"tcp:127.0.0.1:7627"}));
  std::size_t uris = 0;
  for (const auto& each : listed()) uris += each.uris.size();
  EXPECT_EQ(uris, 1U);
  withdraw(::getpid());
}

TEST(Rendezvous, InvitesAllHoweverPrivateTheDaemonIs) {
  const command::RuntimeDirectory directory;
  const auto before = umask(0077);
  const auto file = announce(::getpid(), {"tcp:127.0.0.1:7627"});
  umask(before);
  ASSERT_TRUE(file) << file.error().what;
  EXPECT_EQ(std::filesystem::status(*file).permissions(), std::filesystem::perms{0644});
}

TEST(Rendezvous, PassesOverWhatAKilledProcessLeftBehind) {
  const command::RuntimeDirectory directory;
  const auto child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);
  ASSERT_TRUE(announce(child, {"tcp:127.0.0.1:1"}));
  EXPECT_THAT(listed(), IsEmpty());
}

TEST(Rendezvous, IsNotConfusedByOtherFiles) {
  const command::RuntimeDirectory directory;
  ASSERT_TRUE(announce(::getpid(), {"tcp:127.0.0.1:7627"}));
  const auto place = directory.rendezvous();
  std::ofstream{place / "notes.txt"} << "tcp:127.0.0.1:2\n";
  std::ofstream{place / "12x.uri"} << "tcp:127.0.0.1:3\n";
  std::ofstream{place / "-1.uri"} << "tcp:127.0.0.1:4\n";
  std::ofstream{place / "1.uri"} << std::string(100'000, 'x');
  const auto all = listed();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].pid, 1);
  EXPECT_THAT(all[0].uris, IsEmpty()) << "an endless line is no URI";
  EXPECT_EQ(all[1].pid, ::getpid());
}

TEST(Rendezvous, IsTheUsersRuntimeDirectoryUnlessAnotherIsChosen) {
  const support::TemporaryFolder runtime;
  const Environment session{"XDG_RUNTIME_DIR", runtime.path().c_str()};
  {
    const Environment usual{"PROBEBOX_RENDEZVOUS", nullptr};
    const auto file = announce(::getpid(), {"tcp:127.0.0.1:7627"});
    ASSERT_TRUE(file) << file.error().what;
    EXPECT_EQ(file->parent_path(), runtime.path() / "probebox");
    EXPECT_FALSE(chosen());
  }
  const command::RuntimeDirectory directory;
  EXPECT_THAT(listed(), IsEmpty()) << "a box elsewhere on this computer is not met";
  withdraw(::getpid());
  EXPECT_TRUE(std::filesystem::exists(runtime.path() / "probebox" / (std::to_string(::getpid()) + ".uri")))
      << "nor is it touched";
}

TEST(Rendezvous, NamesTheChosenFolderThatCannotBeMade) {
  const Environment chosen{"PROBEBOX_RENDEZVOUS", "/proc/no-such-place/rendezvous"};
  const auto failed = announce(::getpid(), {"tcp:127.0.0.1:7627"});
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().what,
              AllOf(HasSubstr("/proc/no-such-place/rendezvous"), HasSubstr("PROBEBOX_RENDEZVOUS")));
}

}  // namespace
}  // namespace probebox::io::rendezvous
