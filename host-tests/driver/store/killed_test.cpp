#include <algorithm>
#include <csignal>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sys/wait.h>
#include <unistd.h>

#include "host-tests/decided/decided.hpp"
#include "scratch.hpp"

namespace probebox::store {
namespace {

// What the child says after each call that came back: the result's number, once proposed and once accepted.
struct Acknowledgement {
  Id id;
  bool accepted;
};

// Never returns: it is killed.
void proposeAndAcceptForEver(const std::string& path, int acknowledgements) {
  auto store = Store::open(path);
  while (store) {
    const auto id = store->propose(kBinding, delayOf(1), std::string(3000, 'x'), "t0");
    if (!id) break;
    Acknowledgement said{*id, false};
    if (::write(acknowledgements, &said, sizeof said) != sizeof said) break;
    if (!decided::accept(*store, *id, "Ada", "t1")) break;
    said.accepted = true;
    if (::write(acknowledgements, &said, sizeof said) != sizeof said) break;
  }
  ::_exit(1);
}

// Lets a child work, kills it after a random number of acknowledgements and a random wait, and returns all it had said.
std::vector<Acknowledgement> killInMidWork(const std::string& path, std::mt19937& random) {
  int ends[2];
  EXPECT_EQ(::pipe(ends), 0);
  const auto child = ::fork();
  if (child == 0) proposeAndAcceptForEver(path, ends[1]);
  ::close(ends[1]);
  std::vector<Acknowledgement> heard;
  const auto listen = [&] {
    Acknowledgement said{};
    const bool more = ::read(ends[0], &said, sizeof said) == sizeof said;
    if (more) heard.push_back(said);
    return more;
  };
  const auto before_kill = std::uniform_int_distribution<std::size_t>{0, 6}(random);
  while (heard.size() < before_kill && listen()) {
  }
  ::usleep(std::uniform_int_distribution<useconds_t>{0, 4000}(random));
  ::kill(child, SIGKILL);
  while (listen()) {
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << "the child stopped by itself: a call failed";
  ::close(ends[0]);
  return heard;
}

TEST(StoreOfAKilledProcess, HoldsEveryAcknowledgedAcceptanceAndOneActiveResult) {
  const Scratch scratch;
  std::mt19937 random{20261121};
  std::size_t acknowledged = 0;
  for (int round = 0; round < 60; ++round) {
    const auto heard = killInMidWork(scratch.file(), random);
    auto store = Store::open(scratch.file());
    ASSERT_TRUE(store) << store.error().what;
    ASSERT_EQ(store->notice(), "");
    for (const auto& [id, accepted] : heard) {
      const auto record = store->find(id);
      ASSERT_TRUE(record) << record.error().what;
      if (!accepted) continue;
      ++acknowledged;
      EXPECT_THAT(record->state, testing::AnyOf(State::active, State::retired));
      EXPECT_EQ(record->accepted_by, "Ada");
    }
    const auto all = decided::newest(*store, 100'000).value();
    const auto active = std::ranges::count(all, State::active, &Record::state);
    EXPECT_EQ(active, std::ranges::count(all, std::string{"Ada"}, &Record::accepted_by) > 0 ? 1 : 0);
  }
  EXPECT_GT(acknowledged, 30U) << "the children were killed too early to prove anything";
}

}  // namespace
}  // namespace probebox::store
