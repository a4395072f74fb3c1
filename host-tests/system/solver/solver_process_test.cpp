#include "firmware/app/solver/solver_process.hpp"

#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <thread>

#include "firmware/json/dataset_json.hpp"
#include "sphere_case.hpp"

namespace probebox::app {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

metrology::Solved solveBy(SolverProcess& solver, const metrology::Dataset& dataset) {
  solver.start(dataset, json::toJson(dataset));
  while (true) {
    if (auto answer = solver.poll()) return std::move(*answer);
    pollfd end{solver.descriptor(), POLLIN, 0};
    poll(&end, 1, 100);
  }
}

metrology::Refusal refusalBy(SolverProcess& solver, const metrology::Dataset& dataset) {
  const auto solved = solveBy(solver, dataset);
  EXPECT_FALSE(solved);
  return solved ? metrology::Refusal{} : solved.error();
}

TEST(SolverProcess, AnswersWithTheSameDigitsAsTheSolverItself) {
  SolverProcess solver{PROBEBOXD};
  const auto dataset = sphereCase(40);
  auto here = metrology::solve(dataset);
  ASSERT_TRUE(here);
  here->residuals = {};  // follow from the case, which is kept beside the result
  const auto there = solveBy(solver, dataset);
  ASSERT_TRUE(there) << there.error().reason;
  EXPECT_EQ(*there, *here);
}

TEST(SolverProcess, RefusesWhatTheSolverRefuses) {
  SolverProcess solver{PROBEBOXD};
  EXPECT_EQ(refusalBy(solver, sphereCase(3)).name, metrology::solve(sphereCase(3)).error().name);
  auto other = sphereCase(40);
  other.method = "guess";
  EXPECT_EQ(refusalBy(solver, other).name, "unknown-method");
}

TEST(SolverProcess, ThatDiesIsARefusalAndTheNextCaseHasANewOne) {
  const support::TemporaryFolder folder;
  SolverProcess solver{programThat(folder, "kill -SEGV $$")};
  for (int k = 0; k < 3; ++k) {
    const auto refusal = refusalBy(solver, sphereCase(40));
    EXPECT_EQ(refusal.name, "solver-ended");
    EXPECT_THAT(refusal.reason, AllOf(HasSubstr("signal 11"), HasSubstr("probebox solve")));
  }
  programThat(folder, std::string{"exec "} + PROBEBOXD + " \"$@\"");
  EXPECT_TRUE(solveBy(solver, sphereCase(40)));
}

TEST(SolverProcess, ThatGivesNoAnswerIsARefusal) {
  const support::TemporaryFolder folder;
  for (const auto* does :
       {"exit 3", "exit 0", "echo hello", "echo result; echo '{\"method\": 1}'", "head -c 20000000 /dev/zero"}) {
    SolverProcess solver{programThat(folder, does)};
    EXPECT_EQ(refusalBy(solver, sphereCase(40)).name, "solver-ended") << does;
  }
  SolverProcess missing{folder.file("nowhere")};
  EXPECT_THAT(refusalBy(missing, sphereCase(40)).reason, HasSubstr("No such"));
}

TEST(SolverProcess, TakesNoMoreTimeOfTheProcessorThanItMay) {
  SolverProcess solver{PROBEBOXD, {.processor = std::chrono::seconds{1}, .memory_bytes = 4ULL << 30U}};
  const auto refusal = refusalBy(solver, sphereCase(2'000'000));
  EXPECT_EQ(refusal.name, "too-long");
  EXPECT_THAT(refusal.reason, AllOf(HasSubstr("1 s"), HasSubstr("probebox solve")));
}

TEST(SolverProcess, ThatOnlyWaitsIsEndedByTheClock) {
  const support::TemporaryFolder folder;
  SolverProcess solver{programThat(folder, "exec sleep 600"), {.patience = std::chrono::seconds{1}}};
  EXPECT_EQ(refusalBy(solver, sphereCase(40)).name, "too-long");
}

TEST(SolverProcess, TakesNoMoreMemoryThanItMay) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer reserves terabytes of addresses";
#endif
  SolverProcess solver{PROBEBOXD, {.memory_bytes = 58U << 20U}};
  const auto refusal = refusalBy(solver, sphereCase(250'000));
  // Where even the words for it find no memory, the process ends; the box goes on either way.
  EXPECT_THAT(refusal.name, AnyOf("too-much-memory", "solver-ended"));
  EXPECT_THAT(refusal.reason, HasSubstr("probebox solve"));
}

TEST(SolverProcess, IsGoneOnceItIsCancelled) {
  const support::TemporaryFolder folder;
  SolverProcess solver{
      programThat(folder, "touch " + folder.file("begun") + "; sleep 4; touch " + folder.file("done"))};
  const auto dataset = sphereCase(40);
  solver.start(dataset, json::toJson(dataset));
  while (!std::filesystem::exists(folder.file("begun"))) std::this_thread::sleep_for(std::chrono::milliseconds{5});
  solver.cancel();
  EXPECT_FALSE(solver.poll());
  EXPECT_EQ(solver.descriptor(), -1);
  std::this_thread::sleep_for(std::chrono::milliseconds{4500});
  EXPECT_FALSE(std::filesystem::exists(folder.file("done")));
}

TEST(SolverProcess, HasNoRightsAndNoFilesOfTheDaemon) {
  const support::TemporaryFolder folder;
  const auto left = folder.file("files");
  SolverProcess solver{programThat(folder, "ls /proc/$$/fd > " + left)};
  EXPECT_EQ(refusalBy(solver, sphereCase(40)).name, "solver-ended");
  std::ifstream files{left};
  std::vector<int> open;
  for (int number = 0; files >> number;) open.push_back(number);
  EXPECT_THAT(open, testing::IsSupersetOf({0, 1, 2}));
  for (const int number : open) EXPECT_TRUE(number <= 2 || number >= 10) << number << " (a shell's own is 10 or more)";
}

}  // namespace
}  // namespace probebox::app
