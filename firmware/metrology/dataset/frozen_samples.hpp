#pragma once
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Checks a table of deflections with the channels a, b, c. by: its column of numbers, touch or scan. Refuses
// frozen-channel: a channel with one value in all samples of a touch or scan, while another one has noise of at least
// its own resolution. Zero is accepted: a probe without the channel is recorded so.
std::optional<Refusal> frozenSamples(const Table& probe, std::string_view by);

}  // namespace probebox::metrology
