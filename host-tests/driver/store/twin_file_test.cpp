#include "firmware/store/twin_file.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "host-tests/support/file_content.hpp"
#include "host-tests/support/in_child.hpp"
#include "scratch.hpp"

namespace {

// A disk whose first copy takes one more write and no flush, then nothing.
bool first_copy_dies = false;
int writes_of_first_copy = 0;
bool last_write_was_first_copy = false;

}  // namespace

// In place of the C library's, for the whole program.
extern "C" ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t at) {
  last_write_was_first_copy = at == 0;
  if (first_copy_dies && at == 0 && ++writes_of_first_copy > 1) {
    errno = EIO;
    return -1;
  }
  return syscall(SYS_pwrite64, descriptor, bytes, size, at);
}

extern "C" int fdatasync(int descriptor) {
  if (first_copy_dies && last_write_was_first_copy) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(syscall(SYS_fdatasync, descriptor));
}

namespace probebox::store {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::size_t kRoom = 3000;
constexpr const char* kIfLost = "the cut may be on";

class TwinFileTest : public testing::Test {
 protected:
  std::string path() const { return (scratch_.directory() / "settings").string(); }
  TwinFile open() const { return TwinFile::open(path(), kRoom, kIfLost); }
  std::string bytes() const { return support::contentOf(path()); }
  void put(const std::string& content) const { std::ofstream{path(), std::ios::binary | std::ios::trunc} << content; }
  std::string filled(const std::string& content) const {
    auto file = open();
    EXPECT_TRUE(file.write(content));
    return bytes();
  }

  Scratch scratch_;
};

// A child may limit itself without harm to the other tests.
TEST_F(TwinFileTest, KeepsWhatWasWrittenLast) {
  {
    auto file = open();
    EXPECT_THAT(file.content(), IsEmpty());
    ASSERT_TRUE(file.write("first"));
    ASSERT_TRUE(file.write(std::string(kRoom, 'x')));
    ASSERT_TRUE(file.write(std::string{"last\0one", 8}));
  }
  const auto file = open();
  EXPECT_EQ(file.content(), std::string("last\0one", 8));
  EXPECT_THAT(file.notice(), IsEmpty());
  EXPECT_FALSE(file.lost());
}

TEST_F(TwinFileTest, RefusesWhatHasNoRoomAndKeepsWhatItHad) {
  auto file = open();
  ASSERT_TRUE(file.write("kept"));
  EXPECT_EQ(file.write(std::string(5000, 'x')).error().reason, Reason::bad_argument);
  EXPECT_EQ(open().content(), "kept");
}

TEST_F(TwinFileTest, OutlivesAnyOneBitThatFallsOver) {
  const auto sound = filled("register 128 is 1");
  std::mt19937 random{20261122};
  for (int trial = 0; trial < 300; ++trial) {
    auto damaged = sound;
    const auto bit = random() % (8 * sound.size());
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    put(damaged);
    EXPECT_EQ(open().content(), "register 128 is 1") << "bit " << bit;
    EXPECT_EQ(open().notice(), "") << "the damaged copy was written anew";
  }
}

// Whatever the disk had of a write when the power went: the text of before or the new one, whole.
TEST_F(TwinFileTest, IsOldOrNewAfterACutInMidWrite) {
  const auto old = filled("old");
  const auto fresh = filled("new");
  ASSERT_EQ(old.size(), fresh.size());
  const auto half = old.size() / 2;
  const auto with = [&](const std::string& first, const std::string& second) {
    return first.substr(0, half) + second.substr(half);
  };
  const std::string torn = fresh.substr(0, 512) + old.substr(512, half - 512) + old.substr(half);
  for (const auto& content : {with(fresh, old), torn}) {
    put(content);
    EXPECT_THAT(open().content(), AnyOf("old", "new"));
  }
  put(with(fresh, old));
  EXPECT_EQ(open().content(), "new") << "the newer of two whole copies";
}

TEST_F(TwinFileTest, PutsAFileAsideThatHoldsNothingWhole) {
  filled("register 128 is 1");
  int number = 0;
  for (const std::string& content : {std::string{}, std::string(8192, '\0'), std::string{"somebody's notes"}}) {
    put(content);
    const auto file = open();
    EXPECT_TRUE(file.lost());
    const auto aside = path() + ".damaged-" + std::to_string(++number);
    EXPECT_THAT(file.notice(), HasSubstr(aside));
    EXPECT_EQ(std::filesystem::file_size(aside), content.size());
    EXPECT_THAT(file.whyNotWritable(), IsEmpty());
    EXPECT_EQ(file.content(), kIfLost);
    EXPECT_FALSE(open().lost()) << "told once";
    EXPECT_EQ(open().content(), kIfLost) << "and believed until another text is written";
  }
}

TEST_F(TwinFileTest, LeavesADamagedFileWhereItIsOnAFullDisk) {
  put("somebody's notes");
  EXPECT_TRUE(support::holdsInChild([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1, 1};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const auto file = open();
    return file.lost() && file.content() == kIfLost && !file.whyNotWritable().empty();
  }));
  EXPECT_EQ(bytes(), "somebody's notes");
  EXPECT_TRUE(open().lost()) << "the next start finds it again";
}

TEST_F(TwinFileTest, TakesANewTextOnAFullDisk) {
  filled("before");
  EXPECT_TRUE(support::holdsInChild([&] {
    auto file = open();
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1, 1};  // whatever lies beyond this must have had its place before
    ::setrlimit(RLIMIT_FSIZE, &limit);
    return !file.write("after") && file.content() == "before";
  })) << "the limit is felt";
  EXPECT_TRUE(support::holdsInChild([&] {
    auto file = open();
    std::signal(SIGXFSZ, SIG_IGN);
    const rlim_t size = std::filesystem::file_size(path());
    const rlimit limit{size, size};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    return file.write(std::string(kRoom, 'x')).ok();
  }));
  EXPECT_EQ(open().content(), std::string(kRoom, 'x'));
}

TEST_F(TwinFileTest, DoesNotComeBackWithATextThatItRefused) {
  filled("the cut is on");
  EXPECT_TRUE(support::holdsInChild([&] {
    auto file = open();
    std::signal(SIGXFSZ, SIG_IGN);
    const rlim_t one_copy = std::filesystem::file_size(path()) / 2;
    const rlimit limit{one_copy, one_copy};  // the first copy takes the new text, the second one does not
    ::setrlimit(RLIMIT_FSIZE, &limit);
    return !file.write("the cut is over") && file.content() == "the cut is on";
  }));
  EXPECT_EQ(open().content(), "the cut is on");
}

TEST_F(TwinFileTest, TakesBackARefusedTextByTheCopyThatStillWrites) {
  filled("the cut is on");
  EXPECT_TRUE(support::holdsInChild([&] {
    auto file = open();
    first_copy_dies = true;
    return !file.write("the cut is over") && file.content() == "the cut is on";
  }));
  EXPECT_EQ(open().content(), "the cut is on");
}

TEST_F(TwinFileTest, IsReadWhereItCannotBeWrittenAndSaysSo) {
  namespace fs = std::filesystem;
  filled("kept");
  fs::permissions(path(), fs::perms{0444});
  fs::permissions(scratch_.directory(), fs::perms{0555});
  EXPECT_TRUE(support::holdsInChild([&] {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) return false;
    auto file = open();
    const auto written = file.write("other");
    const auto absent = TwinFile::open((scratch_.directory() / "absent").string(), kRoom, kIfLost);
    return file.content() == "kept" && !file.lost() && !written && written.error().reason == Reason::unavailable &&
           file.whyNotWritable().find("settings") != std::string::npos && !absent.lost() &&
           !absent.whyNotWritable().empty();
  }));
  fs::permissions(scratch_.directory(), fs::perms{0755});
}

// Each begins without room, and has it later.
TEST_F(TwinFileTest, IsWrittenOnceItCanBe) {
  const auto one_copy = [this] {  // is left of two
    auto content = filled("before");
    content[0] = static_cast<char>(content[0] ^ 1);
    put(content);
  };
  const std::vector<std::pair<std::function<void()>, std::string>> beginnings{
      {[] {}, ""}, {[this] { put("somebody's notes"); }, std::string{kIfLost}}, {one_copy, "before"}};
  for (const auto& [prepare, content] : beginnings) {
    std::filesystem::remove(path());
    prepare();
    EXPECT_TRUE(support::holdsInChild([&] {
      std::signal(SIGXFSZ, SIG_IGN);
      rlimit limit{1, RLIM_INFINITY};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      auto file = open();
      if (file.whyNotWritable().empty() || file.write("early")) return false;
      if (file.content() != content) return false;
      limit.rlim_cur = RLIM_INFINITY;
      ::setrlimit(RLIMIT_FSIZE, &limit);
      return file.write("late").ok() && file.content() == "late" && file.whyNotWritable().empty();
    })) << content;
    EXPECT_EQ(open().content(), "late");
  }
}

// As by a person who tidies up, while the box runs.
TEST_F(TwinFileTest, IsMadeAnewWhereItWasRemovedOrAnotherOneHasItsPlace) {
  auto file = open();
  ASSERT_TRUE(file.write("one"));
  std::filesystem::remove(path());
  ASSERT_TRUE(file.write("two"));
  EXPECT_EQ(open().content(), "two");
  std::ofstream{path() + ".other"} << "somebody's notes";
  std::filesystem::rename(path() + ".other", path());
  ASSERT_TRUE(file.write("three"));
  EXPECT_EQ(open().content(), "three");
  EXPECT_EQ(support::contentOf(path() + ".replaced-1"), "somebody's notes");
  ASSERT_TRUE(file.write("four"));
  EXPECT_EQ(open().content(), "four");
}

TEST_F(TwinFileTest, RefusesATextWhereItsFolderIsGone) {
  namespace fs = std::filesystem;
  const auto folder = scratch_.directory() / "state";
  fs::create_directory(folder);
  auto file = TwinFile::open((folder / "connections").string(), kRoom, kIfLost);
  ASSERT_TRUE(file.write("one"));
  fs::rename(folder, scratch_.directory() / "elsewhere");
  const auto refused = file.write("two");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("was removed"), std::string::npos) << refused.error().what;
  EXPECT_EQ(file.content(), "one");
  fs::create_directory(folder);
  ASSERT_TRUE(file.write("three"));
  EXPECT_EQ(TwinFile::open((folder / "connections").string(), kRoom, kIfLost).content(), "three");
}

TEST_F(TwinFileTest, IsLostWhereAnEarlierStartHadIt) {
  {
    const auto file = TwinFile::open(path(), kRoom, kIfLost, Before::had_it);
    EXPECT_TRUE(file.lost());
    EXPECT_EQ(file.content(), kIfLost);
    EXPECT_NE(file.notice().find("is gone"), std::string::npos);
  }
  const auto next = TwinFile::open(path(), kRoom, kIfLost, Before::had_it);
  EXPECT_FALSE(next.lost());
  EXPECT_EQ(next.content(), kIfLost) << "the cautious text is there now";
}

// Whether it is there cannot be told: what it held is lost to this start, and it stays as it is.
TEST_F(TwinFileTest, TakesAFileThatItCannotLookAtForNoFirstStart) {
  namespace fs = std::filesystem;
  const auto before = filled("the cut is on");
  fs::permissions(scratch_.directory(), fs::perms{0});
  EXPECT_TRUE(support::holdsInChild([&] {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) return false;
    const auto file = open();
    return file.lost() && file.content() == kIfLost && file.notice().find("cannot be read") != std::string::npos &&
           !file.whyNotWritable().empty();
  }));
  fs::permissions(scratch_.directory(), fs::perms{0755});
  EXPECT_EQ(bytes(), before);
}

}  // namespace
}  // namespace probebox::store
