#pragma once
#include <cstddef>
#include <cstdint>

#include "firmware/box/placed_trigger.hpp"
#include "firmware/box/state.hpp"
#include "firmware/store/store.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/stream.hpp"

// Converts results, transitions and corrections to messages.
namespace probebox::app {

messages::ResultState wireState(store::State state);
messages::ResultSummary summaryOf(const store::Record& record);
// Reduces the summary to `most_bytes`: keeps the values from `first` on that fit, and states which they are. Warnings
// that would leave no room for a value are cut off and counted. Returns true if no later value is omitted.
bool keepValues(messages::ResultSummary& summary, std::uint32_t first, std::size_t most_bytes);
messages::ResultTransition wireTransition(const store::Transition& transition);
messages::Corrections::Answer correctionsAnswer(const box::State& state, std::vector<messages::ValueInUse> in_use = {});
messages::Trigger wireTrigger(const box::PlacedTrigger& placed);

}  // namespace probebox::app
