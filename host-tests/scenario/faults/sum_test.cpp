#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <variant>
#include <vector>

#include "firmware/app/results/results_in_force.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/faults/faulty_disk.hpp"
#include "host-tests/support/sanitized.hpp"
#include "host-tests/support/temporary_folder.hpp"

// A result that the box makes of two others and puts into force by itself, on a disk that fails.
namespace probebox::faults {
namespace {

using namespace std::chrono_literals;
using metrology::Estimate;
using ::testing::HasSubstr;

const std::string kTipOf = "centreline-stylus", kOffset = "stylus-offset-1", kSum = "centreline";

metrology::Result at(const char* method, const char* key, double x_mm) {
  metrology::Result result;
  result.method = method;
  result.estimates = {Estimate::vector(key, {x_mm, 0}, {1e-4, 1e-4})};
  return result;
}

// Results in force beside a core that remembers the centreline that it was told.
class Turning {
 public:
  explicit Turning(const std::filesystem::path& folder)
      : store_{store::Store::openAnyhow((folder / "results.db").string())} {
    for (const auto& event : results_.restore()) hear(event);
  }

  // Behind the first second, in which no result comes into force.
  void begin() {
    for (const auto at : {0s, 2s}) {
      box::State state{};
      state.events = 1;
      state.at = MonoTime{at};
      results_.look(state);
    }
  }

  // The centreline from a tip is in force, the offset of its stylus is proposed.
  void prepare() {
    const auto tip = store_.propose(results_.bindingFor(kTipOf), at("centreline", "centre_mm", 0.174), "", "t0");
    ASSERT_TRUE(tip && results_.accept(*tip, "Ada"));
    ASSERT_TRUE(
        store_.propose(results_.bindingFor(kOffset), at("spindle-offset-2x2", "stylus_offset_mm", 0.02), "", "t1"));
  }
  std::string acceptOffset() {
    const auto newest = decided::newest(store_, 1);
    if (!newest || newest->empty()) return "nothing is proposed";
    const auto accepted = results_.accept(newest->front().id, "Ada");
    if (!accepted) return accepted.error().what;
    const auto about_sum = std::ranges::find_if(accepted->notes, [](const std::string& note) {
      return note.find(" plus the stylus offset of ") != std::string::npos;
    });
    return about_sum == accepted->notes.end() ? "nothing about a sum" : *about_sum;
  }
  store::Id told() const { return told_; }
  store::Id shown() const {
    const auto in_force = results_.about();
    const auto found = std::ranges::find(in_force, kSum, &app::InForceAbout::subject);
    return found == in_force.end() ? 0 : found->id;
  }

 private:
  void hear(const Event& event) {
    if (const auto* centreline = std::get_if<CentrelineActivated>(&event)) told_ = centreline->result_id;
  }

  store::Store store_;
  store::Id told_{};
  app::ResultsInForce results_{store_,
                               {.probe_serial_number = "1", .machine = "mill", .mounting = "spindle", .travel = {}},
                               [] { return MonoTime{5s}; },
                               [](auto) { return std::optional<Error>{}; },
                               [this](const Event& event) { hear(event); }};
};

class SumOfTwoResults : public testing::TestWithParam<Fault> {
 protected:
  void SetUp() override {
    if (const auto why = whyNoSupervision(); !why.empty()) GTEST_SKIP() << why;
  }
};

TEST_P(SumOfTwoResults, IsInForceForTheCoreAsItIsShown) {
  // A single failure at every call; of those that stay, what differs lies further apart.
  const std::size_t step = support::kSanitized ? 7 : GetParam() == Fault::fail_once ? 1 : 5;
  const support::TemporaryFolder before{support::inMemory()};
  {
    Turning box{before.path()};
    box.begin();
    box.prepare();
  }
  int behind = 0, complete = 0;
  for (std::size_t call = 1;; call += step) {
    const support::TemporaryFolder folder{support::inMemory()};
    std::filesystem::copy(before.path(), folder.path(), std::filesystem::copy_options::recursive);
    FaultyDisk disk{GetParam(), call, folder.path()};
    const auto ended = supervise(
        folder.path(),
        [&](const Say& say) {
          Turning box{folder.path()};
          box.begin();
          const auto answer = box.acceptOffset();
          // A store that cannot be read any more shows nothing.
          const bool agrees = box.told() == box.shown() || (GetParam() == Fault::fail_for_good && box.shown() == 0);
          say(agrees ? "agrees"
                     : "the core has " + std::to_string(box.told()) + ", shown is " + std::to_string(box.shown()));
          say(std::to_string(box.told()));
          say(answer);
        },
        [&](const Call& each) { return disk.decide(each); });
    if (!disk.reached()) break;
    ASSERT_EQ(ended.said.size(), 3U) << "call " << call << " " << disk.at();
    EXPECT_EQ(ended.said[0], "agrees") << "call " << call << " " << disk.at() << ": " << ended.said[2];
    const Turning again{folder.path()};
    EXPECT_EQ(again.told(), again.shown());
    if (ended.said[1] != "0") {
      EXPECT_EQ(std::to_string(again.told()), ended.said[1]) << "what the next start finds";
      EXPECT_THAT(ended.said[2], HasSubstr("in force")) << "call " << call << " " << disk.at();
      ++complete;
    }
    behind += ended.said[2].find("failed behind it") != std::string::npos ? 1 : 0;
  }
  EXPECT_GT(complete, 0);
  EXPECT_TRUE(behind > 0 || support::kSanitized || GetParam() != Fault::fail_once) << "none behind the last write";
}

INSTANTIATE_TEST_SUITE_P(All, SumOfTwoResults, testing::Values(Fault::fail_once, Fault::fail_for_good, Fault::full),
                         [](const auto& chosen) {
                           std::string text{name(chosen.param)};
                           std::erase(text, '-');
                           return text;
                         });

}  // namespace
}  // namespace probebox::faults
