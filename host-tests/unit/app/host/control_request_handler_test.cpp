#include "firmware/app/host/control_request_handler.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/support/temporary_folder.hpp"

// What a line of the controller says is done as a whole or not at all.
namespace probebox::app {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr board::Access kAll{
    .allow_marker = true, .allow_homing = true, .allow_inhibit = true, .allow_calibrate = true, .allow_accept = true};
constexpr const char* kConnection = "modbus:/dev/ttyS1";

class Desk : public testing::Test {
 protected:
  std::optional<Error> take(const std::vector<Event>& said) { return handler_.take(said, kConnection, state_, kAll); }
  std::size_t taken() {
    std::size_t count = 0;
    for (Event event; commands_.pop(event);) ++count;
    return count;
  }
  void standStill(Axis axis) {
    state_.snapshot.axes.at(static_cast<std::size_t>(axis)).homing = published::Homing::possible;
  }

  box::State state_;

  const support::TemporaryFolder folder_;
  TimeSource time_;
  Counters counters_;
  SourceTable sources_;
  CommandQueue commands_;
  StateBuffer states_;
  CoreView core_{states_, commands_};
  Calibrations calibrations_{store::Store::openAnyhow(folder_.file("results.db")),
                             {.probe_serial_number = "1", .machine = "mill", .mounting = "spindle", .travel = {}},
                             {},
                             [] { return MonoTime{}; },
                             [](std::span<const Event>) { return std::optional<Error>{}; },
                             [](const Event&) { return true; }};
  ConnectionInhibits connections_{folder_.file("connections"), [](bool) { return true; }};
  AppliedCorrectionFile applied_{folder_.file("served"), {}, [](const Event&) {}};
  ResultRequestHandler results_{calibrations_, core_, connections_};
  LoopBackRequestHandler loop_back_{std::nullopt, nullptr};
  UnitRequestHandler unit_{UnitRecord{folder_.file("unit")}, "board", {}};
  UpdateRequestHandler updates_{folder_.file("update"), {}, {}};
  Worker worker_{[] {}};
  const messages::LineStatus cut_line_{.name = "cut", .role = 4, .line = 1, .edges = 0, .lost = 0};
  ControlRequestHandler handler_{
      {"board", "0", {cut_line_}},
      {1.0, time_, commands_, worker_, calibrations_, results_, loop_back_, unit_, updates_, connections_, applied_,
       counters_, sources_, [] { return std::vector<messages::CncLineStatus>{}; }},
      [](const Reply&) {}};
};

TEST_F(Desk, HomesAllAxesOfALineOrNone) {
  standStill(Axis::x);
  const std::vector<Event> said{AxisHomed{Axis::x, 10, {}}, AxisHomed{Axis::y, 20, {}}};
  const auto refused = take(said);
  ASSERT_TRUE(refused) << "Y moves";
  EXPECT_THAT(refused->what, HasSubstr("axis Y"));
  EXPECT_EQ(taken(), 0U);
  standStill(Axis::y);
  EXPECT_FALSE(take(said));
  EXPECT_EQ(taken(), 2U);
}

TEST_F(Desk, SaysWhatAHomingLacks) {
  const auto why = [&](published::Homing homing) {
    state_.snapshot.axes[1].homing = homing;
    return take({AxisHomed{Axis::y, 20, {}}}).value_or(Error{}).what;
  };
  EXPECT_THAT(why(published::Homing::silent), HasSubstr("axis Y"));
  EXPECT_THAT(why(published::Homing::moving), testing::AllOf(HasSubstr("axis Y"), HasSubstr("0.1 s")));
  EXPECT_THAT(why(published::Homing::absolute), HasSubstr("leave"));
  EXPECT_EQ(taken(), 0U);
}

TEST_F(Desk, BeginsNoCutWithAMarkerThatBelongsToNoRun) {
  EXPECT_TRUE(take({CutInhibit{.active = true, .at = {}}, Marker{.procedure = 1}}));
  EXPECT_FALSE(connections_.inhibits(kConnection));
  EXPECT_FALSE(take({CutInhibit{.active = true, .at = {}}}));
  EXPECT_TRUE(connections_.inhibits(kConnection));
}

// A master may write the block around register 138 with what is there.
TEST_F(Desk, NeedsNoRightToSayWhatHoldsAlready) {
  const board::Access marks{.allow_marker = true};
  EXPECT_FALSE(handler_.take(std::vector<Event>{CutInhibit{.active = false, .at = {}}}, kConnection, state_, marks));
  EXPECT_TRUE(handler_.take(std::vector<Event>{CutInhibit{.active = true, .at = {}}}, kConnection, state_, marks));
  EXPECT_FALSE(connections_.inhibits(kConnection));
  ASSERT_FALSE(take({CutInhibit{.active = true, .at = {}}}));
  EXPECT_TRUE(handler_.take(std::vector<Event>{CutInhibit{.active = false, .at = {}}}, kConnection, state_, marks));
  EXPECT_TRUE(connections_.inhibits(kConnection));
}

// Codes 6 and 7 of register 840 are these: a controller may wait for another state, for another machine it cannot.
TEST_F(Desk, TellsWhatThisMachineCannotFromWhatItCannotNow) {
  const auto ask = [&](const char* method, std::uint32_t tool = 0) {
    messages::StartProcedure::Request request;
    request.method = method;
    request.options.tool = tool;
    const auto body = messages::encoded(request);
    const auto reply =
        handler_.handle({.link = 1, .connection = "tcp:127.0.0.1:7627", .may = kAll},
                        {.ticket = 1, .operation = messages::Operation::start_procedure, .body = body}, state_, {});
    return reply ? reply->code : messages::ErrorCode::ok;
  };
  EXPECT_EQ(ask("pre-travel"), messages::ErrorCode::refused) << "a scanning probe has none";
  EXPECT_EQ(ask("delay-known-sphere"), messages::ErrorCode::refused) << "the sphere is not described";
  EXPECT_EQ(ask("tool-setter", 99), messages::ErrorCode::refused) << "no such tool";
  EXPECT_EQ(ask("centreline"), messages::ErrorCode::wrong_state) << "no delay is in force";
  EXPECT_EQ(ask("delay-multi-speed"), messages::ErrorCode::wrong_state) << "the clock is not locked";
  EXPECT_EQ(ask("no-such-method"), messages::ErrorCode::not_found);
}

TEST_F(Desk, SumsNoSourceThatMachineTomlDoesNotDescribe) {
  const auto ask = [&](std::uint16_t mask) {
    const auto body = messages::encoded(messages::EnableSources::Request{.mask = mask});
    const auto reply =
        handler_.handle({.link = 1, .connection = "tcp:127.0.0.1:7627", .may = kAll},
                        {.ticket = 1, .operation = messages::Operation::enable_sources, .body = body}, state_, {});
    return reply ? reply->text : "";
  };
  EXPECT_THAT(ask(0b0001), HasSubstr("no screw"));
  EXPECT_THAT(ask(0b0011), HasSubstr("no screw"));
  EXPECT_THAT(ask(0b0010), HasSubstr("swivelling head"));
  EXPECT_THAT(ask(0b0100), HasSubstr("rotary table"));
  EXPECT_EQ(taken(), 0U);
  state_.snapshot.health[0] = published::Health::invalid;  // no reading yet
  EXPECT_EQ(ask(0b0001), "");
  EXPECT_EQ(ask(0b1000), "") << "the centreline needs no description";
  EXPECT_EQ(taken(), 2U);
}

// Whoever may do nothing else may ask: a forecast changes nothing.
TEST_F(Desk, DescribesTheMachineToEverybody) {
  state_.rates = procedure::Rates{.positions_hz = {1000, 1000, 500}, .deflections_hz = 2000};
  state_.snapshot.delay = {.calibrated = true, .result_id = 7, .tau_s = {4e-3, 4e-3, 4e-3}, .sd_s = {1e-6, 1e-6, 2e-6}};
  const auto reply =
      handler_.handle({.link = 1, .connection = "tcp:127.0.0.1:7627", .may = {}},
                      {.ticket = 9, .operation = messages::Operation::describe_machine, .body = {}}, state_, {});
  ASSERT_TRUE(reply);
  ASSERT_EQ(reply->code, messages::ErrorCode::ok) << reply->text;
  EXPECT_EQ(reply->ticket, 9U);
  const auto answer = messages::decode<messages::DescribeMachine::Answer>(reply->body);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer->positions_hz[2], 500);
  EXPECT_EQ(answer->deflections_hz, 2000);
  EXPECT_EQ(answer->delay.result_id, 7U);
  EXPECT_EQ(answer->delay.sd_s[2], 2e-6);
  EXPECT_EQ(answer->sphere.diameter_mm, 0) << "none is described";
}

TEST_F(Desk, HomesTheAxesThatAreNamedAndSaysWhich) {
  for (const auto axis : {Axis::x, Axis::y, Axis::z}) standStill(axis);
  const auto ask = [&](std::uint8_t axes) {
    const auto body =
        messages::encoded(messages::HomeAxes::Request{.axes = axes, .position_mm = {1, 2, 3}, .by = "Ada"});
    return handler_.handle({.link = 1, .connection = "tcp:127.0.0.1:7627", .may = kAll},
                           {.ticket = 1, .operation = messages::Operation::home_axes, .body = body}, state_, {});
  };
  testing::internal::CaptureStderr();
  for (const std::uint8_t axes : {std::uint8_t{0}, std::uint8_t{0b1000}, std::uint8_t{0b1001}}) {
    const auto reply = ask(axes);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->code, messages::ErrorCode::malformed) << int{axes};
    EXPECT_THAT(reply->text, testing::AllOf(HasSubstr("bits 0"), HasSubstr("(X Y")));
  }
  EXPECT_EQ(taken(), 0U);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  testing::internal::CaptureStderr();
  EXPECT_EQ(ask(0b101)->code, messages::ErrorCode::ok);
  EXPECT_EQ(taken(), 2U);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::AllOf(HasSubstr("X Z"), HasSubstr("Ada")));
}

TEST_F(Desk, TakesNoPoseThatHasNothing) {
  const auto ask = [&](std::uint8_t axes, bool has_tool) {
    messages::TellPose::Request request;
    request.axes = axes;
    request.has_tool = has_tool;
    const auto body = messages::encoded(request);
    return handler_
        .handle({.link = 1, .connection = "tcp:127.0.0.1:7627", .may = kAll},
                {.ticket = 1, .operation = messages::Operation::tell_pose, .body = body}, state_, {})
        ->code;
  };
  EXPECT_EQ(ask(0, false), messages::ErrorCode::malformed);
  EXPECT_EQ(ask(0b1000, false), messages::ErrorCode::malformed);
  EXPECT_EQ(ask(0b1001, true), messages::ErrorCode::malformed);
  EXPECT_EQ(taken(), 0U);
  EXPECT_EQ(ask(0, true), messages::ErrorCode::ok);
  EXPECT_EQ(ask(0b010, false), messages::ErrorCode::ok);
  EXPECT_EQ(taken(), 2U);
}

TEST_F(Desk, LogsHowFarHomingAgainMovesAReference) {
  standStill(Axis::x);
  auto& x = state_.snapshot.axes.at(0);
  const auto logged = [&](double at_mm) {
    testing::internal::CaptureStderr();
    EXPECT_FALSE(take({AxisHomed{Axis::x, at_mm, {}}}));
    return testing::internal::GetCapturedStderr();
  };
  x.position_mm = 100;
  EXPECT_EQ(logged(99.5), "") << "nothing was referenced";
  x.referenced = true;
  EXPECT_THAT(logged(99.5),
              testing::AllOf(HasSubstr("axis X"), HasSubstr("0.5000 mm"), HasSubstr("modbus:/dev/ttyS1")));
  EXPECT_THAT(logged(100.25), HasSubstr("-0.2500 mm"));
  EXPECT_EQ(logged(100.0009), "");
}

constexpr const char* kUnit =
    "[unit]\nserial_number = \"A1\"\nvendor = \"V\"\nmodel = \"M\"\nboard = \"board\"\n[usb]\nvendor_id = "
    "1\nproduct_id = "
    "2\n";

TEST_F(Desk, ProvisionsOnlyWithTheRightToAndAtRest) {
  const auto ask = [&](std::optional<bool> may) {
    const auto body = messages::encoded(messages::Provision::Request{.text = kUnit});
    return handler_.handle({.link = 1, .connection = "tcp:127.0.0.1:7627", .may = {.allow_provision = may}},
                           {.ticket = 1, .operation = messages::Operation::provision, .body = body}, state_, {});
  };
  const auto refused = [&] {
    const auto reply = ask(true);
    return reply && reply->code == messages::ErrorCode::wrong_state ? reply->text : "";
  };
  state_.procedure.state = procedure::State::running;
  EXPECT_THAT(refused(), StartsWith("run-on"));
  state_.procedure.state = procedure::State::idle;
  state_.snapshot.inhibited = true;
  EXPECT_THAT(refused(), StartsWith("cut-on"));
  state_.snapshot.inhibited = false;
  ASSERT_FALSE(connections_.setInhibit(kConnection, true, "")) << "the core has not heard of it yet";
  EXPECT_THAT(refused(), StartsWith("cut-on"));
  ASSERT_FALSE(connections_.setInhibit(kConnection, false, ""));
  EXPECT_FALSE(ask(true)) << "the worker answers";
  for (const auto may : {std::optional<bool>{}, std::optional{false}}) {
    const auto body = messages::encoded(messages::Provision::Request{.text = kUnit});
    const auto reply = unit_.answer(messages::Operation::provision, body, {.allow_provision = may});
    EXPECT_EQ(reply.code, messages::ErrorCode::not_permitted);
    EXPECT_THAT(reply.text, HasSubstr("allow_provision"));
  }
}

TEST_F(Desk, NamesTheInhibitLineWhoseLevelIsUnknown) {
  for (const char* const source : {"gpiochip0 line 4 (cut)", "gpiochip0 line 5 (skip)"}) sources_.add(source);
  sources_.tell(0, "gpiochip0 cannot be found; check its connection");
  const auto problems = [&] {
    const auto reply = handler_.handle({.link = 1, .connection = "usb", .may = {}},
                                       {.ticket = 1, .operation = messages::Operation::status, .body = {}}, state_, {});
    const auto answer = messages::decode<messages::Status::Answer>(reply->body);
    EXPECT_EQ(answer->sources.size(), 2U);
    return std::vector{answer->sources[0].problem, answer->sources[1].problem};
  };
  EXPECT_EQ(problems()[0], "gpiochip0 cannot be found; check its connection");
  state_.snapshot.unknown_inhibit_lines = 2;
  EXPECT_THAT(problems()[0], testing::AllOf(StartsWith("gpiochip0 cannot be found"), HasSubstr("a cut")));
  EXPECT_EQ(problems()[1], "");
}

}  // namespace
}  // namespace probebox::app
