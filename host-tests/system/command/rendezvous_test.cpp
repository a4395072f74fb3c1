#include "drivers/io/rendezvous.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "runtime_directory.hpp"

namespace probebox::io::rendezvous {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Those of the private directory of this test; other boxes may run on this computer.
std::vector<Announcement> listedHere(const command::RuntimeDirectory&, int pid) {
  auto all = listed();
  std::erase_if(all, [pid](const Announcement& a) { return a.pid != pid; });
  return all;
}

TEST(Rendezvous, ListsWhatARunningProcessAnnounced) {
  const command::RuntimeDirectory directory;
  const auto file = announce(::getpid(), {"tcp:127.0.0.1:7627", "serial:/dev/pts/3"});
  ASSERT_TRUE(file) << file.error().what;
  EXPECT_EQ(file->parent_path(), directory.path() / "probebox");
  const auto found = listedHere(directory, ::getpid());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found.front().uris, ElementsAre("tcp:127.0.0.1:7627", "serial:/dev/pts/3"));
  withdraw(::getpid());
  EXPECT_THAT(listedHere(directory, ::getpid()), IsEmpty());
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
  EXPECT_THAT(listedHere(directory, child), IsEmpty());
}

TEST(Rendezvous, IsNotConfusedByOtherFiles) {
  const command::RuntimeDirectory directory;
  ASSERT_TRUE(announce(::getpid(), {"tcp:127.0.0.1:7627"}));
  const auto place = directory.path() / "probebox";
  std::ofstream{place / "notes.txt"} << "tcp:127.0.0.1:2\n";
  std::ofstream{place / "12x.uri"} << "tcp:127.0.0.1:3\n";
  std::ofstream{place / "-1.uri"} << "tcp:127.0.0.1:4\n";
  std::ofstream{place / "1.uri"} << std::string(100'000, 'x');
  EXPECT_EQ(listedHere(directory, ::getpid()).size(), 1U);
  EXPECT_THAT(listedHere(directory, -1), IsEmpty());
  const auto first = listedHere(directory, 1);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_THAT(first.front().uris, IsEmpty()) << "an endless line is no URI";
}

}  // namespace
}  // namespace probebox::io::rendezvous
