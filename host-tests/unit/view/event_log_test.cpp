#include "tools/probebox/view/event_log.hpp"

#include <gtest/gtest.h>
#include <string>

namespace probebox::view {
namespace {

constexpr auto kUntilNext = EventLog::Lasts::until_next;

std::size_t count(const std::string& all, const std::string& some) {
  std::size_t found = 0;
  for (auto at = all.find(some); at != std::string::npos; at = all.find(some, at + 1)) ++found;
  return found;
}

void putSamples(EventLog& log, std::size_t how_many) {
  for (std::size_t k = 0; k < how_many; ++k) log.put("samples", "[]");
}

TEST(EventLog, GivesEachEventOnceInItsOrder) {
  EventLog log;
  log.put("machine", "1", kUntilNext);
  log.put("samples", "2");
  std::uint64_t from = 0;
  const auto all = log.since(from);
  EXPECT_EQ(count(all, "data: "), 2);
  EXPECT_LT(all.find("data: 1"), all.find("data: 2"));
  log.put("samples", "3");
  EXPECT_EQ(count(log.since(from), "data: "), 1);
}

// What holds until the next of its kind is not repeated by the box: a page that fell behind would show it for ever.
TEST(EventLog, APageThatFallsBehindIsToldTheNewestOfWhatLasts) {
  EventLog log;
  log.put("machine", "{\"of\":0}", kUntilNext);
  std::uint64_t from = 0;
  log.since(from);
  log.put("link", "{\"up\":false}", kUntilNext);
  log.put("machine", "{\"of\":1}", kUntilNext);
  log.put("machine", "{\"of\":2}", kUntilNext);
  putSamples(log, EventLog::kMost + 50);
  const auto all = log.since(from);
  EXPECT_EQ(count(all, "event: machine"), 1);
  EXPECT_EQ(count(all, "{\"of\":2}"), 1);
  EXPECT_EQ(count(all, "event: link"), 1);
  EXPECT_LT(all.find("event: link"), all.find("event: machine")) << "in the order in which they came";
  EXPECT_LT(all.find("event: machine"), all.find("event: samples"));
  EXPECT_EQ(count(all, "event: samples"), EventLog::kMost);
  EXPECT_EQ(from, log.next());
}

TEST(EventLog, APageThatWasToldIsNotToldAgain) {
  EventLog log;
  log.put("machine", "{}", kUntilNext);
  std::uint64_t from = 0;
  log.since(from);
  putSamples(log, EventLog::kMost + 50);
  EXPECT_EQ(count(log.since(from), "event: machine"), 0);
}

}  // namespace
}  // namespace probebox::view
