#include <cerrno>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <string>
#include <vector>

#include "firmware/store/store.hpp"
#include "firmware/store/twin_file.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/faults/faulty_disk.hpp"
#include "host-tests/support/file_content.hpp"
#include "host-tests/support/sanitized.hpp"
#include "host-tests/support/temporary_folder.hpp"

// What is damaged on the disk, and a start that mends it with a fault at its system calls.
namespace probebox::faults {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::size_t kSubjects = 3;

// A store is mended in hundreds of calls, and each fault falls on some of them, beginning elsewhere than the others.
constexpr std::size_t kEvery = support::kSanitized ? 23 : 3;

store::Binding repairedBinding(std::size_t subject) {
  return {"subject-" + std::to_string(subject), "P-1", "mill", "spindle"};
}

// Bytes of a store with results in force, of which one index is garbage and every row whole.
std::string storeWithADamagedIndex() {
  const support::TemporaryFolder folder{support::inMemory()};
  const auto file = folder.file("results.db");
  {
    auto store = store::Store::open(file).value();
    metrology::Result result;
    result.method = "delay-multi-speed";
    result.estimates = {metrology::Estimate::scalar("tau_s", 1e-3, 4e-6)};
    for (std::size_t k = 0; k < kSubjects; ++k) {
      const auto id = store.propose(repairedBinding(k), result, std::string(3000, 'x'), "t0").value();
      EXPECT_TRUE(decided::accept(store, id, "Ada", "t1"));
    }
  }
  sqlite3* handle = nullptr;
  sqlite3_open(file.c_str(), &handle);
  std::size_t page = 0;
  const auto keep = [](void* to, int, char** values, char**) {
    *static_cast<std::size_t*>(to) = std::stoul(values[0]);
    return 0;
  };
  sqlite3_exec(handle, "SELECT rootpage FROM sqlite_master WHERE name = 'one_active_result'", keep, &page, nullptr);
  sqlite3_close(handle);
  auto bytes = support::contentOf(file);
  EXPECT_GT(page, 1U);
  bytes.replace((page - 1) * 4096, 4096, std::string(4096, '\x5a'));
  return bytes;
}

std::size_t inForceIn(store::Store& store) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < kSubjects; ++k) {
    const auto active = decided::active(store, repairedBinding(k));
    count += active && *active ? 1U : 0U;
  }
  return count;
}

struct Case {
  Fault fault;
  bool has_links{true};  // the file system knows hard links
};

std::string nameOf(const Case& chosen) {
  std::string text{name(chosen.fault)};
  std::erase(text, '-');
  return text + (chosen.has_links ? "" : "WithoutLinks");
}

void PrintTo(const Case& chosen, std::ostream* out) {
  *out << nameOf(chosen);
}

class Repair : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    if (const auto why = whyNoSupervision(); !why.empty()) GTEST_SKIP() << why;
  }

  // Runs in a folder that has the file with these bytes; then looks, with what the process said.
  template <class Run, class Look>
  void atEveryNthCall(std::size_t n, const char* file, const std::string& bytes, const Run& run, const Look& look) {
    const auto fault = GetParam().fault;
    // An end before a read is one after the change before it, and SQLite calls a page damaged whose read fails once.
    const bool may_skip_reads = fault != Fault::fail_for_good;
    std::vector<Call::Kind> sound;
    bool reached = true;
    std::size_t trials = 0;
    const auto first = 1 + static_cast<std::size_t>(fault) % n;
    for (std::size_t call = 0; reached && !HasFatalFailure(); call = call == 0 ? first : call + n) {
      if (may_skip_reads && call > 0 && call < sound.size() && sound[call - 1] == Call::Kind::read) continue;
      const support::TemporaryFolder scratch{support::inMemory()};
      const auto folder = scratch.path() / "state";
      fs::create_directory(folder);
      std::ofstream{folder / file, std::ios::binary} << bytes;
      FaultyDisk disk{fault, call, folder};
      const auto ended = supervise(
          folder, [&](const Say& say) { run((folder / file).string(), say); },
          [&](const Call& made) {
            if (made.kind == Call::Kind::link && !GetParam().has_links)
              return Decision{.what = Decision::What::fail, .error = EPERM};
            if (call == 0) sound.push_back(made.kind);
            return call == 0 ? Decision{} : disk.decide(made);
          });
      reached = call == 0 || disk.reached();
      if (!disk.applies()) continue;
      ++trials;
      if (cutsPower(fault)) disk.cutPower();
      SCOPED_TRACE(std::string{name(fault)} + " at call " + std::to_string(call) + " (" + disk.at() + ")");
      look((folder / file).string(), ended.said);
    }
    EXPECT_GT(trials, 1U);
  }
};

TEST_P(Repair, OfAStoreLosesNothingHoweverItEnds) {
  const auto damaged = storeWithADamagedIndex();
  const bool is_broken = GetParam().fault == Fault::fail_once || GetParam().fault == Fault::fail_for_good;
  const auto repair = [](const std::string& path, const Say& say) {
    auto store = store::Store::openAnyhow(path);
    say((store.whyNotWritable().empty() ? "notice " : "refuses ") + store.notice());
    say("in force " + std::to_string(inForceIn(store)));
  };
  atEveryNthCall(
      kEvery, "results.db", damaged, repair, [&](const std::string& path, const std::vector<std::string>& said) {
        if (said.size() == 2 && !is_broken) {
          EXPECT_EQ(said.back(), "in force 3") << "also while the disk is full";
        }
        std::string told;
        for (const auto& line : said) told += line.starts_with("notice ") ? line : "";
        {
          auto store = store::Store::openAnyhow(path);
          ASSERT_THAT(store.whyNotWritable(), IsEmpty());
          ASSERT_EQ(inForceIn(store), kSubjects);
          ASSERT_THAT(store.damage(), IsEmpty());
          told += store.notice();
        }
        ASSERT_THAT(told, testing::AllOf(HasSubstr("results.db.damaged-1"), HasSubstr("3 results")));
        ASSERT_EQ(support::contentOf(path + ".damaged-1"), damaged);
        const auto again = store::Store::openAnyhow(path);
        ASSERT_THAT(again.notice(), IsEmpty());
        for (const auto& entry : fs::directory_iterator{fs::path{path}.parent_path()})
          ASSERT_THAT(entry.path().filename().string(), testing::AnyOf("results.db", "results.db.damaged-1"));
      });
}

TEST_P(Repair, OfASmallFileLeavesTheDamagedOneOrTheCautiousText) {
  constexpr std::size_t kRoom = 100;
  const auto open = [](const std::string& path) { return store::TwinFile::open(path, kRoom, "careful"); };
  const auto repair = [&](const std::string& path, const Say& say) {
    const auto file = open(path);
    say(file.content());
    say(file.lost() ? "lost" : "not lost");
  };
  const std::string garbage(8192, '\x5a');
  atEveryNthCall(1, "connections", garbage, repair, [&](const std::string& path, const std::vector<std::string>& said) {
    if (!said.empty()) {
      EXPECT_THAT(said, testing::ElementsAre("careful", "lost"));
    }
    auto file = open(path);
    ASSERT_EQ(file.content(), "careful");
    ASSERT_THAT(file.whyNotWritable(), IsEmpty());
    ASSERT_EQ(support::contentOf(path + ".damaged-1"), garbage);
    ASSERT_FALSE(fs::exists(path + ".damaged-2"));
    ASSERT_TRUE(file.write("known"));
    ASSERT_EQ(open(path).content(), "known");
  });
}

INSTANTIATE_TEST_SUITE_P(All, Repair,
                         testing::Values(Case{Fault::kill}, Case{Fault::cut_lost}, Case{Fault::cut_torn},
                                         Case{Fault::fail_once}, Case{Fault::fail_for_good}, Case{Fault::full},
                                         Case{Fault::shorten}, Case{.fault = Fault::kill, .has_links = false},
                                         Case{.fault = Fault::cut_lost, .has_links = false},
                                         Case{.fault = Fault::full, .has_links = false}),
                         [](const auto& chosen) { return nameOf(chosen.param); });

}  // namespace
}  // namespace probebox::faults
