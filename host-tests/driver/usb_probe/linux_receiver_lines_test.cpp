#include "receiver_on_bus.hpp"

// The lines and faults of a receiver with packets of version 3, on a mocked bus.
namespace probebox::usb_probe {
namespace {

using testing::HasSubstr;

class ReceiverWithLines : public Receiver {
 protected:
  void SetUp() override {
    Receiver::SetUp();
    device_ = EmulatedReceiver{{.samples_a_packet = 4, .steps_a_sample = 10'000},
                               [](Nanoseconds) { return std::array<Micrometres, 3>{}; },
                               monoTime(0)};
    lines_[0] = {LineRole::sync, 0, false};
    lines_[3] = {LineRole::inhibit, 0, false};
  }
  WiredLines lines_{};
};

TEST_F(ReceiverWithLines, GivesTheirEdgesAndTellsOnceThatItWentWithThem) {
  bus_->plug(kReceiver);
  LinuxReceiver source{"", {.lines = lines_}};
  read(source);
  device_.edge(ReceiverLine::sync, true, monoTime(700'000));
  send(packets(1));
  bus_->unplug("1-3");
  std::vector<Event> events;
  for (int round = 0; round < 5; ++round)
    for (const auto& event : read(source)) events.push_back(event);
  std::vector<Source> lost;
  std::size_t edges = 0;
  for (const auto& event : events) {
    if (std::holds_alternative<CountedEdge>(event)) ++edges;
    if (const auto* const one = std::get_if<SourceLost>(&event)) lost.push_back(one->source);
  }
  EXPECT_EQ(edges, 2U) << "of sync, and the level that inhibit begins with";
  EXPECT_THAT(lost, testing::ElementsAre(Source::probe, Source::sync, Source::trigger));
}

// The probe and the master clock's edges are on the first: the second goes without them.
TEST_F(ReceiverWithLines, AsTheSecondHasNeitherAProbeNorTheClock) {
  bus_->plug(kReceiver);
  lines_[0]->line = 1;
  LinuxReceiver source{"RX-7", {.lines = lines_, .number = 1}};
  EXPECT_EQ(source.name(), "second receiver usb:RX-7");
  read(source);
  device_.edge(ReceiverLine::sync, true, monoTime(700'000));
  device_.setFaults(bitOf(ReceiverFault::converter_silent) | bitOf(ReceiverFault::edges_lost));
  send(packets(1));
  std::vector<Event> events = read(source);
  EXPECT_EQ(source.faults(), bitOf(ReceiverFault::edges_lost)) << "it needs no converter";
  bus_->unplug("1-3");
  for (int round = 0; round < 5; ++round)
    for (const auto& event : read(source)) events.push_back(event);
  std::vector<Source> lost;
  for (const auto& event : events) {
    if (const auto* const edge = std::get_if<CountedEdge>(&event)) {
      EXPECT_EQ(edge->receiver, 1);
    }
    if (const auto* const sample = std::get_if<CountedDeflection>(&event)) {
      EXPECT_EQ(sample->receiver, 1);
    }
    if (const auto* const one = std::get_if<SourceLost>(&event)) lost.push_back(one->source);
  }
  EXPECT_THAT(lost, testing::ElementsAre(Source::trigger));
}

TEST_F(ReceiverWithLines, NamesAVersionThatHasNoLines) {
  device_ =
      EmulatedReceiver{{.samples_a_packet = 4}, [](Nanoseconds) { return std::array<Micrometres, 3>{}; }, monoTime(0)};
  bus_->plug(kReceiver);
  LinuxReceiver source{"", {.lines = lines_}};
  read(source);
  send(packets(1));
  read(source);
  EXPECT_THAT(source.problem(), testing::AllOf(HasSubstr("version 1"), HasSubstr("version 3")));
}

TEST_F(ReceiverWithLines, NamesItsFaultsForAMinute) {
  bus_->plug(kReceiver);
  LinuxReceiver source{"", {.lines = lines_}};
  read(source);
  device_.setFaults(bitOf(ReceiverFault::wires_3) | bitOf(ReceiverFault::edges_lost));
  send(packets(1));
  read(source);
  EXPECT_EQ(source.faults(), bitOf(ReceiverFault::edges_lost) | bitOf(ReceiverFault::wires_3));
  EXPECT_EQ(source.faultNames()[10].name, "wires-of-counter-2");
  EXPECT_EQ(source.problem(), "") << "it delivers";
  device_.setFaults(bitOf(ReceiverFault::wires_3));
  now_ += LinuxReceiver::kShown / 2;
  send(packets(1));
  read(source);
  EXPECT_EQ(source.faults(), bitOf(ReceiverFault::edges_lost) | bitOf(ReceiverFault::wires_3))
      << "a person looks now and then";
  now_ += LinuxReceiver::kShown * 2 / 3;
  device_.setFaults(0);
  send(packets(1));
  read(source);
  EXPECT_EQ(source.faults(), bitOf(ReceiverFault::wires_3));
  now_ += LinuxReceiver::kShown;
  send(packets(1));
  read(source);
  EXPECT_EQ(source.faults(), 0U);
}

}  // namespace
}  // namespace probebox::usb_probe
