#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/cases.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/stream.hpp"

// Fills every field of a message with something that is not its default, each different from its neighbours.
namespace probebox::messages {

class Filler {
 public:
  explicit Filler(std::uint64_t seed = 1) : state_{seed} {}

  template <Structure T>
  T made() {
    T value{};
    fill(value);
    return value;
  }

  template <class T>
  void fill(T& value) {
    if constexpr (std::same_as<T, bool>) {
      value = (next() & 1U) != 0;
    } else if constexpr (std::same_as<T, double>) {
      value = static_cast<double>(static_cast<std::int64_t>(next())) * 1e-9;
    } else if constexpr (std::same_as<T, MonoTime>) {
      value = monoTime(static_cast<std::int64_t>(next()));
    } else if constexpr (std::same_as<T, Tick> || std::same_as<T, SampleIndex>) {
      value.index = static_cast<std::int64_t>(next());
    } else if constexpr (frame::Scalar<T> || std::same_as<T, std::byte>) {
      value = static_cast<T>(next());
    } else if constexpr (std::same_as<T, std::string>) {
      const auto length = next() % 9;
      value = std::string(length, static_cast<char>('a' + next() % 26));
    } else if constexpr (detail::kIsVector<T>) {
      value.resize(1 + next() % 3);
      for (auto& element : value) fill(element);
    } else if constexpr (detail::kIsArray<T>) {
      for (auto& element : value) fill(element);
    } else {
      T::fields(value, [this](auto, auto& member, auto&&...) { fill(member); });
    }
  }

 private:
  // splitmix64
  std::uint64_t next() {
    auto z = (state_ += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_;
};

// Calls with one of each, with the name that the golden bytes stand under.
void forEachMessage(auto&& call) {
  call("HELLO", Hello{});
  call("WELCOME", Welcome{});
  call("DESCRIPTOR", Descriptor{});
  call("TEST_PATTERN", TestPattern{});
  call("START", Start{});
  call("STOP", Stop{});
  call("CREDIT", Credit{});
  call("GAP", Gap{});
  call("HEARTBEAT", Heartbeat{});
  call("HEARTBEAT_CHANGE", HeartbeatChange{});
  call("SHORT_SAMPLES", ShortSamples{});
  call("TRIGGER", Trigger{});
  call("TRIGGER_GAP", TriggerGap{});
  call("REQUEST", Request{});
  call("ANSWER", Answer{});
  call("REFUSAL", Refusal{});
  call("status answer", Status::Answer{});
  call("post_marker request", PostMarker::Request{});
  call("start_procedure request", StartProcedure::Request{});
  call("start_procedure answer", StartProcedure::Answer{});
  call("procedure_status answer", ProcedureStatus::Answer{});
  call("list_results request", ListResults::Request{});
  call("list_results answer", ListResults::Answer{});
  call("accept_result request", AcceptResult::Request{});
  call("accept_result answer", AcceptResult::Answer{});
  call("rollback_result request", RollbackResult::Request{});
  call("rollback_result answer", RollbackResult::Answer{});
  call("result_history request", ResultHistory::Request{});
  call("result_history answer", ResultHistory::Answer{});
  call("set_inhibit request", SetInhibit::Request{});
  call("corrections answer", Corrections::Answer{});
  call("get_dataset request", GetDataset::Request{});
  call("get_dataset answer", GetDataset::Answer{});
  call("abort_procedure request", AbortProcedure::Request{});
  call("home_axes request", HomeAxes::Request{});
  call("enable_sources request", EnableSources::Request{});
  call("loop_back request", LoopBack::Request{});
  call("loop_back answer", LoopBack::Answer{});
  call("tell_pose request", TellPose::Request{});
  call("propose_case request", ProposeCase::Request{});
  call("propose_case answer", ProposeCase::Answer{});
  call("follow_case request", FollowCase::Request{});
  call("follow_case answer", FollowCase::Answer{});
  call("get_result request", GetResult::Request{});
  call("get_result answer", GetResult::Answer{});
  call("tell_positions request", TellPositions::Request{});
  call("provision request", Provision::Request{});
  call("provision answer", Provision::Answer{});
  call("provision_keys request", ProvisionKeys::Request{});
  call("describe_unit answer", DescribeUnit::Answer{});
  call("offer_update request", OfferUpdate::Request{});
  call("offer_update answer", OfferUpdate::Answer{});
  call("send_update request", SendUpdate::Request{});
  call("send_update answer", SendUpdate::Answer{});
  call("install_update request", InstallUpdate::Request{});
  call("install_update answer", InstallUpdate::Answer{});
  call("update_status answer", UpdateStatus::Answer{});
  call("describe_machine answer", DescribeMachine::Answer{});
}

}  // namespace probebox::messages
