#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <unistd.h>

#include "host-tests/faults/announcements.hpp"
#include "host-tests/faults/disk_image.hpp"
#include "host-tests/faults/store_room.hpp"
#include "host-tests/faults/supervised.hpp"
#include "host-tests/faults/trial.hpp"
#include "host-tests/support/file_content.hpp"
#include "host-tests/support/sanitized.hpp"
#include "host-tests/support/temporary_folder.hpp"

// What a box keeps, with a fault at some of its system calls; bin/faults tries every one.
namespace probebox::faults {
namespace {

using support::contentOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Faults : public testing::TestWithParam<Fault> {
 protected:
  void SetUp() override {
    if (const auto why = whyNoSupervision(); !why.empty()) GTEST_SKIP() << why;
  }
};

class Supervised : public Faults {};

TEST_P(Faults, NothingAcknowledgedIsLostAndNothingIsHalfDone) {
  constexpr std::size_t kEvery = support::kSanitized ? 61 : 37;  // calls; prime, so that it falls on each kind
  std::size_t trials = 0;
  std::uint64_t changes = 0, refused = 0;
  const auto fault = GetParam();
  for (const auto before : {Before::nothing, Before::two_boots}) {
    for (auto call = 1 + static_cast<std::size_t>(fault) * 5;; call += kEvery) {
      const Trial trial{.fault = fault, .before = before, .call = call};
      const auto outcome = perform(trial);
      EXPECT_FALSE(outcome.broken) << describe(trial) << " (" << outcome.at << "): " << *outcome.broken;
      if (!outcome.reached) break;
      trials += outcome.applies ? 1U : 0U;
      changes += outcome.changes;
      refused += outcome.refused;
    }
  }
  EXPECT_GT(trials, 4U);
  EXPECT_GT(changes, 40U);
  const bool refuses = fault == Fault::fail_for_good || fault == Fault::full;
  EXPECT_GE(refused, refuses ? 10U : 0U) << "a disk that fails without a word proves nothing";
}

INSTANTIATE_TEST_SUITE_P(All, Faults,
                         testing::Values(Fault::kill, Fault::cut_lost, Fault::cut_torn, Fault::fail_once,
                                         Fault::fail_for_good, Fault::full, Fault::shorten),
                         [](const auto& chosen) {
                           std::string text{name(chosen.param)};
                           std::erase(text, '-');
                           return text;
                         });

void appendTo(const std::filesystem::path& path, std::string_view text, const Say& say) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const auto written = ::pwrite(file, text.data(), text.size(), 0);
  say(written < 0 ? "error " + std::to_string(errno) : "wrote " + std::to_string(written));
  ::close(file);
}

TEST_F(Supervised, AProcessSeesTheFaultThatItIsGiven) {
  const support::TemporaryFolder folder;
  const auto run = [&](Decision::What what) {
    return supervise(
        folder.path(), [&](const Say& say) { appendTo(folder.path() / "file", "0123456789", say); },
        [&](const Call& call) {
          return call.kind == Call::Kind::write ? Decision{.what = what, .error = ENOSPC} : Decision{};
        });
  };
  EXPECT_THAT(run(Decision::What::fail).said, ElementsAre("error " + std::to_string(ENOSPC)));
  EXPECT_EQ(contentOf(folder.path() / "file"), "");
  EXPECT_TRUE(run(Decision::What::kill).killed);
  EXPECT_EQ(contentOf(folder.path() / "file"), "");
  EXPECT_THAT(run(Decision::What::shorten).said, ElementsAre("wrote 5"));
  EXPECT_EQ(contentOf(folder.path() / "file"), "01234");
}

TEST_F(Supervised, ADiskHasAfterACutWhatWasSyncedAndItsName) {
  const support::TemporaryFolder scratch;
  const auto folder = scratch.path() / "disk";
  std::filesystem::create_directory(folder);
  std::ofstream{folder / "old"} << "before";
  DiskImage image{folder};
  const auto write = [&](const char* name, const char* text) {
    image.note({.kind = Call::Kind::open, .path = folder / name, .creates = true});
    image.note({.kind = Call::Kind::write, .path = folder / name, .offset = 0, .bytes = {text, text + 5}});
  };
  write("old", "after");
  write("synced", "whole");
  image.note({.kind = Call::Kind::sync, .path = folder / "synced"});
  image.cutPower(DiskImage::Unsynced::lost, 1);
  EXPECT_EQ(contentOf(folder / "old"), "before");
  EXPECT_FALSE(std::filesystem::exists(folder / "synced")) << "its name was not synced";
  image.note({.kind = Call::Kind::sync, .path = folder});
  write("late", "later");
  image.cutPower(DiskImage::Unsynced::lost, 1);
  EXPECT_EQ(contentOf(folder / "synced"), "whole");
  EXPECT_EQ(contentOf(folder / "late"), "");
}

TEST_F(Supervised, TheImageOfADiskIsWhatTheFolderHas) {
  const support::TemporaryFolder folder;
  DiskImage image{folder.path()};
  const auto ended = supervise(
      folder.path(), [&](const Say& say) { runStoreRoom(folder.path(), say); },
      [&](const Call& call) {
        image.note(call);
        return Decision{};
      });
  EXPECT_EQ(ended.status, 0);
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator{folder.path()})
    files[entry.path().string()] = contentOf(entry.path());
  EXPECT_GT(files.size(), 4U);
  EXPECT_EQ(image.present(), files);
}

// What a box could get wrong, told to the judge.
TEST(Acknowledged, FindsWhatIsLostAndWhatIsHalf) {
  Acknowledged said;
  for (const auto* line : {"ready", "doing propose 1", "done", "doing accept 1", "done", "doing hold connection",
                           "done", "serving 0.1 0 0", "served 0.1 0 0", "doing propose 2"})
    said.hear(line);
  const auto judged = [&](std::vector<std::string> found, bool power_was_cut = false) {
    found.emplace_back(power_was_cut ? "found applied 0.1 0 0 0.05 0.05 0.05" : "found applied 0.1 0 0 0 0 0");
    if (!power_was_cut) found.emplace_back("found before 0.1 0 0");
    return said.whyBroken(found, {.power_was_cut = power_was_cut}).value_or("kept");
  };
  EXPECT_EQ(judged({"found state 1 active", "found held connection"}), "kept");
  EXPECT_EQ(judged({"found state 1 active", "found state 2 proposed", "found held connection"}, true), "kept");
  EXPECT_THAT(judged({"found state 1 proposed", "found held connection"}), HasSubstr("1 proposed"));
  EXPECT_THAT(judged({"found state 1 active", "found state 2 active", "found held connection"}), HasSubstr("2 active"));
  EXPECT_THAT(judged({"found state 1 active"}), HasSubstr("inhibits"));
  EXPECT_THAT(judged({"found state 1 active", "found held connection", "found notice damaged"}), HasSubstr("damaged"));
  EXPECT_THAT(said.whyBroken({"found state 1 active", "found held connection", "found applied 0.2 0 0 0.05 0.05 0.05"},
                             {.power_was_cut = true})
                  .value_or("kept"),
              HasSubstr("200"));
}

}  // namespace
}  // namespace probebox::faults
