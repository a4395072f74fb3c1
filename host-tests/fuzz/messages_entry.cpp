#include "messages_entry.hpp"

#include <array>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "protocol/messages/cases.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/stream.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using namespace probebox::messages;
using fuzz::require;

using Bytes = std::span<const std::byte>;

// Twice, because bytes that are understood may leave out what has a default.
template <class Message>
void feed(Bytes bytes) {
  const auto understood = decode<Message>(bytes);
  if (!understood) return;
  const auto once = encoded(*understood);
  const auto again = decode<Message>(once);
  require(again.ok(), "what was understood codes to something that is not");
  require(encoded(*again) == once, "what was understood codes differently the second time");
}

template <class... Operations>
constexpr auto bothOf() {
  return std::array{&feed<typename Operations::Request>..., &feed<typename Operations::Answer>...};
}

constexpr auto kOperations =
    bothOf<Status, PostMarker, StartProcedure, ProcedureStatus, AbortProcedure, ListResults, AcceptResult, Corrections,
           GetDataset, RollbackResult, ResultHistory, SetInhibit, HomeAxes, EnableSources, LoopBack, TellPose,
           ProposeCase, FollowCase, GetResult, TellPositions, Provision, ProvisionKeys, DescribeUnit, OfferUpdate,
           SendUpdate, InstallUpdate, UpdateStatus, DescribeMachine>();
constexpr std::array kStream{
    &feed<Hello>,     &feed<Welcome>,         &feed<Descriptor>,   &feed<TestPattern>,       &feed<Start>,
    &feed<Stop>,      &feed<Credit>,          &feed<Gap>,          &feed<Trigger>,           &feed<TriggerGap>,
    &feed<Heartbeat>, &feed<HeartbeatChange>, &feed<ShortSamples>, &feed<messages::Request>, &feed<Answer>,
    &feed<Refusal>};

}  // namespace

std::size_t kindsOfMessages() {
  return kStream.size() + kOperations.size();
}

int feedMessages(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  if (size < 1) return 0;
  const auto rest = std::as_bytes(std::span{data + 1, size - 1});
  const std::size_t kind = data[0] % kindsOfMessages();
  if (kind < kStream.size()) {
    kStream[kind](rest);
  } else {
    kOperations[kind - kStream.size()](rest);
  }
  return 0;
}
