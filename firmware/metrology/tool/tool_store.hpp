#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Columns of the tables holder_store and tool_store.
inline constexpr MethodColumn kStoredSd{"sd_mm", ColumnRole::given};
inline constexpr MethodColumn kHolderColumns[]{column::number("holder_id"), column::given("L1_mm"), kStoredSd};
inline constexpr MethodColumn kToolColumns[]{column::number("tool_id"), column::given("L2_mm"), kStoredSd};

// Takes stored lengths from the tables holder_store and tool_store
// (CN103801980, docs/metrology.md (C4)). The keys holder_id and tool_id, numbers, select a row of each, which gives
// L1_mm and L2_mm and their sd. Returns a case without these tables unchanged. Refuses: missing-id (none stated, or not
// in the store), duplicated-id, bad-config (a length in the case and in the store), missing-key (measured_at_s, seconds
// since 1970, without which nothing can be written back), and what checkedTable does.
Outcome<Dataset, Refusal> withStoredLengths(const Dataset& dataset);

// Returns the stored length for a key; nothing if no store has it, its sd is zero, or withStoredLengths would refuse.
std::optional<StoredLength> storedLength(const Dataset& dataset, std::string_view key);

// Adds the records to be written back to the stores: motion_control_mm (W2x, W2y, L4), simulation_mm (W1x, W1y, L3),
// tool_id, holder_id, measured_at_s. Adds nothing if the case has no stores.
void addStoreRecords(Result& result, const Dataset& dataset);

}  // namespace probebox::metrology
