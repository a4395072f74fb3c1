#include "firmware/app/log/journal.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>
#include <vector>

namespace probebox::app {
namespace {

class Journal : public testing::Test {
 protected:
  Journal() { std::filesystem::remove(path); }
  ~Journal() override { std::filesystem::remove(path); }

  std::vector<Event> write(int count) {
    auto writer = JournalWriter::create(path);
    std::vector<Event> events;
    for (int i = 0; i < count; ++i) {
      events.emplace_back(Edge{.role = LineRole::sync,
                               .line = 0,
                               .level = Level::active,
                               .line_sequence = static_cast<std::uint32_t>(i),
                               .at = monoTime(i * 1'000'000)});
      events.emplace_back(
          Deflection{.sequence = 7, .channels_nm = {i, -i, 2 * i}, .clipped = false, .at = monoTime(i)});
    }
    for (const auto& event : events) EXPECT_TRUE(writer->write(event));
    writer->flush();
    return events;
  }

  const std::filesystem::path path =
      std::filesystem::path{testing::TempDir()} / ("journal-" + std::to_string(getpid()) + ".pbj");
};

TEST_F(Journal, GivesBackWhatWasWritten) {
  const auto written = write(100);
  std::vector<Event> read;
  const auto end = readJournal(path, [&](const Event& event) { read.push_back(event); });
  ASSERT_TRUE(end);
  EXPECT_EQ(end->events, written.size());
  EXPECT_EQ(end->lost, 0U);
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    ASSERT_EQ(read[i].index(), written[i].index());
    EXPECT_EQ(stampOf(read[i]), stampOf(written[i]));
  }
  EXPECT_EQ(std::get<Deflection>(read[199]).channels_nm[1], -99);
}

TEST_F(Journal, HoldsAResultThatComesInManyEvents) {
  const RotaryActivated head{.result_id = 7,
                             .axis = RotaryAxis::c,
                             .point_mm = {1, 2, 3},
                             .direction = {0, 0, 1},
                             .sd = {1, 2, 3, 4, 5, 6},
                             .rows = 72,
                             .at = monoTime(5)};
  const ErrorsAtAngle row{.of = ErrorsOf::rotary,
                          .axis = RotaryAxis::c,
                          .result_id = 7,
                          .angle_rad = 0.5,
                          .errors = {1, 2, 3, 4, 5, 6},
                          .at = monoTime(6)};
  {
    auto writer = JournalWriter::create(path);
    for (const Event& event : {Event{head}, Event{row}, Event{SwivelActivated{}}, Event{PoseTold{}}})
      ASSERT_TRUE(writer->write(event));
    writer->flush();
  }
  std::vector<Event> read;
  ASSERT_TRUE(readJournal(path, [&](const Event& event) { read.push_back(event); }));
  ASSERT_EQ(read.size(), 4U);
  EXPECT_EQ(std::get<RotaryActivated>(read[0]).sd, head.sd);
  EXPECT_EQ(std::get<RotaryActivated>(read[0]).point_mm, head.point_mm);
  EXPECT_EQ(std::get<ErrorsAtAngle>(read[1]).errors, row.errors);
}

TEST_F(Journal, StaysReadableWhenItIsCutAtAnyByte) {
  write(3);
  const auto size = std::filesystem::file_size(path);
  std::uint64_t last = 6;
  for (auto length = size; length-- > 0;) {
    std::filesystem::resize_file(path, length);
    const auto end = readJournal(path, [](const Event&) {});
    ASSERT_TRUE(end);
    EXPECT_LE(end->events, last);
    EXPECT_GE(end->events + 1, last);
    EXPECT_EQ(end->lost, 0U);
    last = end->events;
  }
  EXPECT_EQ(last, 0U);
}

TEST_F(Journal, CountsWhatIsMissingInTheMiddle) {
  write(50);
  {
    std::fstream file{path, std::ios::in | std::ios::out | std::ios::binary};
    file.seekp(200);
    file.put('\x55').put('\x55');
  }
  const auto end = readJournal(path, [](const Event&) {});
  ASSERT_TRUE(end);
  EXPECT_GE(end->lost, 1U);
  EXPECT_EQ(end->events + end->lost, 100U);
}

TEST_F(Journal, NeverOverwrites) {
  write(1);
  const auto second = JournalWriter::create(path);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().what.find("does not exist yet"), std::string::npos);
}

}  // namespace
}  // namespace probebox::app
